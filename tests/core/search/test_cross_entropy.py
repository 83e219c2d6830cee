"""Plans of several decisions, on a corridor whose best way is known."""

from __future__ import annotations

import numpy as np
import pytest
from acting import fuzzy
from pydantic import ValidationError

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.spaces import StateSpace, Variable
from nested_agents.core.search.coordination import CrossEntropySettings
from nested_agents.core.search.evaluator import DecisionContext, DecisionProblem, Evaluator
from nested_agents.core.values.rule_base import RuleBase, RuleBaseSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

RULES = RuleBase.build(StateSpace("s", (Variable("x", "1", 0.0, 1.0),)), RuleBaseSettings())


class Corridor(Prediction):
    """Two walkers go back, stay or go on; they are paid in the third cell, where both must be."""

    def __init__(self, at: tuple[int, ...] = (0, 0)) -> None:
        self.at = at

    def states(self, agent: int, joint_actions: np.ndarray) -> np.ndarray:
        return np.zeros((len(joint_actions), 1))

    def rewards(self, joint_actions: np.ndarray) -> np.ndarray:
        return (self.at + joint_actions - 1 == 3).all(axis=1).astype(float)

    def after(self, joint_action: np.ndarray) -> Corridor:
        return Corridor(tuple(self.at + joint_action - 1))


def planner(rule: str = "reward", edges: tuple[str, ...] = ("ab",), **settings: float) -> Evaluator:
    hierarchy = Hierarchy("ab", [tuple(edge) for edge in edges])
    problem = DecisionProblem(RULES, hierarchy, 3, ((0,), (1,)), rule, "best-response", 0.9, "own")
    return CrossEntropySettings(**settings).build(problem)


def decided(evaluator: Evaluator, prediction: Corridor, seed: int = 0) -> list[int]:
    rng, joint = np.random.default_rng(seed), np.ones(2, dtype=np.int64)
    for agent in (0, 1):
        asked = DecisionContext(agent, joint, prediction, [], np.full((2, 3), 1 / 3), rng)
        joint[agent] = int(evaluator.values(asked).argmax())
    return joint.tolist()


def test_a_plan_of_three_decisions_finds_what_one_decision_cannot() -> None:
    evaluator = planner(horizon=3, samples=400, iterations=4)
    assert [decided(evaluator, Corridor((k, k)), k) for k in range(4)] == [[2, 2]] * 3 + [[1, 1]]
    short = {tuple(decided(planner(horizon=1), Corridor(), seed)) for seed in range(9)}
    assert len(short) > 1, "what is paid for nothing is drawn at random"


def test_equal_seeds_plan_alike_and_what_is_tried_is_counted() -> None:
    one, two = (planner(horizon=2, samples=16, iterations=2) for _ in range(2))
    assert decided(one, Corridor(), 5) == decided(two, Corridor(), 5)
    assert 0 < one.counts.joint_actions <= 2 * 2 * 16
    assert one.counts.rule_evaluations == 0


def test_what_cannot_be_planned_is_refused_in_one_line() -> None:
    with pytest.raises(ValueError, match="rule = 'value': cross-entropy plans by 'reward' only"):
        planner("value")
    with pytest.raises(ValueError, match="first agent is above all others"):
        planner(edges=())
    with pytest.raises(ValidationError, match="horizon"):
        CrossEntropySettings.model_validate({"horizon": 0})


def session(scenario: dict) -> Session:
    decision = {"rule": "reward", "evaluator": {"kind": "cross-entropy", "samples": 4}}
    spec = Spec.of({"seeds": 1, "episodes": 1, "steps": 3, "scenario": scenario,
                    "learner": {"kind": "frozen", "decision": decision}})  # fmt: skip
    return Session(trials_of(spec)[0])


@pytest.mark.parametrize("kind", ["kinematic-chain", "box-pushing"])
def test_arms_and_boxes_can_be_planned_for(kind: str) -> None:
    there = session({"kind": kind})
    there.train(1)
    assert fuzzy(there.team).evaluator.counts.joint_actions > 12


def test_a_scenario_that_predicts_one_decision_only_is_refused() -> None:
    with pytest.raises(ValueError, match="a scenario that predicts from predicted states"):
        session({"kind": "line-up"}).train(1)


def test_an_arm_goes_on_from_where_it_is_predicted_to_be() -> None:
    arm = KinematicChainSettings(joints=5).build()
    arm.reset(3, 0)
    rng = np.random.default_rng(3)
    first, then = rng.integers(4, size=5), rng.integers(4, size=(8, 5))
    onward = arm.predict().after(first)
    arm.step(first)
    np.testing.assert_allclose(onward.states(2, then), arm.predict().states(2, then), atol=1e-12)
    np.testing.assert_allclose(onward.rewards(then), arm.predict().rewards(then), atol=1e-12)


def test_boxes_go_on_from_where_they_are_predicted_to_be() -> None:
    world = BoxPushingSettings().build()
    world.reset(3, 0)
    prediction, joint_action = world.predict(), np.array([0, 1, 0, 0])
    onward, reached = prediction.after(joint_action), prediction.poses(joint_action[None])
    np.testing.assert_array_equal(onward.situation.box, reached.boxes[:, 0])
    np.testing.assert_array_equal(onward.situation.robots, reached.robots[:, :, 0])
    np.testing.assert_array_equal(onward.situation.speeds, prediction.commands(joint_action))
    still = onward.after(np.full(4, 3)).poses(np.full((1, 4), 3))
    np.testing.assert_allclose(still.robots[:, :, 0], onward.situation.robots, atol=1e-3)
