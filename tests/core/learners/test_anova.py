"""The full product under its prior, against covariances and regressions written out in NumPy."""

from functools import reduce

import numpy as np
import pytest

from nested_agents.core.learners.anova import MOST_RULES, AnovaTD, AnovaTDSettings, spread
from nested_agents.core.learners.batch import REWARD_SCALE, BatchTD, BatchTDSettings
from nested_agents.core.learners.dictionary import Dictionary, kernel
from nested_agents.core.rules.kernels.fuzzy import Partition
from nested_agents.core.rules.rule_base import RuleBase

EXACT = 1e-9
"""A tolerance at which every after-state that differs enters the dictionary."""


def rules_of(membership: str = "triangular", order: int = 3) -> RuleBase:
    partitions = [
        Partition((-1.0, 0.4, 1.0), membership),
        Partition((-1.0, 1.0), membership, 4.0),
        Partition((-1.0, -0.2, 0.5, 1.0), membership),
    ]
    terms = [(0, 1, 2)] if order == 3 else [(0,), (1,), (2,)]
    return RuleBase(partitions, terms, 1)


def covariance(sizes: list[int], rho: float) -> np.ndarray:
    """C, Kronecker products written out."""
    ones = [np.ones((size, size)) for size in sizes]
    full = reduce(np.kron, [one + rho * np.eye(len(one)) for one in ones])
    return (full - reduce(np.kron, ones)) / rho


def degrees_of(rules: RuleBase, states: np.ndarray) -> np.ndarray:
    return np.concatenate(
        [p.strengths(states[:, j]) for j, p in enumerate(rules.partitions)], axis=1
    )


def episodes_of(seed: int, n_agents: int) -> list[tuple]:
    rng = np.random.default_rng(seed)
    return [
        (rng.uniform(-1, 1, (length, n_agents, 3)), 0.01 * rng.normal(size=length), terminal)
        for length, terminal in ((4, True), (1, False), (3, False), (1, True), (5, True))
    ]


def feed(learner: BatchTD | AnovaTD, episode: tuple, last: int | None = None) -> None:
    states, rewards, terminal = episode
    learner.begin_episode()
    for t in range(len(states))[:last]:
        learner.observe(states[t], float(rewards[t]), terminal and t == len(states) - 1)
    if last is None:
        learner.end_episode()


def by_hand(rules: RuleBase, episodes: list[tuple], s: AnovaTDSettings) -> np.ndarray:
    """Weights after regressing on all episodes at once: ridge with theta' C^-1 theta, primal."""
    c = covariance([p.size for p in rules.partitions], s.interaction)
    root = np.linalg.cholesky(c)
    rewards = REWARD_SCALE * np.concatenate([episode[1] for episode in episodes])
    low, high = rewards.min() / (1 - s.discount), rewards.max() / (1 - s.discount)
    rows = []
    for i in range(episodes[0][0].shape[1]):
        theta = np.zeros(rules.n_rules)
        for _ in range(s.regression_iterations):
            features, targets = [], []
            for states, given, terminal in episodes:
                phi = rules.features(states[:, i])
                ahead = given[-1] * REWARD_SCALE / (1 - s.discount)
                for t in range(len(states) - 1, -1, -1):
                    if t == len(states) - 1:
                        if not terminal:
                            ahead = phi[t] @ theta
                            continue
                    else:
                        mixed = (1 - s.trace_decay) * phi[t + 1] @ theta + s.trace_decay * ahead
                        ahead = given[t] * REWARD_SCALE + s.discount * mixed
                    features.append(phi[t] @ root)
                    targets.append(min(max(ahead, low), high))
            x = np.array(features)
            gram = x.T @ x + s.ridge * np.eye(x.shape[1])
            theta = root @ np.linalg.solve(gram, x.T @ np.array(targets))
        rows.append(theta * s.target_averaging_rate / REWARD_SCALE)
    return np.array(rows)


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
@pytest.mark.parametrize("rho", [0.05, 0.7])
def test_the_kernel_is_the_prior_covariance_of_values(membership: str, rho: float) -> None:
    rules = rules_of(membership)
    states = np.random.default_rng(1).uniform(-1, 1, (6, 3))
    phi, degrees = rules.features(states), degrees_of(rules, states)
    bounds = np.array([0, 3, 5, 9])
    found = [[kernel(a, b, rho, bounds) for b in degrees] for a in degrees]
    expected = phi @ covariance([3, 2, 4], rho) @ phi.T
    assert np.array(found) == pytest.approx(expected, rel=0, abs=1e-12)


def test_the_kernel_sums_over_sets_of_variables() -> None:
    # Two variables, LOW and HIGH, memberships (.5, .5) and (1, 0) against (1, 0) and (1, 0):
    # k_1 = .5, k_2 = 1, k = .5 + 1 + rho * .5 = 1.6 at rho = .2.
    a, b = np.array([0.5, 0.5, 1.0, 0.0]), np.array([1.0, 0.0, 1.0, 0.0])
    assert kernel(a, b, 0.2, np.array([0, 2, 4])) == pytest.approx(1.6, abs=1e-14)


def test_spreading_multiplies_by_the_covariance() -> None:
    moment = np.random.default_rng(2).normal(size=24)
    expected = covariance([3, 2, 4], 0.3) @ moment
    assert spread(moment, [3, 2, 4], 0.3) == pytest.approx(expected, rel=0, abs=1e-12)


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
@pytest.mark.parametrize("decay", [0.0, 0.6])
@pytest.mark.parametrize("rho", [0.1, 1.0])
def test_it_is_the_ridge_regression_of_all_rules(membership: str, decay: float, rho: float) -> None:
    rules = rules_of(membership)
    settings = AnovaTDSettings(
        interaction=rho,
        tolerance=EXACT,
        ridge=0.5,
        regression_iterations=4,
        discount=0.8,
        trace_decay=decay,
    )
    episodes = episodes_of(3, 2)
    learner = AnovaTD(settings, rules, np.arange(2))
    for episode in episodes:
        feed(learner, episode, last=len(episode[0]))  # without regressing
    assert learner.end_episode() == 2 * 24
    expected = by_hand(rules, episodes, settings)
    assert abs(expected).max() > 1e-3
    assert learner.theta == pytest.approx(expected, rel=0, abs=1e-10)


def test_without_interactions_it_is_batch_td_of_order_one() -> None:
    common = {
        "ridge": 0.5,
        "regression_iterations": 4,
        "discount": 0.8,
        "target_averaging_rate": 0.5,
    }
    full = AnovaTD(
        AnovaTDSettings(interaction=1e-7, tolerance=EXACT, **common), rules_of(), np.arange(2)
    )
    first = BatchTD(BatchTDSettings(**common), rules_of(order=1), np.arange(2))
    for episode in episodes_of(4, 2):
        feed(full, episode)
        feed(first, episode)
    states = np.random.default_rng(5).uniform(-1, 1, (50, 3))
    for i in range(2):
        expected = first.rules.values(first.theta[i], states)
        assert full.rules.values(full.theta[i], states) == pytest.approx(expected, abs=1e-6)


def test_coordinates_reproduce_the_kernel_of_the_dictionary() -> None:
    rules, rho = rules_of(), 0.2
    states = np.random.default_rng(6).uniform(-1, 1, (200, 3))
    held = Dictionary([3, 2, 4], rho, 0.05, 100)
    held.add(degrees_of(rules, states))
    z, members = held.coordinates, held.members
    assert 5 < len(members) < 24
    phi = rules.features(states)
    exact = phi @ covariance([3, 2, 4], rho) @ phi.T
    assert z @ z[members].T == pytest.approx(exact[:, members], rel=0, abs=1e-12)
    assert held.factor @ held.factor.T == pytest.approx(exact[np.ix_(members, members)], abs=1e-12)
    left = (np.diag(exact) - (z**2).sum(axis=1)) / np.diag(exact)
    assert left.min() > -1e-12
    assert left.max() <= 0.05


def test_the_same_coordinates_however_states_are_divided() -> None:
    degrees = degrees_of(rules_of(), np.random.default_rng(7).uniform(-1, 1, (150, 3)))
    once, often = (Dictionary([3, 2, 4], 0.3, 1e-3, 12) for _ in range(2))
    once.add(degrees)
    for first in range(0, 150, 7):
        often.add(degrees[first : first + 7])
    assert len(once.members) == 12  # as many as allowed
    assert (once.members == often.members).all()
    assert (once.coordinates == often.coordinates).all()


def test_a_restored_learner_goes_on_with_the_same_bits() -> None:
    settings = AnovaTDSettings(
        regression_iterations=3, ridge=0.1, interval=3, tolerance=0.02, dictionary=9
    )
    episodes = episodes_of(8, 2)
    learner, restored = (AnovaTD(settings, rules_of(), np.arange(2)) for _ in range(2))
    for episode in episodes[:3]:
        feed(learner, episode)
    feed(learner, episodes[0], last=3)
    restored.restore({name: array.copy() for name, array in learner.arrays().items()})
    assert (restored.theta == learner.theta).all()
    for each in (learner, restored):
        each.observe(episodes[0][0][3], float(episodes[0][1][3]), True)
        each.end_episode()
        feed(each, episodes[4])
    assert (restored.theta == learner.theta).all()
    assert restored.arrays().keys() == learner.arrays().keys()


@pytest.mark.parametrize("terms", [[(0,), (1,), (2,)], [(0, 1, 2), (0,)]])
def test_other_rule_bases_are_refused(terms: list[tuple[int, ...]]) -> None:
    rules = RuleBase(rules_of().partitions, terms, 1)
    with pytest.raises(ValueError, match=r"set learner\.rule_base\.order = 3") as caught:
        AnovaTD(AnovaTDSettings(), rules, np.arange(1))
    assert "\n" not in str(caught.value)


def test_too_many_rules_are_refused() -> None:
    rules = RuleBase([Partition((0.0, 1.0), "triangular")] * 21, [tuple(range(21))])
    said = f"2097152 rules, allowed up to {MOST_RULES}; use fewer variables or memberships"
    with pytest.raises(ValueError, match=said):
        AnovaTD(AnovaTDSettings(), rules, np.arange(1))
