"""The greatest of some values, angles, and nodes of quadrature."""

from math import pi

import numpy as np
import pytest

from nested_agents.core.numerics import greatest, quadrature, wrap, wrap_one


def test_ties_are_broken_at_random_and_only_ties_draw_a_number() -> None:
    rng, untouched = np.random.default_rng(0), np.random.default_rng(0)
    assert greatest(np.array([1.0, 3.0, 2.0]), rng) == 1
    assert rng.random() == untouched.random()
    found = [greatest(np.array([5.0, 1.0, 5.0]), rng) for _ in range(400)]
    assert np.bincount(found) == pytest.approx([200, 0, 200], abs=50)


@pytest.mark.parametrize(
    ("values", "is_tied"),
    [
        ([0.0, 1.0e-12], True),  # absolute below 1
        ([0.0, 1.1e-12], False),
        ([1000.0, 1000.0 - 0.9e-9], True),  # relative above 1
        ([1000.0, 1000.0 - 1.1e-9], False),
        ([-1000.0, -1000.0 - 0.9e-9], True),
    ],
)
def test_values_tie_within_the_tolerance(values: list[float], is_tied: bool) -> None:
    rng = np.random.default_rng(0)
    found = {greatest(np.array(values), rng) for _ in range(50)}
    assert found == ({0, 1} if is_tied else {int(np.argmax(values))})


@pytest.mark.parametrize("values", [[np.nan, 1.0], [np.inf, 1.0]])
def test_values_without_a_maximum_are_refused(values: list[float]) -> None:
    with pytest.raises(ArithmeticError, match="2 action values"):
        greatest(np.array(values), np.random.default_rng(0))


def test_angles_wrap() -> None:
    np.testing.assert_allclose(wrap(np.array([0.0, 3 * pi, -1.5 * pi])), [0.0, -pi, 0.5 * pi])


def test_wrap_is_the_remainder_to_the_last_bit() -> None:
    angles = np.random.default_rng(0).uniform(-300, 300, 100_000)
    np.testing.assert_array_equal(wrap(angles), (angles + pi) % (2 * pi) - pi)
    np.testing.assert_array_equal([wrap_one(angle) for angle in angles], wrap(angles))


def test_quadrature_is_exact_for_polynomials() -> None:
    nodes, weights = quadrature(3)
    moments = [(weights * nodes**k).sum() for k in range(6)]
    np.testing.assert_allclose(moments, [2, 0, 2 / 3, 0, 2 / 5, 0], atol=1e-14)
