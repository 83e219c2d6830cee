"""The budget of a decision: how it is divided, that no team exceeds it, and what is refused."""

from typing import Any

import numpy as np
import pytest
from acting import fuzzy, joint_of
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.core.agents.joint import join_agents
from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.mixed import MixedSettings, PartOfTeam
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.scenario import Scenario
from nested_agents.core.learners.fitted_q import FittedQSettings
from nested_agents.core.learners.learner import LearnerSettings, TeamSettings
from nested_agents.core.learners.td import FrozenSettings, TDLambdaSettings
from nested_agents.core.search.budget import divide
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings
from nested_agents.scenarios.line_up import LineUp, LineUpPrediction, LineUpSettings
from nested_agents.topologies import build

SEARCHES = ("auto", "exact", "sampling", "best-response")
NEIGHBOR_SEARCHES = ("variable-elimination", "max-plus")
TOPOLOGIES = (
    "independent",
    "chain",
    "chain:reversed",
    "tree",
    "star",
    "teams",
    "simultaneous",
    "random",
)
BUDGETS = (3, 8, 24, 100, 1024)
STEPS = 4


class Pairs(LineUp):
    """Carts that are the wheels of robots, two each."""

    def __init__(self, carts: int) -> None:
        super().__init__(LineUpSettings(carts=carts))
        self.agents = tuple(f"robot{i // 2 + 1}.{'lr'[i % 2]}" for i in range(carts))
        self.roles = ("left", "right") * (carts // 2)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Agents by robot."""
        return tuple((i, i + 1) for i in range(0, len(self.agents), 2))

    def predict(self) -> "PairsPrediction":
        """Return the prediction, whose shared variables are those of the left wheels."""
        return PairsPrediction(super().predict()._places)


class PairsPrediction(LineUpPrediction):
    """Predictions of line-ups with two carts in a group."""

    def states_by_group(self, joint_actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return own variables of all carts, and shared variables of all pairs."""
        own, shared = super().states_by_group(joint_actions)
        return own, shared[::2]


def learner_of(search: Any, budget: int, **decision: Any) -> TDLambdaSettings:
    settings = {"evaluator": search, "budget": budget, **decision}
    return TDLambdaSettings(decision=DecisionSettings(**settings))


def tried_in_decisions(scenario: Scenario, topology: str, learner: TeamSettings) -> list[int]:
    """The number of joint actions that a team tries in each of some decisions, as it learns."""
    hierarchy = build(topology, scenario.agents, scenario.groups)
    team = Team(learner, scenario, hierarchy, policy_seed(0))
    counts = [0]
    for _ in control_loop(scenario, team, episodes=2, steps=STEPS, seed=0):
        counts.append(team.counts.joint_actions)
    return np.diff(counts).tolist()


def least_of(refused: ValueError) -> int:
    """The least possible budget that a refusal names."""
    message = str(refused)
    assert message.startswith("learner.decision.budget = ")
    assert "\n" not in message
    return int(message.split("allowed: ")[1].split()[0].replace(",", ""))


def keeps(scenario: Scenario, topology: str, learner: Any, budget: int) -> bool:
    """Whether a budget is kept in every decision; otherwise it is below the least that is named."""
    try:
        tried = tried_in_decisions(scenario, topology, learner)
    except ValueError as error:
        refused = error
    else:
        assert max(tried) <= budget
        return True
    assert budget < least_of(refused)
    return False


@pytest.mark.parametrize("agents", ["actuator", "body", "team"])
@pytest.mark.parametrize("topology", [*TOPOLOGIES, "coordination-graph"])
def test_no_search_exceeds_the_budget(topology: str, agents: Any) -> None:
    scenario = join_agents(Pairs(4), agents)
    is_graph = topology == "coordination-graph" and agents != "team"
    kept = {
        (search, budget): keeps(scenario, topology, learner_of(search, budget), budget)
        for search in (NEIGHBOR_SEARCHES if is_graph else SEARCHES)
        for budget in BUDGETS
    }
    for search in {search for search, _ in kept}:
        assert kept[search, 1024]
    assert is_graph or kept["sampling", 8]


@pytest.mark.parametrize(
    "decision",
    [
        {"value_of": "team"},
        {"value_of": "below"},
        {"unseen": "plan", "evaluator": "best-response"},
        {"unseen": "last"},
        {"plan": "common", "evaluator": "best-response"},
        {"teammates": "uniform"},
        {"teammates": "empirical"},
        {"errors": {"weights": 0.5}},
        {"evaluator": {"kind": "best-response", "sweeps": 5}},
        {"rule": "random"},
    ],
    ids=str,
)
def test_the_budget_holds_with_all_decision_settings(decision: dict[str, Any]) -> None:
    for topology in ("chain", "tree"):
        for budget in (24, 100):
            learner = learner_of("auto", budget, **decision)
            assert max(tried_in_decisions(Pairs(4), topology, learner)) <= budget


@pytest.mark.parametrize("budget", [24, 48, 96, 1000])
def test_plans_of_several_decisions_keep_to_the_budget(budget: int) -> None:
    arm = KinematicChainSettings(joints=3).build()
    search = {"kind": "cross-entropy", "samples": 8, "horizon": 3}
    learner = learner_of(search, budget, rule="reward")
    assert max(tried_in_decisions(arm, "chain", learner)) <= budget
    with pytest.raises(ValueError, match=r"budget = 23: cross-entropy .* allowed: 24 or more"):
        tried_in_decisions(arm, "chain", learner_of(search, 23, rule="reward"))


def test_every_part_of_a_mixed_team_has_its_own_budget() -> None:
    parts = tuple(
        PartOfTeam(agents=(name,), learner=learner_of("auto", budget))
        for name, budget in (("robot1", 20), ("*", 30))
    )
    tried = tried_in_decisions(Pairs(6), "chain", MixedSettings(parts=parts))
    assert 30 < max(tried) <= 50


def test_learners_of_action_values_try_each_own_action() -> None:
    assert max(tried_in_decisions(Pairs(4), "chain", fitted(16))) == 16
    with pytest.raises(ValueError, match=r"budget = 15: fitted-q .* allowed: 16 or more"):
        tried_in_decisions(Pairs(4), "chain", fitted(15))


def fitted(budget: int) -> LearnerSettings:
    return FittedQSettings(decision=DecisionSettings(budget=budget))


@pytest.mark.parametrize("topology", ["chain", "tree", "star", "independent"])
def test_best_responses_of_zero_weights_are_the_same_with_any_budget(topology: str) -> None:
    scenario = Pairs(4)
    hierarchy = build(topology, scenario.agents, scenario.groups)
    actions = []
    for budget in (None, 24, 1024):
        decision = DecisionSettings(evaluator="best-response", budget=budget)
        learner = FrozenSettings(decision=decision)
        team = Team(learner, scenario, hierarchy, policy_seed(0))
        loop = control_loop(scenario, team, episodes=2, steps=STEPS, seed=0)
        actions.append([step.joint_action.tolist() for step in loop])
        assert team.counts.joint_actions == 0
    assert actions[0] == actions[1] == actions[2]


def test_searches_that_cannot_keep_to_a_budget_are_refused() -> None:
    arm = KinematicChainSettings(joints=3).build()
    script = "nested_agents.scenarios.kinematic_chain.scripted:DampedLeastSquares"
    with pytest.raises(ValueError, match=r"budget = 64: .*DampedLeast.* use sampling, best-resp"):
        tried_in_decisions(arm, "chain", learner_of(script, 64))


@pytest.mark.parametrize("value_of", ["own", "team"])
def test_a_single_agent_compares_a_sample_of_its_actions(value_of: str) -> None:
    """One agent for four carts has 256 actions, of which 64 fit into the budget."""
    scenario = join_agents(Pairs(4), "team")
    learner = learner_of("auto", 64, value_of=value_of)
    assert set(tried_in_decisions(scenario, "independent", learner)) == {64}
    team = Team(learner, scenario, build("independent", scenario.agents), policy_seed(0))
    scenario.reset(0)
    prediction = scenario.predict()
    fuzzy(team).learner.theta[:] = np.random.default_rng(0).normal(size=fuzzy(team).rules.n_rules)
    # The chosen action is the best of the compared ones, and within the upper actions of all.
    states = prediction.states(0, np.arange(256)[:, None])
    values = fuzzy(team).rules.values(fuzzy(team).learner.theta[0], states)
    for _ in range(20):
        chosen = joint_of(team, scenario, explore=False)[0]
        assert (values > values[chosen]).sum() < 64


def test_exact_search_is_refused_below_all_joint_actions() -> None:
    """A chain of four agents with four actions each tries 256 + 64 + 16 + 4 joint actions."""
    assert set(tried_in_decisions(Pairs(4), "chain", learner_of("exact", 340))) == {340}
    with pytest.raises(ValueError, match=r"budget = 339: exact .* allowed: 340 or more"):
        tried_in_decisions(Pairs(4), "chain", learner_of("exact", 339))


@given(st.integers(1, 2000), st.lists(st.integers(1, 500), min_size=1, max_size=12))
def test_shares_are_equal_except_where_agents_need_less(budget: int, needs: list[int]) -> None:
    shares = divide(budget, needs)
    assert sum(shares) <= budget
    assert all(share <= need for share, need in zip(shares, needs, strict=True))
    held = [share for share, need in zip(shares, needs, strict=True) if share < need]
    assert not held or max(held) - min(held) <= 1
    assert not held or budget - sum(shares) < len(needs)
    assert all(share <= min(held, default=500) + 1 for share in shares)
