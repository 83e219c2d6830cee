"""Every kernel against its plain-NumPy reference implementation, over many shapes of rule base."""

from itertools import combinations
from math import pi

import numpy as np
import pytest
import values_oracle as oracle

from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import PooledWeights, RuleBase
from nested_agents.core.values.updates import td_lambda_update

ROWS = np.arange(3)
TERMS = {
    "order 1": [(0,), (1,), (2,), (3,)],
    "order 2": list(combinations(range(4), 2)),
    "order 4": [(0, 1, 2, 3)],
    "mixed": [(0,), (2,), (1, 3), (0, 2, 3)],
    "one variable unused": [(1, 2)],
}


def partitions_of(membership: str) -> list[Partition]:
    return [
        Partition((-1.0, 0.0, 0.5, 2.0), membership),
        Partition((-2.2, -0.5, 0.0, 0.5, 2.2), membership, 2 * pi),
        Partition((0.0, 1.0), membership, steepness=3.0),
        Partition((-1.0, 1.0, 1.5), membership, 4.0, 5.0),
    ]


def states_of(rng: np.random.Generator, m: int, d: int = 4) -> np.ndarray:
    """States inside and outside the ranges, some of them exactly on centers."""
    states = rng.uniform(-4.0, 4.0, (m, d))
    states[: m // 3] = rng.choice([-2.2, -1.0, 0.0, 0.5, 1.0, 2.0], (m // 3, d))
    return states


@pytest.fixture(params=[0, 2, 4], ids=lambda n: f"{n} own")
def n_own(request: pytest.FixtureRequest) -> int:
    return request.param


@pytest.fixture(params=TERMS)
def terms(request: pytest.FixtureRequest) -> list:
    return TERMS[request.param]


@pytest.fixture(params=["triangular", "sigmoid"])
def base(request: pytest.FixtureRequest, terms: list, n_own: int) -> RuleBase:
    return RuleBase(partitions_of(request.param), terms, n_own)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20100)


def test_values(base: RuleBase, rng: np.random.Generator) -> None:
    theta, states = rng.normal(size=base.n_rules), states_of(rng, 60)
    expected = oracle.values(base, theta, states)
    assert base.values(theta, states) == pytest.approx(expected, rel=0, abs=1e-12)


def td_update(
    base: RuleBase,
    theta: np.ndarray,
    rows: np.ndarray,
    trace: np.ndarray,
    states: np.ndarray,
    entered: np.ndarray,
    rewards: np.ndarray,
    constants: tuple,
) -> None:
    active, active_next = base.active(states), base.active(entered)
    td_lambda_update(theta, rows, trace, active, active_next, rewards, constants)


@pytest.mark.parametrize("discount", [0.95, 0.0])
def test_td_update(base: RuleBase, rng: np.random.Generator, discount: float) -> None:
    theta, trace = rng.normal(size=(2, 3, base.n_rules))
    theta_expected, trace_expected, lengths = theta.copy(), trace.copy(), np.array([1.0, 2.0, 0.5])
    rewards = np.array([-0.3, 0.0, 0.7])
    for _ in range(60):
        states, entered = states_of(rng, 6).reshape(2, 3, -1)
        now, ahead = (
            np.einsum("ij,ij->i", base.features(met), theta_expected) for met in (states, entered)
        )
        constants = discount, 0.1 / lengths, 0.38
        td_update(base, theta, ROWS, trace, states, entered, rewards, constants)
        steps = 0.1 * (rewards + discount * ahead - now) / lengths
        oracle.td_update(base, theta_expected, trace_expected, states, steps, 0.38)
    assert trace == pytest.approx(trace_expected, rel=0, abs=1e-12)
    assert theta == pytest.approx(theta_expected, rel=0, abs=1e-12)


def test_forgotten_traces_become_zero() -> None:
    base = RuleBase([Partition((0.0, 1.0), "triangular")], [(0,)])
    theta, trace = np.zeros((1, 2)), np.full((1, 2), 1e-29)
    states = np.array([[0.0]])
    td_update(base, theta, ROWS[:1], trace, states, states, np.ones(1), (0.0, np.ones(1), 0.01))
    assert trace.tolist() == [[1.0, 0.0]]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_values_of_agents(base: RuleBase, rng: np.random.Generator, count: int) -> None:
    theta = rng.normal(size=(5, base.n_rules))
    states = states_of(rng, 5 * count).reshape(5, count, -1)
    expected = [base.features(states[i]) @ theta[i] for i in range(5)]
    assert base.values_of_agents(theta, states) == pytest.approx(
        np.array(expected), rel=0, abs=1e-12
    )


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
@pytest.mark.parametrize("common", [(), (3,), (2, 3)])
def test_summed_values(
    terms: list, n_own: int, membership: str, rng: np.random.Generator, common: tuple[int, ...]
) -> None:
    common = tuple(j for j in common if j >= n_own)
    base = RuleBase(partitions_of(membership), terms, n_own, common=common)
    theta = rng.normal(size=(5, base.n_rules))
    firsts = np.array([0, 2, 5])  # of seven agents five are valued, two of one body, three of one
    agents = np.array([0, 2, 3, 4, 6])
    own = states_of(rng, 7 * 6).reshape(7, 6, 4)[..., :n_own].copy()
    shared = states_of(rng, 2 * 6).reshape(2, 6, 4)
    shared[1][:, list(common)] = shared[0][:, list(common)]
    shared = shared[..., n_own:].copy()
    of_bodies = np.add.reduceat(theta, firsts[:-1], axis=0)
    weights = theta, of_bodies, theta.sum(axis=0)[None]
    pooled = PooledWeights(weights, agents, np.arange(2), firsts)
    expected = np.zeros(6)
    for row, agent in enumerate(agents):
        states = np.concatenate([own[agent], shared[0 if row < 2 else 1]], axis=1)
        expected += base.features(states) @ theta[row]
    assert base.summed_values(pooled, own, shared) == pytest.approx(expected, rel=0, abs=1e-11)


def test_a_states_array_in_any_memory_order(base: RuleBase, rng: np.random.Generator) -> None:
    theta, states = rng.normal(size=base.n_rules), states_of(rng, 12)
    assert (base.values(theta, np.asfortranarray(states)) == base.values(theta, states)).all()
    found, expected = base.values(theta, states[::2]), base.values(theta, states)[::2]
    # Matrix products of sigmoid rule bases round differently if there are fewer rows.
    assert found == pytest.approx(expected, rel=0, abs=0 if base.is_triangular else 1e-12)


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
def test_the_papers_78125_rules(membership: str, rng: np.random.Generator) -> None:
    angle = tuple(float(c) for c in np.linspace(-pi, pi, 5, endpoint=False))
    circle = Partition(angle, membership, 2 * pi)
    line = Partition((0.0, 0.25, 0.5, 0.75, 1.0), membership)
    base = RuleBase([circle, circle, line, line, circle, circle, line], [tuple(range(7))], n_own=4)
    assert base.n_rules == 5**7
    theta, states = rng.normal(size=base.n_rules), rng.uniform(-4, 4, (4, 7))
    expected = [float(base.features(state[None])[0] @ theta) for state in states]
    assert base.values_of_agents(theta[None], states[None])[0] == pytest.approx(
        expected, rel=0, abs=1e-12
    )
    states = np.tile(states, (6, 1))
    states[:, 4:] += 0.01 * rng.normal(size=(24, 3))  # a few own blocks, shared ones near by
    expected = oracle.values(base, theta, states)
    assert base.values(theta, states) == pytest.approx(expected, rel=0, abs=1e-12)

    theta, trace = rng.normal(size=(2, 2, base.n_rules))
    theta_expected, trace_expected = theta.copy(), trace.copy()
    rewards = np.array([1.0, -2.0])
    steps = 0.01 * (rewards - np.einsum("ij,ij->i", base.features(states[:2]), theta))
    constants = 0.0, np.full(2, 0.01), 0.3996
    td_update(base, theta, ROWS[:2], trace, states[:2], states[:2], rewards, constants)
    oracle.td_update(base, theta_expected, trace_expected, states[:2], steps, 0.3996)
    assert np.abs(trace - trace_expected).max() <= 1e-12
    assert np.abs(theta - theta_expected).max() <= 1e-12


def test_add_features(base: RuleBase, rng: np.random.Generator) -> None:
    target, states = rng.normal(size=(3, base.n_rules)), states_of(rng, 3)
    weights = rng.normal(size=3)
    expected = target + weights[:, None] * base.features(states)
    base.add_features(target, ROWS, states, weights)
    assert target == pytest.approx(expected, rel=0, abs=1e-12)


def test_agents_of_one_row_change_it_in_turn(base: RuleBase, rng: np.random.Generator) -> None:
    rows, discount = np.array([1, 0, 1]), 0.95
    theta, trace = rng.normal(size=(2, base.n_rules)), np.zeros((3, base.n_rules))
    expected, trace_expected = theta.copy(), trace.copy()
    rewards = rng.normal(size=3)
    constants = discount, np.full(3, 0.1), 0.38
    for _ in range(4):
        states, entered = states_of(rng, 6).reshape(2, 3, -1)
        td_update(base, theta, rows, trace, states, entered, rewards, constants)
        for i, row in enumerate(rows):
            one = slice(i, i + 1)
            f = oracle.values(base, expected[row], np.stack([states[i], entered[i]]))
            steps = np.array([0.1 * (rewards[i] + discount * f[1] - f[0])])
            oracle.td_update(
                base, expected[row : row + 1], trace_expected[one], states[one], steps, 0.38
            )
    assert theta == pytest.approx(expected, rel=0, abs=1e-12)
    target, weights = theta.copy(), rng.normal(size=3)
    base.add_features(target, rows, states, weights)
    np.add.at(theta, rows, weights[:, None] * base.features(states))
    assert target == pytest.approx(theta, rel=0, abs=1e-12)
