"""Speed-up, serial fraction and the universal scalability law: hand-worked and simulated."""

import numpy as np
import pytest

from nested_agents.core.numerics import pd
from nested_agents.studies.laws.universal import (
    fit_universal_law,
    serial_fraction,
    speedups,
)
from nested_agents.studies.results.statistics import Estimate


def times_by_size(sizes, values):
    return pd.DataFrame(values, columns=sizes)


SIZES = np.array([1.0, 2.0, 4.0, 8.0, 16.0])


def noisy(times, n_seeds, rng, spread):
    """Return times ``(n_seeds, n_sizes)`` with a factor for each seed and each run."""
    own = rng.gamma(spread**-2, spread**2, (n_seeds, len(times)))
    return times * own * rng.gamma(4.0 * spread**-2, spread**2 / 4.0, (n_seeds, 1))


def times_of(contention, coherency):
    return 100.0 * (1.0 + contention * (SIZES - 1.0) + coherency * SIZES * (SIZES - 1.0)) / SIZES


def test_amdahls_serial_fraction_is_recovered():
    serial = 0.2
    strong = times_by_size(SIZES, np.array([serial + (1.0 - serial) / SIZES] * 3))
    for size, own in speedups(strong, "strong").items():
        assert own["speed-up"].value == pytest.approx(1.0 / (serial + (1.0 - serial) / size))
        if size > 1.0:
            assert own["serial fraction"].value == pytest.approx(serial)


def test_gustafsons_serial_fraction_is_recovered():
    serial = 0.3
    scaled = serial + (1.0 - serial) * SIZES  # speed-up
    weak = times_by_size(SIZES, np.array([SIZES / scaled] * 3))
    for size, own in speedups(weak, "weak").items():
        assert own["efficiency"].value == pytest.approx((serial + (1.0 - serial) * size) / size)
        if size > 1.0:
            assert own["serial fraction"].value == pytest.approx(serial)


def test_sizes_count_relative_to_the_smallest():
    values = np.array([[8.0, 4.0, 2.0]] * 2)
    own = speedups(times_by_size(np.array([2.0, 4.0, 8.0]), values), "strong")
    assert own[8.0]["speed-up"].value == pytest.approx(4.0)
    assert own[8.0]["efficiency"].value == pytest.approx(1.0)


@pytest.mark.parametrize("scaling", ["strong", "weak"])
def test_ends_of_a_serial_fraction_are_in_order(scaling):
    value, low, high = serial_fraction(Estimate(*map(np.asarray, (1.6, 1.2, 2.4))), 2.0, scaling)
    assert low < value < high


@pytest.mark.parametrize("scaling", ["strong", "weak"])
def test_the_parameters_of_an_exact_law_are_found(scaling):
    times = times_of(0.05, 0.01) * (SIZES if scaling == "weak" else 1.0)
    law = fit_universal_law(times_by_size(2.0 * SIZES, np.array([times] * 3)), scaling)
    assert law.contention.value == pytest.approx(0.05)
    assert law.coherency.value == pytest.approx(0.01)
    assert law.best_size.value == pytest.approx(2.0 * np.sqrt(0.95 / 0.01))
    assert law.time_at_smallest == pytest.approx(100.0)
    assert law.throughput(SIZES) == pytest.approx(times_of(0.0, 0.0)[0] / times_of(0.05, 0.01))


def test_constant_times_have_no_best_size_instead_of_one_made_of_rounding():
    law = fit_universal_law(times_by_size(SIZES, np.full((5, 5), 449.9)), "weak")
    assert law.coherency.value == pytest.approx(0.0, abs=1e-9)
    assert law.best_size.value == np.inf
    assert law.best_size_within(SIZES[-1]) is None


def test_a_best_size_counts_only_within_the_sizes_measured():
    law = fit_universal_law(times_by_size(SIZES, np.array([times_of(0.05, 0.01)] * 3)), "strong")
    assert law.best_size_within(SIZES[-1]) == (law.best_size if SIZES[-1] >= 9.8 else None)
    assert law.best_size_within(9.0) is None


def test_two_sizes_have_no_law():
    with pytest.raises(ValueError, match="2 sizes"):
        fit_universal_law(times_by_size(SIZES[:2], np.ones((3, 2))), "strong")


def test_superlinear_times_are_not_described_by_the_law():
    values = noisy(100.0 / SIZES**1.5, 12, np.random.default_rng(0), 0.05)
    assert not fit_universal_law(times_by_size(SIZES, values), "strong").is_plausible


@pytest.mark.parametrize(
    ("contention", "coherency", "spread", "n_seeds"),
    [(0.05, 0.01, 0.2, 12), (0.2, 0.002, 0.3, 12), (0.05, 0.01, 0.2, 5), (0.1, 0.004, 0.4, 20)],
)
def test_intervals_of_simulated_laws_cover_the_truth_at_their_level(
    contention, coherency, spread, n_seeds
):
    rng = np.random.default_rng(1)
    truth = (contention, coherency, np.sqrt((1.0 - contention) / coherency))
    covered = []
    for _ in range(600):
        values = noisy(times_of(contention, coherency), n_seeds, rng, spread)
        law = fit_universal_law(times_by_size(SIZES, values), "strong")
        covered.append(
            [own.low <= true <= own.high for own, true in zip(law[:3], truth, strict=True)]
        )
    shares = np.mean(covered, axis=0)
    assert (shares >= 0.92).all()
    assert (shares <= 0.98).all()
