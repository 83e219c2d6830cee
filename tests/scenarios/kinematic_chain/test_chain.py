"""The kinematic chain: its promises, predictions, states, failures, settings and pictures."""

from pathlib import Path

import numpy as np
import pytest
from acting import fuzzy
from PIL import Image

import nested_agents as na
from nested_agents.core.numerics import FloatArray
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings
from nested_agents.scenarios.kinematic_chain.scenario import KinematicChain
from nested_agents.scenarios.kinematic_chain.variables import (
    BUILT_IN,
    CHAIN_VARIABLES,
    ChainView,
    joint_states,
)
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.trial import trials_of

FAILURES = (
    {"kind": "locked", "joints": "joint2", "step": 3},
    {"kind": "stuck", "joints": ("joint1",), "episode": 1, "speed": -0.5},
    {"kind": "weak", "joints": "joint*", "gain": 0.5},
    {"kind": "reversed", "joints": "joint3", "end_episode": 1},
)


def arm(joints: int = 4, **table: object) -> KinematicChain:
    settings = KinematicChainSettings.model_validate({"joints": joints, **table})
    found: KinematicChain = settings.build()
    return found


def moving(joints: int, seed: int = 0, **table: object) -> KinematicChain:
    """An arm some steps into an episode."""
    scenario, rng = arm(joints, **table), np.random.default_rng(seed)
    scenario.reset(seed)
    for _ in range(4):
        scenario.step(rng.integers(4, size=joints))
    return scenario


@pytest.mark.parametrize("joints", [2, 20])
def test_the_checker_finds_nothing(joints: int) -> None:
    failures = FAILURES[:3] if joints < 3 else FAILURES
    for table in ({}, {"failures": failures, "state_space": BUILT_IN}):
        na.check_scenario(lambda table=table: arm(joints, **table), steps=8)


def test_predictions_come_true() -> None:
    scenario, rng = moving(8), np.random.default_rng(1)
    actions = rng.integers(4, size=(20, 8))
    for action in actions:
        prediction = scenario.predict()
        predicted = np.concatenate(prediction.states_by_group(actions), axis=2)
        rewards = prediction.rewards(actions)
        k = int(np.flatnonzero((actions == action).all(axis=1))[0])
        transition = scenario.step(action)
        assert predicted[:, k] == pytest.approx(transition.states, abs=1e-9)
        assert rewards[k] == transition.reward


def test_actions_that_come_to_the_same_are_known_to_best_responses() -> None:
    scenario = arm(3)
    scenario.reset(0)
    for _ in range(4):
        scenario.step(np.zeros(3, dtype=int))
    prediction = scenario.predict()
    first = np.take_along_axis(prediction.speeds, prediction.alike, axis=1)
    assert (first == prediction.speeds).all()
    assert (prediction.alike < np.arange(4)).any()  # at full speed increasing changes nothing


def test_variables_of_all_joints_at_once_equal_those_of_each() -> None:
    scenario = moving(6, state_space=BUILT_IN)
    view = scenario.predict().view_after(np.random.default_rng(3).integers(4, size=(30, 6)))
    states = joint_states(view, scenario._variables, 0, 6)[:, :, 1:]
    for column, name in enumerate(BUILT_IN):
        variable = CHAIN_VARIABLES.find(name)
        for joint in range(6):
            assert states[joint, :, column] == pytest.approx(variable.function(view, joint))


@na.state_variable("m", -1.0, 1.0)
def height(view: ChainView, joint: int) -> FloatArray:
    return view.places[joint, :, 1]


def test_a_state_variable_of_ones_own() -> None:
    settings = KinematicChainSettings(joints=3, state_space=("distance", height))
    na.check_scenario(settings.build, steps=6)
    assert [v.name for v in settings.build().state_space.variables] == [
        "speed", "distance", "height",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("failure", "share"),
    [
        ({"kind": "locked"}, 0.0),
        ({"kind": "weak", "gain": 0.25}, 0.25),
        ({"kind": "reversed"}, -1.0),
        ({"kind": "stuck", "speed": 0.5}, 0.5),
    ],
)
def test_failures_and_who_is_told_of_them(failure: dict[str, object], share: float) -> None:
    scenario = arm(2, failures=({"joints": "joint2", "step": 1, **failure},))
    for told in (False, True):
        world = scenario.with_exact_prediction() if told else scenario
        world.reset(0)
        forth = np.zeros((1, 2), dtype=int)  # half, then full speed
        world.step(forth[0])
        predicted = world.predict().states(1, forth)[0]
        transition = world.step(forth[0])
        assert transition.measured_twists() is not None
        assert transition.measured_twists()[:, 2] == pytest.approx([0.6, share * 0.6])
        assert (np.abs(predicted - transition.states[1]).max() < 1e-9) == told
        assert transition.info["failed"].tolist() == [False, True]


def test_a_self_model_finds_the_locked_joint() -> None:
    scenario = arm(4, failures=({"kind": "locked", "joints": "joint3"},))
    hierarchy = na.build_hierarchy(na.parse_topology("chain"), scenario.agents)
    learner = na.BatchTDSettings.model_validate({"self_model": {"enabled": True}})
    team = na.Team(learner, scenario, hierarchy, na.policy_seed(0))
    for _ in na.control_loop(scenario, team, episodes=1, steps=60, seed=0):
        pass
    assert fuzzy(team).model.self_model is not None
    turning = [effect[2, 0] for effect in fuzzy(team).model.self_model.effects]
    assert turning == pytest.approx([1.0, 1.0, 0.0, 1.0], abs=0.15)


def test_it_brings_what_learns_best_and_a_spec_has_the_last_word() -> None:
    def ridge(spec: dict[str, object]) -> float:
        scenario = {"kind": "kinematic-chain", "joints": 16}
        (condition,) = Spec.of({"scenario": scenario, **spec}).conditions()
        return float(condition.settings.learner.ridge)  # type: ignore[attr-defined]

    assert ridge({}) == pytest.approx(1.6)
    assert ridge({"preset": "own-value"}) == pytest.approx(0.1)
    assert ridge({"learner": {"ridge": 5.0}}) == 5.0
    (plain,) = Spec.of({}).conditions()
    assert plain.settings.learner.ridge == 10.0  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"joints": 1}, "scenario.joints = 1"),
        ({"joints": 6000}, "scenario.joints = 6000"),
        ({"failures": [{"kind": "free", "joints": "joint1"}]}, "free"),
        ({"state_space": ["gap"]}, "gap"),
        ({"state_space": ["distance", "distance"]}, "distinct"),
        ({"failures": [{"kind": "locked", "joints": "joint9"}]}, "no such joint, allowed joint1"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(table: dict[str, object], said: str) -> None:
    with pytest.raises(SpecError, match=said) as refused:
        check_conditions(Spec.of({"scenario": {"kind": "kinematic-chain", **table}}))
    assert "\n" not in str(refused.value)


CONTROLLERS = ("DampedLeastSquares", "CyclicCoordinateDescent")


@pytest.mark.parametrize(("controller", "least"), [(CONTROLLERS[0], 0.9), (CONTROLLERS[1], 0.5)])
@pytest.mark.parametrize("joints", [3, 12])
def test_scripted_controllers_solve_it(controller: str, least: float, joints: int) -> None:
    place = f"nested_agents.scenarios.kinematic_chain.scripted:{controller}"
    spec = Spec.of(
        {
            "preset": "frozen",
            "scenario": {"kind": "kinematic-chain", "joints": joints},
            "learner": {"decision": {"evaluator": place}},
        }
    )
    settings = spec.conditions()[0].settings
    scenario = settings.scenario.build()
    hierarchy = na.build_hierarchy(settings.topology, scenario.agents)
    team = na.Team(settings.learner, scenario, hierarchy, na.policy_seed(0))
    steps = na.control_loop(scenario, team, episodes=10, steps=150, seed=0, learn=False)
    reached = [record.transition.terminated for record in steps if record.last]
    assert np.mean(reached) >= least


def test_scripted_controllers_move_nothing_else() -> None:
    place = "nested_agents.scenarios.kinematic_chain.scripted:DampedLeastSquares"
    spec = Spec.of(
        {
            "preset": "frozen", "seeds": 1, "episodes": 1, "steps": 2,
            "scenario": {"kind": "line-up"}, "learner": {"decision": {"evaluator": place}},
        }
    )  # fmt: skip
    with pytest.raises(ValueError, match="needs a kinematic-chain"):
        na.run_trial(trials_of(spec)[0])


def test_it_learns_from_zero_weights_without_further_keys() -> None:
    spec = Spec.of(
        {"seeds": [0], "episodes": 10, "evaluation": 10, "scenario": {"kind": "kinematic-chain"}}
    )
    session = na.Session(trials_of(spec)[0])
    assert not fuzzy(session.team).learner.theta.any()
    session.train(10)
    session.evaluate()
    evaluated = [row for row in session.result().rows if row.phase == "evaluation"]
    assert np.mean([row.measures["success"] for row in evaluated]) >= 0.9


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_an_episode_is_drawn(suffix: str, tmp_path: Path) -> None:
    scenario = moving(16, failures=({"kind": "locked", "joints": "joint3"},))
    frames = [scenario.measure()]
    for _ in range(3):
        frames.append(scenario.step(np.zeros(16, dtype=int)).info)
    recording = {name: np.stack([f[name] for f in frames]) for name in scenario.recorded}
    recording |= {k: np.asarray(v) for k, v in scenario.constants_of_episode().items()}
    scenario.animate(recording, tmp_path / f"arm{suffix}")
    assert (tmp_path / f"arm{suffix}").stat().st_size > 1000
    if suffix == ".gif":
        with Image.open(tmp_path / "arm.gif") as image:
            assert (image.size, image.n_frames) == ((480, 480), 4)  # type: ignore[attr-defined]
