"""Every registered topology, over 2 to 8 agents, makes a team that acts, learns, saves, permutes.

A topology that is added is covered from then on, with its defaults or the table given here.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acting import fuzzy, joint_of
from pydantic import TypeAdapter

from nested_agents.core.agents.joint import join_agents
from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.td import TDLambdaSettings
from nested_agents.core.search.evaluator import DecisionContext
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.core.values.rule_base import RuleBaseSettings
from nested_agents.scenarios.line_up import LineUp, LineUpSettings
from nested_agents.topologies import TOPOLOGIES, Topology, build

ADAPTER = TypeAdapter(Topology)
SIZES = (2, 4, 6, 8)
KINDS = [*sorted(TOPOLOGIES.built_in), "pairs.py:pairs"]
LEARNER = TDLambdaSettings(
    step_size=0.1,
    rule_base=RuleBaseSettings(order=1),
    decision=DecisionSettings(teammates="uniform", evaluator="exact"),
)


def required(kind: str, agents: tuple[str, ...], folder: Path) -> dict[str, object]:
    """What the settings of a kind cannot do without."""
    (folder / "pairs.py").write_text("def pairs(agents, groups): return [g[:2] for g in groups]")
    (folder / "all.json").write_text(json.dumps({"edges": [], "alone": agents}))
    tables: dict[str, dict[str, object]] = {
        "edges": {"edges": [agents[:2]], "alone": agents[2:]},
        "file": {"path": str(folder / "all.json")},
    }
    if kind == "pairs.py:pairs":
        return {"kind": f"{folder}/{kind}"}
    return {"kind": kind, **tables.get(kind, {})}


def pairs(n: int) -> tuple[tuple[int, ...], ...]:
    return tuple((i, i + 1) for i in range(0, n, 2))


@pytest.fixture(params=[(kind, n) for kind in KINDS for n in SIZES],
                ids=lambda p: f"{p[0]}-{p[1]}")  # fmt: skip
def case(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[LineUp, Hierarchy]:
    kind, n = request.param
    scenario = LineUp(LineUpSettings(carts=n))
    settings = ADAPTER.validate_python(required(kind, scenario.agents, tmp_path))
    return scenario, build(settings, scenario.agents, pairs(n))


def team_of(scenario: LineUp, hierarchy: Hierarchy) -> Team:
    return Team(LEARNER, scenario, hierarchy, policy_seed(0))


def steps(scenario: LineUp, team: Team, first_episode: int = 0) -> list[list[int]]:
    records = control_loop(scenario, team, episodes=2, steps=2, seed=0, first_episode=first_episode)
    return [record.joint_action.tolist() for record in records]


def test_it_is_a_hierarchy_of_all_agents(case: tuple[LineUp, Hierarchy]) -> None:
    scenario, hierarchy = case
    assert hierarchy.agents == scenario.agents
    rank = {agent: k for k, agent in enumerate(hierarchy.order)}
    assert all(rank[a] < rank[b] for a, b in hierarchy.edges)


def test_it_acts_learns_saves_and_loads(case: tuple[LineUp, Hierarchy], tmp_path: Path) -> None:
    scenario, hierarchy = case
    team = team_of(scenario, hierarchy)
    joint_actions = steps(scenario, team)
    assert np.shape(joint_actions) == (4, len(hierarchy))
    assert {a for joint in joint_actions for a in joint} <= set(range(4))
    assert np.isfinite(fuzzy(team).learner.theta).all()
    assert (np.abs(fuzzy(team).learner.theta).sum(axis=1) > 0).all()  # every agent learned
    assert fuzzy(team).evaluator is not None
    assert fuzzy(team).evaluator.counts.joint_actions == 4 * hierarchy.count_joint_actions(4)
    team.save(tmp_path / "team.npz")
    other = team_of(scenario, hierarchy)
    other.load(tmp_path / "team.npz")
    assert steps(scenario, other, 2) == steps(scenario, team, 2)
    assert (fuzzy(other).learner.theta == fuzzy(team).learner.theta).all()


def test_listing_the_agents_otherwise_changes_nothing_but_the_order(
    case: tuple[LineUp, Hierarchy], permuted: Any
) -> None:
    scenario, hierarchy = case
    n = len(hierarchy)
    rng = np.random.default_rng(n)
    permutation = rng.permutation(n)
    prediction, theta = predicted(scenario, rng), rng.normal(size=(n, 10))
    values = decided_values(team_of(scenario, hierarchy), theta, prediction)

    class Listed(LineUp):
        def __init__(self) -> None:
            super().__init__(LineUpSettings(carts=n))
            self.agents = tuple(scenario.agents[i] for i in permutation)

    other = Listed()
    other.reset(0)
    other._places = scenario._places[permutation]
    other._commands = scenario._commands[permutation]
    other._speeds = scenario._speeds[permutation]
    team = team_of(other, permuted(hierarchy, permutation))
    found = decided_values(team, theta[permutation], other.predict())
    np.testing.assert_allclose(found, values[permutation], atol=1e-12)


def predicted(scenario: LineUp, rng: np.random.Generator):
    scenario.reset(0)
    for _ in range(2):
        scenario.step(rng.integers(4, size=len(scenario.agents)))
    return scenario.predict()


def decided_values(team: Team, theta: np.ndarray, prediction) -> np.ndarray:
    """The values of every agent's actions, everyone above it doing nothing."""
    n = len(team.hierarchy)
    assert fuzzy(team).evaluator is not None
    neutral = np.full(n, team.action_set.neutral)
    known = prediction, theta, np.full((n, 4), 0.25), np.random.default_rng(0)
    return np.array(
        [fuzzy(team).evaluator.values(DecisionContext(i, neutral, *known)) for i in range(n)]
    )


@pytest.mark.parametrize("n", [2, 4])
def test_the_single_agent_acts_learns_saves_and_loads(n: int, tmp_path: Path) -> None:
    scenario = join_agents(LineUp(LineUpSettings(carts=n)), "team")
    hierarchy = build("chain", scenario.agents)
    team = Team(LEARNER, scenario, hierarchy, policy_seed(0))
    joint_actions = steps(scenario, team)
    assert max(map(max, joint_actions)) < 4**n
    assert np.abs(fuzzy(team).learner.theta).sum() > 0
    team.save(tmp_path / "team.npz")
    other = Team(LEARNER, scenario, hierarchy, policy_seed(1))
    other.load(tmp_path / "team.npz")
    assert steps(scenario, other, 2) == steps(scenario, team, 2)


class Told(LineUp):
    """Line-up, with the joint actions that are asked about on record."""

    def predict(self):
        prediction = super().predict()
        asked: list[np.ndarray] = []
        states = prediction.states

        def recorded(agent: int, joint_actions: np.ndarray) -> np.ndarray:
            asked.append(joint_actions.copy())
            return states(agent, joint_actions)

        prediction.states = recorded  # type: ignore[method-assign]
        prediction.asked = asked  # type: ignore[attr-defined]
        return prediction


def test_agents_that_are_not_seen_maintain() -> None:
    scenario = Told(LineUpSettings(carts=4))
    maintain = scenario.action_set.neutral
    hierarchy = Hierarchy(scenario.agents, [("cart1", "cart2")])  # cart3, cart4 unseen by both
    team = team_of(scenario, hierarchy)
    fuzzy(team).learner.theta[:] = (
        1.0  # with all weights zero nothing would be asked of the prediction
    )
    scenario.reset(0)
    prediction = scenario.predict()
    joint = joint_of(team, scenario, prediction=prediction)
    first, second, third, fourth = prediction.asked  # type: ignore[attr-defined]
    assert (first[:, 2:] == maintain).all()
    assert len(np.unique(first[:, :2], axis=0)) == 16  # all actions of itself and the one below
    assert (second[:, 0] == joint[0]).all()  # passed down
    assert (second[:, 2:] == maintain).all()
    assert (np.delete(third, 2, axis=1) == maintain).all()  # though cart1 and cart2 have decided
    assert (np.delete(fourth, 3, axis=1) == maintain).all()
