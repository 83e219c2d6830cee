"""Latin hypercubes: exact if the budget allows, unbiased and within it otherwise."""

from itertools import combinations, pairwise, product

import numpy as np
import pytest

from nested_agents.core.evaluators import ExactEnumeration, LatinHypercube
from nested_agents.core.evaluators.latin_hypercube import LEAST, joint_moves, latin_hypercube
from nested_agents.core.hierarchy import Hierarchy
from nested_agents.core.rules.rule_base import RuleBase
from nested_agents.core.settings import BatchTDSettings, Decision, RuleBaseSettings
from nested_agents.core.team import _build_evaluator
from nested_agents.scenarios import BoxPushingSettings
from nested_agents.scenarios.box_pushing.prediction.prediction import BoxPrediction

A, DISCOUNT, UNBOUNDED = 4, 0.9, 10**9
OTHERS = ("max", "mean", "observed")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def chain(agents: tuple[str, ...]) -> Hierarchy:
    return Hierarchy(agents, list(pairwise(agents)))


def pushing_in(state_space: str):
    scenario = BoxPushingSettings(robots=3, state_space=state_space).build()
    scenario.reset(2)
    rng = np.random.default_rng(2)
    for _ in range(8):
        scenario.step(rng.integers(A, size=6))
    rules = RuleBase.build(scenario.state_space, RuleBaseSettings())
    theta = rng.normal(size=(6, rules.n_rules))
    return scenario, rules, theta, rng.dirichlet(np.ones(A), size=6)


@pytest.fixture(scope="module")
def pushing():
    """Three robots, six wheel agents, in the middle of an episode: where, and what they know."""
    return pushing_in("relational")


@pytest.mark.parametrize("others", OTHERS)
@pytest.mark.parametrize("rule", ["value", "reward", "reward-and-value"])
@pytest.mark.parametrize(
    "edges", [[(0, 1), (1, 2), (2, 3)], [(2, 0), (2, 1), (2, 3)], [(0, 2)], []], ids=str
)
def test_all_is_tried_if_the_budget_allows(
    edges, rule: str, others: str, line_world, rng: np.random.Generator
) -> None:
    world = line_world(2, 2)
    world.reset(3)
    names = world.agents
    hierarchy = Hierarchy(names, [(names[i], names[j]) for i, j in edges])
    rules = RuleBase.build(world.state_space, RuleBaseSettings(memberships=3, order=2))
    common = (rules, hierarchy, A, rule, others, DISCOUNT)
    exact = ExactEnumeration(*common)
    evaluator = LatinHypercube(world.groups, UNBOUNDED, *common)
    theta, frequencies = rng.normal(size=rules.n_rules), rng.dirichlet(np.ones(A), size=4)
    prediction, joint = world.predict(), np.full(4, 2)
    for agent in hierarchy.order:
        joint[list(hierarchy.above(agent))] = 1
        arguments = (agent, joint, theta, prediction, frequencies, rng)
        assert evaluator.values(*arguments) == pytest.approx(
            exact.values(*arguments), rel=0, abs=1e-12
        )


@pytest.mark.parametrize(
    ("state_space", "others"), [*product(["relational"], OTHERS), ("paper", "mean")]
)
def test_moves_that_come_to_the_same_are_tried_once(state_space: str, others: str) -> None:
    scenario, rules, theta, frequencies = pushing_in(state_space)
    hierarchy, prediction = chain(scenario.agents), scenario.predict()
    common = (rules, hierarchy, A, "value", others, DISCOUNT)
    exact, evaluator = (
        ExactEnumeration(*common),
        LatinHypercube(scenario.groups, UNBOUNDED, *common),
    )
    # Its table takes own poses as if alone, which matters where they are variables.
    exact._tabulated = state_space == "relational"
    for agent in range(6):
        joint = np.full(6, scenario.action_set.neutral)
        joint[:agent] = 3
        given = (agent, joint, theta[agent], prediction, frequencies, np.random.default_rng(0))
        assert evaluator.values(*given) == pytest.approx(exact.values(*given), rel=0, abs=1e-10)
    assert evaluator.counts.joint_actions < exact.counts.joint_actions / 4


def test_a_body_is_predicted_once_for_both_its_wheels(pushing, monkeypatch) -> None:
    scenario, rules, theta, frequencies = pushing
    predicted = []
    push = BoxPrediction._after
    monkeypatch.setattr(
        BoxPrediction, "_after", lambda *given: predicted.append(len(given[1])) or push(*given)
    )
    common = (rules, chain(scenario.agents), A, "value", "observed", DISCOUNT)
    evaluator = LatinHypercube(scenario.groups, 600, *common)
    prediction, rng = scenario.predict(), np.random.default_rng(0)
    for agent in range(6):
        joint = np.full(6, scenario.action_set.neutral)
        evaluator.values(agent, joint, theta[agent], prediction, frequencies, rng)
    assert len(predicted) == 3
    assert sum(predicted) * 3 <= 600


@pytest.mark.parametrize("others", ["mean", "observed"])
def test_draws_are_unbiased_and_better_than_chance(others: str, pushing) -> None:
    scenario, rules, theta, frequencies = pushing
    common = (rules, chain(scenario.agents), A, "value", others, DISCOUNT)
    prediction, rng = scenario.predict(), np.random.default_rng(1)
    joint = np.full(6, scenario.action_set.neutral)
    given = (0, joint, theta[0], prediction, frequencies, rng)
    exact = ExactEnumeration(*common).values(*given)
    drawn = []
    for _ in range(60):
        evaluator = LatinHypercube(scenario.groups, 600, *common)
        drawn.append(evaluator.values(*given))
        assert evaluator.counts.joint_actions < 9 * 81
    error = np.std(drawn, axis=0, ddof=1) / np.sqrt(len(drawn))
    assert (np.abs(np.mean(drawn, axis=0) - exact) < 4.0 * error + 1e-12).all()
    assert np.std(drawn, axis=0).max() < 0.1 * np.ptp(exact)


def test_every_body_draws_its_moves_as_often_as_they_are_likely(rng: np.random.Generator) -> None:
    chances = rng.dirichlet(np.ones(9), size=5)
    chances[2] = 0.0
    chances[3, :8] = 0.0
    codes, weights = joint_moves(chances, 64, rng)
    assert weights.sum() == pytest.approx(1.0)
    assert (codes[:, 2] == 0).all()
    assert (codes[:, 3] == 8).all()
    for g in (0, 1, 4):
        often = np.bincount(codes[:, g], minlength=9)
        assert np.abs(often - len(codes) * chances[g]).max() < 2.0
    assert len(np.unique(codes[:, [0, 1]], axis=0)) > 20


@pytest.mark.parametrize(("most", "d", "m"), [(130, 12, 121), (130, 13, 130), (100, 3, 100)])
def test_every_slice_of_the_cube_holds_one_point(
    most: int, d: int, m: int, rng: np.random.Generator
) -> None:
    places = latin_hypercube(most, d, rng)
    assert places.shape == (d, m)
    assert (np.sort((places * m).astype(int), axis=1) == np.arange(m)).all()
    if m == 121:  # an orthogonal array: so does every square that two sides span
        levels = (places * 11).astype(int)
        for i, j in combinations(range(d), 2):
            assert len(np.unique(11 * levels[i] + levels[j])) == m


def test_a_crowd_is_tried_sparsely(line_world, rng: np.random.Generator) -> None:
    world = line_world(20, 2)
    world.reset(3)
    rules = RuleBase.build(world.state_space, RuleBaseSettings(memberships=3))
    common = (rules, chain(world.agents), A, "value", "max", DISCOUNT)
    theta, frequencies = rng.normal(size=rules.n_rules), np.full((40, A), 1 / A)
    for budget, tried in ((1, LEAST), (20 * 20 * 16 * 32, 32)):
        evaluator = LatinHypercube(world.groups, budget, *common)
        evaluator.values(0, np.full(40, 2), theta, world.predict(), frequencies, rng)
        # Bodies low in the chain leave some of their shares of the budget to those above.
        assert tried <= evaluator.counts.joint_actions / 16 <= 1.2 * tried


def test_same_seed_same_values_and_none_before_anything_is_learned(pushing) -> None:
    scenario, rules, theta, frequencies = pushing
    common = (rules, chain(scenario.agents), A, "value", "mean", DISCOUNT)
    joint, found = np.full(6, scenario.action_set.neutral), []
    for weights in (theta[0], theta[0], np.zeros_like(theta[0])):
        evaluator = LatinHypercube(scenario.groups, 500, *common)
        rng = np.random.default_rng(9)
        found.append(evaluator.values(0, joint, weights, scenario.predict(), frequencies, rng))
    assert (found[0] == found[1]).all()
    assert (found[2] == 0.0).all()


def test_a_spec_chooses_it_for_any_scenario(line_world) -> None:
    world = line_world(2, 2)
    settings = BatchTDSettings(decision=Decision(evaluator="latin-hypercube", budget=50))
    rules = RuleBase.build(world.state_space, RuleBaseSettings())
    found = _build_evaluator(settings.decision, rules, chain(world.agents), world, DISCOUNT)
    assert isinstance(found, LatinHypercube)
    assert found.budget == 50
