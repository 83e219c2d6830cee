"""Membership degrees sum to one, are non-negative and continuous, and match the paper."""

from math import exp, pi

import numpy as np
import pytest
import values_oracle as oracle
from hypothesis import given, settings
from hypothesis import strategies as st

from nested_agents.core.interface.spaces import Variable
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.triangular import active_rules, layout

SHAPES = ("triangular", "sigmoid")


@st.composite
def partitions(draw: st.DrawFn, flattest: float = 1.0) -> Partition:
    gaps = draw(st.lists(st.floats(1e-2, 1e2), min_size=1, max_size=14))
    start = draw(st.floats(-1e2, 1e2))
    centers = start + np.concatenate([[0.0], np.cumsum(gaps)])
    closing = draw(st.none() | st.floats(1e-2, 1e2))
    period = 0.0 if closing is None else float(centers[-1] - centers[0] + closing)
    steepness = draw(st.floats(flattest, 100.0))
    shape = draw(st.sampled_from(SHAPES))
    return Partition(tuple(map(float, centers)), shape, period, steepness)


def by_kernel(partition: Partition, x: np.ndarray) -> np.ndarray:
    rules, active = active_rules(x[:, None], layout([partition], [(0,)]))
    strengths = np.zeros((len(x), partition.size))
    np.add.at(strengths, (np.arange(len(x))[:, None], rules), active)
    return strengths


def places(partition: Partition) -> np.ndarray:
    """Values around, on, between and far from the centers."""
    c = np.array(partition.centers)
    span = c[-1] - c[0]
    some = [c, 0.5 * (c[1:] + c[:-1]), c[0] + span * np.linspace(-3, 4, 41), [-1e6, 1e6]]
    return np.concatenate(some)


@given(partitions(), st.lists(st.floats(-1e6, 1e6), max_size=5))
@settings(max_examples=300)
def test_strengths_are_a_partition_of_unity(partition: Partition, more: list[float]) -> None:
    strengths = partition.strengths(np.concatenate([places(partition), more]))
    assert strengths.min() >= 0.0
    assert np.abs(strengths.sum(axis=-1) - 1.0).max() <= 1e-12


@given(partitions())
@settings(max_examples=200)
def test_strengths_are_those_of_the_reference(partition: Partition) -> None:
    x, centers = places(partition), np.array(partition.centers)
    # Where centers lie close together far from 0, exponents lose digits.
    rounding = 4e-16 * partition.steepness * np.abs(centers).max() / np.diff(centers).min()
    expected = pytest.approx(oracle.strengths(partition, x), rel=0, abs=1e-12 + rounding)
    assert partition.strengths(x) == expected


@given(partitions().filter(lambda p: p.membership == "triangular"))
@settings(max_examples=200)
def test_active_rules_have_the_same_strengths(partition: Partition) -> None:
    x = places(partition)
    assert by_kernel(partition, x) == pytest.approx(partition.strengths(x), rel=0, abs=1e-12)


@given(partitions().filter(lambda p: p.period), st.integers(-3, 3))
@settings(max_examples=200)
def test_a_circle_closes(partition: Partition, turns: int) -> None:
    # The seam of the period in use lies opposite the middle of the centers.
    seam = 0.5 * (partition.centers[0] + partition.centers[-1] - partition.period)
    seam += turns * partition.period
    step = 1e-12 * max(1.0, abs(seam), partition.period)
    before, after = partition.strengths(np.array([seam - step, seam + step]))
    steepest = max(1.0, partition.steepness) / np.diff(partition.knots).min()
    assert after == pytest.approx(before, rel=0, abs=1e-10 + 4.0 * steepest * step)


@given(partitions().filter(lambda p: p.period), st.floats(-10, 10), st.integers(-5, 5))
@settings(max_examples=200)
def test_a_circle_repeats(partition: Partition, x: float, turns: int) -> None:
    here, there = partition.strengths(np.array([x, x + turns * partition.period]))
    steepest = max(1.0, partition.steepness) / np.diff(partition.knots).min()
    rounding = 1e-15 * (abs(x) + abs(turns) * partition.period + 100.0)
    assert there == pytest.approx(here, rel=0, abs=1e-10 + 10.0 * steepest * rounding)


@given(partitions())
@settings(max_examples=100)
def test_strengths_are_continuous(partition: Partition) -> None:
    x = places(partition)[:-2]
    step = 1e-9
    steepest = max(1.0, partition.steepness) / np.diff(partition.knots).min()
    change = partition.strengths(x + step) - partition.strengths(x)
    assert np.abs(change).max() <= 1e-10 + 2.0 * steepest * (step + 1e-13)


@pytest.mark.parametrize("count", range(2, 16))
@pytest.mark.parametrize("periodic", [False, True])
def test_triangles_peak_at_their_centers(count: int, periodic: bool) -> None:
    partition = Partition.of(Variable("x", "rad", -pi, pi, periodic), "triangular", count)
    at_centers = partition.strengths(np.array(partition.centers))
    assert at_centers == pytest.approx(np.eye(count), abs=1e-14)
    assert (partition.strengths(np.linspace(-9, 9, 999)) > 0).sum(axis=1).max() == 2


@pytest.mark.parametrize("steepness", [1.0, 2.0, 8.0])
@pytest.mark.parametrize("count", [2, 3, 5])
def test_even_sigmoids_on_a_circle_are_shifts_of_each_other(count: int, steepness: float) -> None:
    angle = Variable("angle", "rad", -pi, pi, True)
    partition = Partition.of(angle, "sigmoid", count, steepness)
    x = np.linspace(-pi, pi, 101)
    shifted = partition.strengths(x + 2 * pi / count)
    assert np.roll(partition.strengths(x), 1, axis=1) == pytest.approx(shifted, abs=1e-10)


def test_two_sigmoids_are_equation_6() -> None:
    # P_LOW = 1 / (1 + c_i exp(-c_j s)) with b = 2 halfway, slope 8 / 4 = 2:
    # c_i = exp(-2 * 2), c_j = -2. The paper's two constants are slope and boundary.
    partition = Partition((0.0, 4.0), "sigmoid", steepness=8.0)
    for s in (-1.0, 0.0, 1.3, 2.0, 4.0):
        low = 1.0 / (1.0 + exp(-4.0) * exp(2.0 * s))
        assert partition.strengths(np.array(s)) == pytest.approx([low, 1.0 - low], abs=1e-15)


def test_three_sigmoids_by_hand() -> None:
    # Centers 0, 2, 4, boundaries 1 and 3, slope 2 ln 3 / 2 = ln 3. At s = 2 both boundaries are
    # one away: S(2 - 1) = 1 / (1 + 1/3) = 3/4, S(2 - 3) = 1 / (1 + 3) = 1/4.
    partition = Partition((0.0, 2.0, 4.0), "sigmoid", steepness=2.0 * np.log(3.0))
    assert partition.strengths(np.array(2.0)) == pytest.approx([0.25, 0.5, 0.25], abs=1e-15)


def test_triangles_by_hand() -> None:
    # On a circle of period 8 with centers 0, 2, 4 the last gap runs from 4 to 8: 5 is a quarter in.
    partition = Partition((0.0, 2.0, 4.0), "triangular", period=8.0)
    x = np.array([0.5, 5.0, -3.0, 13.0, 8.0])
    expected = [[0.75, 0.25, 0], [0.25, 0, 0.75], [0.25, 0, 0.75], [0.25, 0, 0.75], [1, 0, 0]]
    assert partition.strengths(x) == pytest.approx(np.array(expected), abs=1e-15)


def test_strengths_keep_the_shape_of_their_argument() -> None:
    partition = Partition((0.0, 1.0, 2.0), "triangular")
    assert partition.strengths(np.zeros((4, 2))).shape == (4, 2, 3)
    assert partition.strengths(np.array(0.0)).shape == (3,)


@pytest.mark.parametrize(
    ("variable", "count", "centers"),
    [
        (Variable("x", "m", 0.0, 4.0), None, (0.0, 1.0, 2.0, 3.0, 4.0)),
        (Variable("x", "m", 0.0, 4.0), 3, (0.0, 2.0, 4.0)),
        (Variable("x", "m", 0.0, 4.0, centers=(1.0, 3.0)), None, (1.0, 3.0)),
        (Variable("x", "m", 0.0, 4.0, centers=(1.0, 3.0)), 3, (0.0, 2.0, 4.0)),
        (Variable("x", "rad", 0.0, 4.0, True), 4, (0.0, 1.0, 2.0, 3.0)),
    ],
)
def test_centers_of_a_variable(variable: Variable, count: int | None, centers: tuple) -> None:
    partition = Partition.of(variable, "triangular", count)
    assert partition.centers == centers
    assert partition.period == (4.0 if variable.periodic else 0.0)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (((0.0,), "triangular"), "two or more"),
        (((0.0, 0.0), "triangular"), "that increase"),
        (((0.0, 1.0), "triangular", 1.0), "within one period of 1.0"),
        (((0.0, 1.0), "sigmoid", 2.0, 0.1), "steepness = 0.1"),
        (((0.0, 1.0), "gauss"), "membership = 'gauss', allowed: triangular, sigmoid"),
        (((0.0, 1.0), "sigmoid", 0.0, -1.0), "steepness = -1.0, must be above 0"),
        (((0.0, 1.0), "sigmoid", 2.0, 0.0), "steepness = 0.0, must be above 0"),
        (((0.0, 1.0), "sigmoid", 0.0, float("inf")), "steepness = inf, must be above 0 and finite"),
        (((0.0, float("nan")), "triangular"), "finite numbers"),
        (((0.0, 1.0), "triangular", -3.0), "period = -3.0, allowed: 0 or a positive number"),
    ],
)
def test_a_partition_refuses(arguments: tuple, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as caught:
        Partition(*arguments)
    assert "\n" not in str(caught.value)
