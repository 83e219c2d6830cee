import numpy as np
import pandas as pd
import pytest
from scipy import special, stats

from nested_agents.core.interface.measures import RETURN, SUCCESS
from nested_agents.studies.results import permutation_tests
from nested_agents.studies.results.analysis import judged, verdict_lines
from nested_agents.studies.results.differences import Difference, adjust
from nested_agents.studies.results.permutation_tests import (
    LEVEL,
    independent_permutation,
    paired_permutation,
)
from nested_agents.studies.results.power import (
    detectable,
    detectable_independent,
    deviation_of,
    power,
    power_of_t,
    seeds_for,
    seeds_needed,
)
from nested_agents.studies.results.power_text import (
    independent_power_lines,
    power_lines,
    power_text,
)
from nested_agents.studies.results.recovery import RECOVERED, is_over_episodes
from nested_agents.studies.results.statistics import bootstrap


def found_in_simulation(
    effect: float, seeds: int, comparisons: int, studies: int, seed: int = 1
) -> float:
    """The share of simulated studies whose permutation test finds the effect."""
    differences = np.random.default_rng(seed).normal(size=(studies, seeds)) + effect
    nothing = np.zeros(seeds)
    ps = [paired_permutation(d, nothing, permutations=2000) for d in differences]
    return float(np.mean(np.array(ps) * comparisons < LEVEL))


@pytest.mark.parametrize(
    ("effect", "seeds", "comparisons"), [(1.2, 6, 1), (1.2, 8, 2), (0.9, 10, 1), (0.6, 30, 3)]
)
def test_the_power_is_that_of_simulated_studies(
    effect: float, seeds: int, comparisons: int
) -> None:
    share = found_in_simulation(effect, seeds, comparisons, studies=1200)
    assert power(effect, 1.0, seeds, comparisons) == pytest.approx(share, abs=0.045)


def test_simulated_power_is_that_of_the_noncentral_t_distribution_where_both_hold() -> None:
    # 10 seeds: 25 patterns, simulated; a t test of the same level is nearly as powerful.
    shift, level = 0.9 * np.sqrt(10), 25 / 2**9
    beyond = stats.t.isf(level / 2, 9)
    assert power(0.9, 1.0, 10) == pytest.approx(stats.nct.sf(beyond, 9, shift), abs=0.03)


def test_too_few_seeds_have_no_power_at_all() -> None:
    assert power(100.0, 1.0, 5) == 0.0
    assert power(100.0, 1.0, 6) == 1.0
    assert power(100.0, 1.0, 6, comparisons=2) == 0.0
    assert detectable(1.0, 5) == np.inf


@pytest.mark.parametrize("comparisons", [1, 8, 63])
def test_planned_seeds_are_the_fewest_and_find_what_is_detectable(comparisons: int) -> None:
    n = seeds_for(0.2, 0.25, comparisons)
    assert n is not None
    assert power(0.2, 0.25, n, comparisons) >= 0.8 > power(0.2, 0.25, n - 1, comparisons)
    assert detectable(0.25, n, comparisons) <= 0.2
    assert n >= seeds_needed(comparisons)


def test_what_takes_too_many_seeds_is_said_to() -> None:
    assert seeds_for(0.001, 1.0) is None


NAN, INFINITE = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("function", "argument", "value"),
    [
        *((power, "effect", value) for value in (NAN, INFINITE, -INFINITE)),
        *((power, "deviation", value) for value in (0.0, -1.0, NAN, INFINITE)),
        *((power, "seeds", value) for value in (0, -3, 10**9, 5.5, NAN)),
        *((power, "comparisons", value) for value in (0, 10**9, 1.5)),
        *((detectable, "deviation", value) for value in (0.0, NAN, INFINITE)),
        *((detectable, "seeds", value) for value in (0, NAN)),
        *((detectable, "wanted", value) for value in (0.0, 1.0, 2.0, NAN)),
        *((seeds_for, "effect", value) for value in (NAN, INFINITE)),
        *((seeds_for, "deviation", value) for value in (-0.1, NAN)),
        *((seeds_for, "wanted", value) for value in (0.0, 1.0, -1.0, NAN)),
    ],
)
def test_an_argument_out_of_range_is_named(function, argument, value) -> None:
    valid = {"effect": 0.2, "deviation": 0.25, "seeds": 15}
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    given = {name: number for name, number in valid.items() if name in names}
    with pytest.raises(ValueError, match=f"^{argument} = .*, allowed: ") as caught:
        function(**{**given, argument: value})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ratio", [1e12, 1e300])
def test_an_effect_of_many_deviations_is_detected_for_certain(ratio: float) -> None:
    assert power(ratio, 1e-3, 6) == power(ratio, 1e-3, 40) == 1.0
    assert seeds_for(ratio, 1e-3) == 6


def test_the_deviation_is_pooled_and_of_rates_never_zero() -> None:
    rng = np.random.default_rng(0)
    samples = [rng.normal(size=200), 5.0 + rng.normal(size=200)]
    assert deviation_of(samples, of_rates=False) == pytest.approx(1.0, abs=0.06)
    assert deviation_of([[0.5] * 3], of_rates=True) == pytest.approx(1.07 * 0.204, abs=0.001)
    assert deviation_of([[0.5] * 3], of_rates=False) is None


def compared(own: list[float], base: list[float], *titles: str) -> tuple[Difference, ...]:
    pair = np.array(own, dtype=float), np.array(base, dtype=float)
    estimate = bootstrap(pair[0] - pair[1], bounds=(-1, 1))
    return adjust([(title, "success", *pair, estimate) for title in titles or ["other"]])


def test_five_seeds_that_all_agree_are_told_what_they_lack() -> None:
    found = compared([1.0] * 5, [0.0] * 5, "other", "third")
    assert [round(d.raw, 4) for d in found] == [0.0625, 0.0625]
    text = " ".join(" ".join(verdict_lines(found)).split())
    assert "+1.00 [+0.13, +1.00], p = 0.12 (0.062 unadjusted)" in text
    said = " ".join(line.strip() for line in power_lines([d.sample for d in found], 2))
    assert "5 seeds cannot give a p below 0.05 (p adjusted over 2 comparisons)" in said
    assert "At least 7 seeds are needed; a difference of 0.20 needs about" in said


def test_without_deviation_nothing_is_promised() -> None:
    assert "Power: unknown, because all seeds have the same difference" in " ".join(
        power_text(8, 1, None, None)
    )
    assert power_lines([], 0) == []


def test_no_difference_of_rates_beyond_one_is_promised() -> None:
    samples = [np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])]
    assert "detect no difference with power" in power_lines(samples, 1)[0]
    assert "detect a difference of" in power_lines(samples, 1, RETURN)[0]


def test_a_difference_of_rounding_errors_is_none() -> None:
    assert compared([0.3, 0.1 + 0.2], [0.1 + 0.2, 0.3])[0].shown.startswith("0 [0, 0]")


def test_interval_and_test_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    for n in (5, 7, 12):
        one, other = rng.normal(size=n) + 0.7, rng.normal(size=n)
        theirs = stats.permutation_test(
            (one, other), lambda a, b: (a - b).mean(), permutation_type="samples",
            n_resamples=np.inf,
        )  # fmt: skip
        assert paired_permutation(one, other) == pytest.approx(theirs.pvalue)
        if n < 8:
            ours = bootstrap(one - other)
            low, high = stats.ttest_rel(one, other).confidence_interval(0.95)
            assert (ours.low, ours.high) == (pytest.approx(low), pytest.approx(high))


def test_the_test_is_that_of_an_independent_implementation() -> None:
    """Sign flips counted one by one, in whole numbers: nothing is shared with ours."""
    from itertools import product

    rng = np.random.default_rng(4)
    for n in (4, 6, 9):
        whole = [int(v) for v in rng.integers(-5, 9, n)]
        reached = sum(
            abs(sum(s * v for s, v in zip(signs, whole, strict=True))) >= abs(sum(whole))
            for signs in product((1, -1), repeat=n)
        )
        assert paired_permutation(whole, [0] * n) == reached / 2**n


@pytest.mark.parametrize("freedom", [5, 9, 19, 200, 5000])
@pytest.mark.parametrize("shift", [0.0, 0.5, 2.0])
def test_power_is_that_of_scipys_noncentral_t(freedom: int, shift: float) -> None:
    beyond = special.stdtrit(freedom, 0.975)
    below, above = special.nctdtr(freedom, shift, [-beyond, beyond])
    assert power_of_t(freedom, shift, beyond) == pytest.approx(below + 1.0 - above, abs=1e-9)


def test_power_far_out_where_scipy_has_no_number_is_that_of_simulated_studies() -> None:
    # With these numbers scipy.special.nctdtr is nan, which was once taken for a power of 1.
    freedom, shift, beyond = 29, 5.0, float(special.stdtrit(29, 1 - 0.05 / 1000))
    rng = np.random.default_rng(0)
    t = (rng.normal(size=200_000) + shift) / np.sqrt(rng.chisquare(freedom, 200_000) / freedom)
    share = (abs(t) > beyond).mean()
    assert power_of_t(freedom, shift, beyond) == pytest.approx(share, abs=0.005)
    assert 0.6 < share < 0.75


def test_differences_that_are_equal_except_for_rounding_have_no_power() -> None:
    base = np.linspace(-3.0, 4.0, 8)
    lines = power_lines([(base + 0.5) - base], 1, RETURN, "score")
    assert " ".join(lines).startswith("Power: unknown in score, because all seeds have the same")


def test_an_outcome_of_a_seed_has_not_the_usual_deviation_of_shares_of_episodes() -> None:
    assert is_over_episodes(SUCCESS)
    assert not is_over_episodes(RECOVERED)  # one 0 or 1 for each seed


@pytest.mark.parametrize(("counts", "comparisons"), [((8, 8), 1), ((20, 12), 1), ((15, 15), 3)])
def test_what_independent_runs_detect_is_found_as_often_as_promised(
    monkeypatch, counts, comparisons
) -> None:
    monkeypatch.setattr(permutation_tests, "EXACT", 1999)  # as many as a level of 0.05 / 3 needs
    effect = detectable_independent(1.0, counts, comparisons)
    rng = np.random.default_rng(0)
    found = [
        independent_permutation(rng.normal(effect, size=counts[0]), rng.normal(size=counts[1]))
        for _ in range(400)
    ]
    share = np.mean(np.array(found) * comparisons < LEVEL)
    assert share == pytest.approx(0.8, abs=0.06)


@pytest.mark.parametrize("counts", [(2, 5), (2, 6), (3, 4), (3, 3)])
def test_runs_that_no_permutation_of_labels_can_tell_apart_detect_nothing(counts) -> None:
    first, second = np.arange(float(counts[0])), 100.0 + np.arange(float(counts[1]))
    assert independent_permutation(first, second) >= LEVEL  # the clearest difference there is
    assert detectable_independent(1.0, counts) == np.inf


def test_the_power_of_independent_runs_is_printed() -> None:
    rng = np.random.default_rng(1)
    groups = [(rng.normal(size=8), rng.normal(size=9))]
    text = " ".join(independent_power_lines(groups, 1, RETURN, "score"))
    assert text.startswith("Power: 8 and 9 independent runs detect a difference of")
    few = " ".join(independent_power_lines([(np.arange(3.0), np.arange(3.0))], 1, RETURN))
    assert few == "Power: 3 and 3 independent runs cannot give a p below 0.05."
    equal = " ".join(independent_power_lines([(np.ones(8), np.zeros(8))], 1, RETURN))
    assert "unknown, because the runs of each condition are all equal" in equal


def test_no_difference_beyond_the_range_is_promised_to_independent_runs() -> None:
    pairs = [(np.array([0.0, 1.0, 0.0, 1.0]), np.array([1.0, 0.0, 1.0, 0.0, 1.0]))]
    assert "detect no difference" in independent_power_lines(pairs, 1, SUCCESS)[0]
    assert "detect a difference of" in independent_power_lines(pairs, 1, RETURN)[0]


def test_power_adjusts_over_paired_and_independent_comparisons_together() -> None:
    rng = np.random.default_rng(5)
    scores = {name: pd.Series(rng.normal(size=8), list("abcdefgh")) for name in ("x", "y", "z")}
    scores["z"].index = list("ABCDEFGH")
    pairs = [(name, "score", scores[name], scores["x"]) for name in ("y", "z")]
    _, lines = judged({"score": pairs}, "x", RETURN)
    text = " ".join(" ".join(lines).split())
    assert text.count("(p adjusted over 2 comparisons)") == 2
