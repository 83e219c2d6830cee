"""Moments and extremes against enumeration, where sums are exact and values linear."""

from itertools import product

import numpy as np
import pytest

from nested_agents.core.agents.team import Team
from nested_agents.core.decision.settings import Decision
from nested_agents.core.evaluators.additive import Extremes, Moments, directions, sigma_points
from nested_agents.core.evaluators.evaluator import DecisionProblem, Deliberation
from nested_agents.core.evaluators.exact import ExactEnumeration
from nested_agents.core.evaluators.sampling import Sampling
from nested_agents.core.interface.hierarchy import Hierarchy
from nested_agents.core.interface.protocols import Blocks
from nested_agents.core.interface.spaces import StateSpace, Variable
from nested_agents.core.learners.frozen import FrozenSettings
from nested_agents.core.rules.rule_base import RuleBase
from nested_agents.core.rules.settings import RuleBaseSettings

A, NEUTRAL, N = 4, 2, 4
GROUPS = ((0, 1), (2, 3))
SPACE = StateSpace(
    "sum", (Variable("own", "m", 0, 15), Variable("x", "m", -9, 9), Variable("y", "m", -9, 9)), 1
)


class Summed:
    """The shared block of every agent is the sum of what the two groups contribute."""

    superposes = True

    def __init__(self, rng: np.random.Generator) -> None:
        self.contributions = rng.normal(size=(2, A**2, 2))
        self.contributions[0, 7] = self.contributions[0, 5]
        self.alike = np.tile(np.arange(A**2), (2, 1))

    @property
    def superposition(self) -> "Summed":
        return self

    def blocks(self, agent: int) -> Blocks:
        shared = (self.contributions[0][:, None] + self.contributions[1][None]).reshape(-1, 2)
        return Blocks(np.arange(A**2, dtype=float)[:, None], shared, (A**2, 1)[agent // 2])

    def states(self, agent, local, sums, shares) -> np.ndarray:
        assert shares[agent // 2].sum() == 0
        assert shares.sum(axis=1).max() == pytest.approx(1.0)
        return np.concatenate([local[:, None], sums], axis=1)


def problem_of(
    rules: RuleBase, hierarchy: Hierarchy, rule: str, teammates: str, additive: bool = True
) -> DecisionProblem:
    return DecisionProblem(rules, hierarchy, A, GROUPS, additive, rule, teammates, 0.9)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


@pytest.fixture
def rules() -> RuleBase:
    return RuleBase.build(SPACE, RuleBaseSettings(memberships=2))  # two triangles: linear inside


@pytest.fixture(params=[["ab", "bc", "cd"], ["ca", "cb", "cd"], ["ac"], []], ids=str)
def hierarchy(request: pytest.FixtureRequest) -> Hierarchy:
    return Hierarchy("abcd", [tuple(edge) for edge in request.param])


@pytest.mark.parametrize(
    ("additive", "teammates"),
    [(Moments, "uniform"), (Moments, "empirical"), (Extremes, "best-response")],
)
def test_exact_where_values_are_linear(
    additive, teammates: str, hierarchy: Hierarchy, rules: RuleBase, rng: np.random.Generator
) -> None:
    prediction, theta = Summed(rng), rng.normal(size=rules.n_rules)
    if (
        teammates == "best-response"
    ):  # the greatest sum lies along the second axis: one of the directions
        theta[2:4] = 0.0
    frequencies = rng.dirichlet(np.ones(A), size=N)
    common = problem_of(rules, hierarchy, "value", teammates)
    exact = ExactEnumeration(common)
    places = A ** np.arange(N - 1, -1, -1)
    exact._tried = [exact._tried_by(i, places) for i in range(N)]
    evaluator = additive(common)
    for agent in range(N):
        joint = np.full(N, NEUTRAL)
        joint[list(hierarchy.above(agent))] = 1
        asked = Deliberation(agent, joint, prediction, [theta] * N, frequencies, rng)
        assert evaluator.values(asked) == pytest.approx(exact.values(asked), rel=0, abs=1e-12)
    assert evaluator.counts.joint_actions > 0


def test_sigma_points_have_mean_and_covariance(rng: np.random.Generator) -> None:
    root = rng.normal(size=(3, 3))
    mean, covariance = rng.normal(size=3), root @ root.T
    points, weights = sigma_points(mean, covariance)
    assert weights.sum() == pytest.approx(1.0)
    assert weights @ points == pytest.approx(mean)
    assert (weights[:, None] * (points - mean)).T @ (points - mean) == pytest.approx(covariance)


def test_directions_are_unit_and_distinct() -> None:
    found = directions(3)
    assert found.shape == (26, 3)
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.ones(26))
    assert len(np.unique(found.round(9), axis=0)) == 26


@pytest.mark.parametrize(
    ("additive", "rule", "teammates"),
    [
        (Moments, "reward", "uniform"),
        (Moments, "value", "best-response"),
        (Extremes, "value", "uniform"),
    ],
)
def test_what_cannot_be_evaluated_is_refused(
    additive, rule: str, teammates: str, rules: RuleBase
) -> None:
    with pytest.raises(ValueError, match=r"^learner\.decision\.(rule|teammates) = "):
        additive(problem_of(rules, Hierarchy("abcd", []), rule, teammates))


def evaluator_of(world, hierarchy: Hierarchy, decision: Decision):
    settings = FrozenSettings(decision=decision)
    return Team.build(settings, world, hierarchy, np.random.SeedSequence(1)).evaluator


def test_auto_goes_by_size(line_world) -> None:
    for carts, superposes, teammates in product(
        (2, 5, 8), (False, True), ("best-response", "uniform")
    ):
        world = line_world(carts, 2)
        world.superposes = superposes
        chain = Hierarchy(world.agents, list(zip(world.agents, world.agents[1:], strict=False)))
        found = type(evaluator_of(world, chain, Decision(teammates=teammates)))
        additive = Extremes if teammates == "best-response" else Moments
        beyond = additive if superposes else Sampling
        assert found is {2: ExactEnumeration, 5: Sampling, 8: beyond}[carts]


def test_sums_need_a_scenario_that_has_them(line_world) -> None:
    world = line_world(2, 2)
    with pytest.raises(ValueError, match="the scenario predicts no sums"):
        evaluator_of(world, Hierarchy(world.agents, []), Decision(evaluator="extremes"))
