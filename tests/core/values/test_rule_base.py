"""Rule bases: the paper's eight rules by hand, orders, products, values of states and codes."""

import re
from itertools import combinations, pairwise, product
from math import comb

import numpy as np
import pytest

from nested_agents.core.interface.spaces import StateSpace, Variable
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase, RuleBaseSettings

LOW_HIGH = Partition((0.0, 1.0), "triangular")


def space_of(d: int) -> StateSpace:
    return StateSpace("demo", tuple(Variable(f"x{j}", "m", 0.0, 1.0) for j in range(d)), d // 2)


def test_the_papers_eight_rules_by_hand() -> None:
    # P_HIGH = 0.2, 0.5, 0.75 for the three variables, so P_LOW = 0.8, 0.5, 0.25.
    base = RuleBase([LOW_HIGH] * 3, [(0, 1, 2)])
    expected = [
        0.8 * 0.5 * 0.25,  # LOW LOW LOW
        0.8 * 0.5 * 0.75,  # LOW LOW HIGH
        0.8 * 0.5 * 0.25,  # LOW HIGH LOW
        0.8 * 0.5 * 0.75,  # LOW HIGH HIGH
        0.2 * 0.5 * 0.25,  # HIGH LOW LOW
        0.2 * 0.5 * 0.75,  # HIGH LOW HIGH
        0.2 * 0.5 * 0.25,  # HIGH HIGH LOW: w_2 of Section IV-B
        0.2 * 0.5 * 0.75,  # HIGH HIGH HIGH: w_1
    ]
    state = np.array([[0.2, 0.5, 0.75]])
    assert base.features(state)[0] == pytest.approx(expected, abs=1e-15)
    # theta = 1..8 (Eq. 10): 0.1 + 0.6 + 0.3 + 1.2 + 0.125 + 0.45 + 0.175 + 0.6 = 3.55
    assert base.values(np.arange(1.0, 9.0), state) == pytest.approx([3.55], abs=1e-14)


def test_order_one_by_hand() -> None:
    # f = (0.8 * 1 + 0.2 * 2) + (0.5 * 3 + 0.5 * 4) + (0.25 * 5 + 0.75 * 6) = 1.2 + 3.5 + 5.75
    base = RuleBase([LOW_HIGH] * 3, [(0,), (1,), (2,)])
    state = np.array([[0.2, 0.5, 0.75]])
    assert base.features(state)[0] == pytest.approx([0.8, 0.2, 0.5, 0.5, 0.25, 0.75], abs=1e-15)
    assert base.values(np.arange(1.0, 7.0), state) == pytest.approx([10.45], abs=1e-14)


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
@pytest.mark.parametrize("order", range(1, 8))
def test_orders(order: int, membership: str) -> None:
    count = 5 if order == 7 else 3
    settings = RuleBaseSettings(membership=membership, memberships=count, order=order)
    base = RuleBase.build(space_of(7), settings)
    assert base.terms == tuple(combinations(range(7), order))
    assert base.n_rules == comb(7, order) * count**order
    features = base.features(np.random.default_rng(1).uniform(-0.2, 1.2, (4, 7)))
    assert features.sum(axis=1) == pytest.approx(np.full(4, comb(7, order)), rel=1e-12)
    assert features.min() >= 0.0


def test_the_two_rule_bases_of_the_paper_have_35_and_78125_rules() -> None:
    for order, n_rules in ((1, 35), (7, 78125)):
        assert RuleBase.build(space_of(7), RuleBaseSettings(order=order)).n_rules == n_rules


def test_centers_by_variable() -> None:
    settings = RuleBaseSettings(memberships=4, centers={"x1": (-2.0, 0.5, 3.0)})
    base = RuleBase.build(space_of(2), settings)
    assert [partition.size for partition in base.partitions] == [4, 3]
    assert base.partitions[1].centers == (-2.0, 0.5, 3.0)


@pytest.mark.parametrize("centers", [{"x2": (0.0, 1.0)}, {"x1": (0.0,)}, {"x1": (1.0, 0.0)}])
def test_unsuitable_centers_are_refused_with_their_key(centers: dict) -> None:
    (name,) = centers
    with pytest.raises(ValueError, match=rf"^learner\.rule_base\.centers\.{name}: "):
        RuleBase.build(space_of(2), RuleBaseSettings(centers=centers))


def test_a_variables_own_centers_may_differ_in_number() -> None:
    space = StateSpace(
        "demo",
        (
            Variable("x", "m", 0.0, 1.0, centers=(0.0, 0.5, 1.0)),
            Variable("y", "rad", -1.0, 1.0, periodic=True, centers=(-0.5, 0.5)),
        ),
    )
    assert RuleBase.build(space, RuleBaseSettings(order=2)).sizes == (6,)


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
def test_active_rules_are_the_features_that_count(membership: str) -> None:
    settings = RuleBaseSettings(membership=membership, memberships=4, order=2)
    base = RuleBase.build(space_of(3), settings)
    states = np.random.default_rng(2).uniform(-0.2, 1.2, (20, 3))
    rules, strengths = base.active(states)
    assert rules.shape == strengths.shape
    assert rules.shape[1] == (3 * 4 if membership == "triangular" else base.n_rules)
    features = np.zeros((20, base.n_rules))
    for s, k in product(range(20), range(rules.shape[1])):
        features[s, rules[s, k]] += strengths[s, k]
    assert features == pytest.approx(base.features(states), abs=1e-14)


@pytest.mark.parametrize(
    ("terms", "complaint"),
    [
        ([], "distinct and at least one"),
        ([(0,), (0,)], "distinct and at least one"),
        ([()], r"term \(\) must increase within 0 to 1"),
        ([(1, 0)], r"term \(1, 0\) must increase"),
        ([(0, 0)], r"term \(0, 0\) must increase"),
        ([(0, 2)], r"term \(0, 2\) must increase within 0 to 1"),
        ([(-1,)], r"term \(-1,\) must increase"),
    ],
)
def test_a_rule_base_refuses_terms(terms: list, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as caught:
        RuleBase([LOW_HIGH] * 2, terms)
    assert "\n" not in str(caught.value)


def test_rules_that_cannot_be_numbered_are_refused() -> None:
    partition = Partition(np.linspace(0, 1, 256), "triangular")
    with pytest.raises(ValueError, match=f"^rule base: {256**8} rules, allowed {2**63 - 1}"):
        RuleBase([partition] * 8, [tuple(range(8))])  # 2 ** 64, which overflows to 0


def test_a_rule_base_refuses_mixed_shapes() -> None:
    with pytest.raises(ValueError, match="one membership shape"):
        RuleBase([LOW_HIGH, Partition((0.0, 1.0), "sigmoid")], [(0, 1)])


@pytest.mark.parametrize("n_own", [-1, 3])
def test_a_rule_base_refuses_an_impossible_own_block(n_own: int) -> None:
    with pytest.raises(ValueError, match=f"n_own = {n_own}, allowed 0 to 2"):
        RuleBase([LOW_HIGH] * 2, [(0, 1)], n_own)


def test_an_order_above_the_number_of_variables_is_refused() -> None:
    with pytest.raises(ValueError, match=r"order = 4, allowed 1 to 3 in state space 'demo'"):
        RuleBase.build(space_of(3), RuleBaseSettings(order=4))


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
def test_squared_lengths_and_values_by_row(membership: str) -> None:
    settings = RuleBaseSettings(membership=membership, memberships=4, order=2)
    base = RuleBase.build(space_of(3), settings)
    rng = np.random.default_rng(3)
    states, theta = rng.uniform(-0.2, 1.2, (6, 3)), rng.normal(size=(6, base.n_rules))
    features = base.features(states)
    assert base.squared_lengths(states) == pytest.approx((features**2).sum(axis=1), abs=1e-14)
    assert base.values_of_agents(theta, states[:, None])[:, 0] == pytest.approx(
        (features * theta).sum(axis=1), abs=1e-12
    )


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
def test_wrong_shapes_are_refused_in_one_line(membership: str) -> None:
    # Compiled kernels do not look where they read: unchecked, some of these end the process.
    base = RuleBase([Partition((0.0, 1.0), membership)] * 2, [(0, 1)])
    one, four = np.ones((1, 2)), np.ones(4)
    pairs = "rule base: states of shape {}, must be (m, 2)"
    sets = "rule base: states of shape {}, must be (n, s, 2)"
    for call, complaint in (
        (lambda: base.values(four, np.zeros((3, 1))), pairs.format((3, 1))),
        (lambda: base.values(four, np.zeros(2)), pairs.format((2,))),
        (lambda: base.values(np.ones(2), one), "rule base: theta of shape (2,), must be (4,)"),
        (lambda: base.values(one, one), "rule base: theta of shape (1, 2), must be (4,)"),
        (
            lambda: base.values_of_agents(np.ones((1, 4)), np.zeros((2, 1, 2))),
            "rule base: theta of shape (1, 4), must be (2, 4)",
        ),
        (
            lambda: base.values_of_agents(np.ones((1, 4)), np.zeros((1, 1, 3))),
            sets.format((1, 1, 3)),
        ),
        (lambda: base.values_of_agents(np.ones((1, 4)), one), sets.format((1, 2))),
        (lambda: base.squared_lengths(np.zeros((2, 3))), pairs.format((2, 3))),
        (lambda: base.active(np.zeros((2, 1))), pairs.format((2, 1))),
        (lambda: base.active(np.zeros((2, 1, 2))), pairs.format((2, 1, 2))),
        (lambda: base.features(np.zeros((2, 3))), pairs.format((2, 3))),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(complaint)}$"):
            call()


def sigmoid(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-x)))


def sigmoid_degrees(x: float, centers: tuple[float, ...], steepness: float) -> list[float]:
    """Return the membership degrees of Eq. 6 for evenly spaced centers."""
    falls = [1.0]
    for left, right in pairwise(centers):
        falls.append(sigmoid(steepness / (right - left) * (x - (left + right) / 2)))
    falls.append(0.0)
    return [before - after for before, after in pairwise(falls)]


def test_sigmoid_products_equal_sums_over_single_rules() -> None:
    # Three terms that overlap, of one, two and three variables with 2, 3 and 4 functions: a factor
    # that is left out, taken twice or from the wrong variable changes the value.
    centers = [(0.0, 1.0), (0.0, 0.5, 1.0), (-1.0, 0.0, 1.0, 2.0)]
    terms = [(1,), (0, 2), (0, 1, 2)]
    base = RuleBase([Partition(c, "sigmoid", steepness=6.0) for c in centers], terms, n_own=1)
    theta = np.random.default_rng(3).normal(size=base.n_rules)
    states = np.array([[0.2, 0.5, 0.75], [0.9, -0.1, 0.3], [0.45, 0.65, -0.6]])
    features = []
    for state in states.tolist():
        degrees = [sigmoid_degrees(x, c, 6.0) for x, c in zip(state, centers, strict=True)]
        rules = [product(*(degrees[j] for j in term)) for term in terms]
        features.append([float(np.prod(rule)) for of_term in rules for rule in of_term])
    expected = np.array(features) @ theta
    np.testing.assert_allclose(base.features(states), features, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(base.values(theta, states), expected, rtol=1e-12)
    np.testing.assert_allclose(
        base.squared_lengths(states), (np.array(features) ** 2).sum(axis=1), rtol=1e-12
    )
