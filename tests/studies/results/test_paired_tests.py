"""Permutation tests against exact enumeration, scipy and known distributions."""

from fractions import Fraction
from itertools import permutations, product

import numpy as np
import pytest
from scipy import stats

from nested_agents.studies.results.paired_tests import friedman, holm, paired_permutation


def test_friedman_is_scipys_statistic_with_ties_and_without() -> None:
    rng = np.random.default_rng(0)
    for values in (rng.normal(size=(9, 4)), rng.integers(3, size=(12, 5)).astype(float)):
        found = friedman(values, permutations=99)
        assert found.statistic == pytest.approx(stats.friedmanchisquare(*values.T).statistic)
        n, k = values.shape
        assert found.concordance == pytest.approx(found.statistic / (n * (k - 1)))


def test_friedman_p_is_that_of_all_permutations() -> None:
    values = np.array([[1.0, 2.0, 3.0], [1.0, 3.0, 2.0], [2.0, 1.0, 3.0]])
    sums = [
        (np.sum(rows, axis=0) ** 2).sum() for rows in product(permutations((-1, 0, 1)), repeat=3)
    ]
    observed = ((values - 2).sum(axis=0) ** 2).sum()
    exact = np.mean(np.array(sums) >= observed)
    assert friedman(values, permutations=20000).p == pytest.approx(exact, abs=0.02)


def test_friedman_of_equal_conditions_says_nothing() -> None:
    assert friedman(np.ones((5, 3))) == friedman(np.zeros((5, 3)))
    assert friedman(np.ones((5, 3))).p == 1.0
    with pytest.raises(ValueError, match="1 seeds x 3 conditions"):
        friedman(np.ones((1, 3)))


def test_false_alarms_are_as_rare_as_promised() -> None:
    rng = np.random.default_rng(1)
    alarms = np.mean([friedman(rng.normal(size=(6, 3)), 199, seed=s).p <= 0.05 for s in range(400)])
    assert 0.02 < alarms < 0.08


def test_sign_flips_by_hand() -> None:
    # Differences 1, 2, 3: only +++ and --- reach a sum of 6.
    assert paired_permutation([1, 2, 3], [0, 0, 0]) == 2 / 8
    assert paired_permutation([1, 2], [1, 2]) == 1.0


@pytest.mark.parametrize("scale", [1e-9, 0.1, 1.0, 1e4, 1e12])
def test_ties_are_ties_whatever_the_size_of_the_values(scale: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(160):
        whole = rng.integers(0, 6, size=(2, int(rng.integers(1, 9))))
        difference = [int(a) - int(b) for a, b in whole.T]
        sums = [sum(s * d for s, d in zip(signs, difference, strict=True))
                for signs in product((-1, 1), repeat=len(difference))]  # fmt: skip
        exact = np.mean([abs(found) >= abs(sum(difference)) for found in sums])
        assert paired_permutation(whole[0] * scale, whole[1] * scale) == exact
        assert (
            paired_permutation(whole[0] / 7 * scale + 3 * scale, (whole[1] / 7 + 3) * scale)
            == exact
        )


@pytest.mark.parametrize("size", [2.0**47, 1e14, 2.0**51])
@pytest.mark.parametrize("large", [1, 8])
def test_large_values_hide_no_differences(size: float, large: int) -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        n = int(rng.integers(2, 9))
        values = rng.integers(0, 9, size=(2, n)) + np.where(np.arange(n) < large, size, 0.0)
        difference = [Fraction(a) - Fraction(b) for a, b in values.T]
        sums = [sum(s * d for s, d in zip(signs, difference, strict=True))
                for signs in product((-1, 1), repeat=n)]  # fmt: skip
        exact = np.mean([abs(found) >= abs(sum(difference)) for found in sums])
        assert paired_permutation(*values) == exact


def test_what_is_no_pairs_is_refused() -> None:
    for one, other in (([1.0, 2.0, 3.0], [1.0]), ([], []), ([[1.0]], [[1.0]])):
        with pytest.raises(ValueError, match="as many on both sides"):
            paired_permutation(one, other)
    with pytest.raises(ValueError, match="finite"):
        paired_permutation([1.0, np.nan], [0.0, 0.0])


def test_drawn_sign_flips_are_near_all_of_them() -> None:
    rng = np.random.default_rng(2)
    difference = rng.normal(0.4, 1.0, size=14)
    exact = paired_permutation(difference, np.zeros(14))
    drawn = paired_permutation(difference, np.zeros(14), permutations=10000)
    assert drawn == pytest.approx(exact, abs=0.02)


def test_holm_by_hand() -> None:
    np.testing.assert_allclose(holm([0.01, 0.02, 0.03, 0.005]), [0.03, 0.04, 0.04, 0.02])
    assert holm([0.6, 0.7]).tolist() == [1.0, 1.0]
