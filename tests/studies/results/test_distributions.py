"""The normal and Student's distributions against SciPy's, and against simulation."""

import numpy as np
import pytest
from scipy import special

from nested_agents.studies.results.distributions import (
    normal_cdf,
    normal_quantile,
    power_of_t,
    t_quantile,
)

FREEDOM = np.array([1.0, 1.3, 2.0, 4.0, 7.5, 29.0, 299.0, 301.0, 5000.0, 1e9, 1e300])
NONCENTRAL = [
    (freedom, shift, level)
    for freedom in (5, 9, 19, 200, 5000)
    for shift in (0.0, 0.5, 2.0, 4.0)
    for level in (0.05, 0.05 / 22)
]


@pytest.mark.parametrize("p", [0.6, 0.9, 0.975, 0.99])
def test_quantiles_of_t_are_scipys(p: float) -> None:
    np.testing.assert_allclose(t_quantile(FREEDOM, p), special.stdtrit(FREEDOM, p), rtol=2e-13)


def test_far_quantiles_of_t_are_scipys() -> None:
    for p in (0.9995, 0.99999):
        np.testing.assert_allclose(t_quantile(FREEDOM, p), special.stdtrit(FREEDOM, p), rtol=1e-7)


def test_the_median_of_t_is_zero_and_any_shape_does() -> None:
    assert t_quantile(FREEDOM.reshape(1, -1), 0.5).tolist() == [[0.0] * len(FREEDOM)]
    assert t_quantile([], 0.9).shape == (0,)


@pytest.mark.parametrize("p", [0.001, 0.5, 0.9, 0.975, 0.9999])
def test_normal_quantiles_are_scipys_and_undone_by_their_probability(p: float) -> None:
    assert normal_quantile(p) == pytest.approx(special.ndtri(p), rel=1e-14, abs=1e-15)
    assert normal_cdf(normal_quantile(p)) == pytest.approx(p, rel=1e-13)


@pytest.mark.parametrize(("freedom", "shift", "level"), NONCENTRAL)
def test_power_is_that_of_scipys_noncentral_t(freedom: int, shift: float, level: float) -> None:
    beyond = -special.stdtrit(freedom, level / 2)
    below, above = special.nctdtr(freedom, shift, [-beyond, beyond])
    expected = below + 1.0 - above
    assert power_of_t(freedom, shift, beyond) == pytest.approx(expected, abs=1e-9)


def test_power_far_out_where_scipy_has_no_number_is_that_of_simulated_studies() -> None:
    # With these numbers scipy.special.nctdtr is nan, which was once taken for a power of 1.
    freedom, shift, beyond = 29, 5.0, float(t_quantile(29, 1 - 0.05 / 1000))
    rng = np.random.default_rng(0)
    t = (rng.normal(size=200_000) + shift) / np.sqrt(rng.chisquare(freedom, 200_000) / freedom)
    found = (abs(t) > beyond).mean()
    assert power_of_t(freedom, shift, beyond) == pytest.approx(found, abs=0.005)
    assert 0.6 < found < 0.75
