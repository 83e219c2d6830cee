"""Laws of growth: against curves that are known, and their promises by simulation."""

import numpy as np
import pytest
from scipy import special

from nested_agents.studies.laws import curves, drift, fitting, samples

SIZES = np.array([2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
LAWS = {
    "power law": lambda n: 5.0 * n**0.6,
    "power law with a floor": lambda n: 20.0 + 0.05 * n**2,
}


def drawn(of, sizes=SIZES, seeds=10, noise=0.1, seed=0):
    """Return numbers ``(seeds, sizes)`` that deviate from a law by a factor."""
    rng = np.random.default_rng(seed)
    return of(sizes) * np.exp(rng.normal(0.0, noise, size=(seeds, len(sizes))))


def test_a_power_law_without_noise_is_met_exactly() -> None:
    law = fitting.choose(samples.of_numbers(SIZES, np.tile(LAWS["power law"](SIZES), (3, 1))))
    assert law.curve.name == "power law"
    exponent = law.exponents()["exponent"]
    assert [float(end) for end in exponent] == pytest.approx([0.6] * 3)
    assert float(law.predict(128.0).value) == pytest.approx(5.0 * 128.0**0.6)


@pytest.mark.parametrize("name", LAWS)
def test_the_law_that_holds_is_chosen_and_predicts(name) -> None:
    sample = samples.of_numbers(SIZES, drawn(LAWS[name]))
    law = fitting.choose(sample)
    assert law.curve.name == name
    e = law.predict(128.0)
    assert e.low < LAWS[name](np.array(128.0)) < e.high
    assert [size for size, *_ in law.held_out] == [32.0, 64.0]


def test_pairs_of_agents_are_linear_to_quadratic() -> None:
    """As messages of a chain are, n (n - 1) / 2, which no power law predicts."""
    sample = samples.of_numbers(SIZES, np.tile(SIZES * (SIZES - 1.0) / 2.0, (3, 1)))
    law = fitting.choose(sample)
    assert law.curve.name == "linear to quadratic"
    assert float(law.predict(128.0).value) == pytest.approx(128 * 127 / 2, rel=1e-4)


def test_sizes_that_deviate_from_a_law_widen_what_it_predicts_far_away() -> None:
    deviations = np.exp([0.2, -0.2, -0.2, 0.2, 0.2, -0.2])
    laws_of = [
        fitting.fit(curves.POWER, samples.of_numbers(SIZES, np.tile(SIZES * own, (3, 1))))
        for own in (np.ones(6), deviations)
    ]
    widths = [[float(np.ptp(np.log(law.predict(n)))) for n in (128.0, 1024.0)] for law in laws_of]
    assert widths[0][1] < 1e-3 < 0.1 < widths[1][0] < widths[1][1] / 4.0


@pytest.mark.slow
def test_intervals_cover_laws_whose_exponent_wanders() -> None:
    """Each by another sigma, drawn of what `drift` takes it to be before anything is measured."""
    rng = np.random.default_rng(3)
    sizes = np.array([2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 64.0])
    steps = np.diff(np.log(sizes))
    inside = 0
    times = 300
    for _ in range(times):
        sigma = drift.WANDER * abs(np.tan(np.pi * (rng.uniform() - 0.5)))
        y = [0.0]
        slope = 0.4
        for h in steps:  # exactly the integral of a random walk over a step
            a, b = rng.normal(size=2)
            y.append(y[-1] + slope * h + sigma * h**1.5 * (a / 2.0 + b / 12.0**0.5))
            slope += sigma * a * h**0.5
        values = np.exp(np.array(y) + rng.normal(0.0, 0.1, size=(6, 8)))
        law = fitting.fit(curves.POWER, samples.of_numbers(sizes[:7], values[:, :7]), 100)
        p = law.predict(64.0)
        inside += bool(p.low <= np.exp(np.log(values[:, 7]).mean()) <= p.high)
    assert 0.86 <= inside / times <= 0.94, inside / times


@pytest.mark.parametrize(
    "curve", [*samples.LOG.curves, curves.LOGISTIC], ids=lambda curve: curve.name
)
def test_slopes_are_derivatives(curve) -> None:
    x, p = np.log(SIZES), np.array([0.4, 0.7, -0.3, 2.0])[: curve.n_parameters]
    steps = 1e-6 * np.eye(len(p))
    each = [(curve.of(p + step, x) - curve.of(p - step, x)) / 2e-6 for step in steps]
    np.testing.assert_allclose(curve.slopes(p, x), np.transpose(each), rtol=0, atol=1e-8)


def test_a_break_is_met_by_a_fit() -> None:
    def broken(n):
        return np.where(n < 8.0, n**0.2, 8.0**0.2 * (n / 8.0) ** 1.5)

    values = np.tile(broken(SIZES), (3, 1)) * np.array([[0.9], [1.0], [1.1]])
    fitted = fitting.fit(curves.BREAK, samples.of_numbers(SIZES, values)).exponents()
    assert float(fitted["exponent below"].value) == pytest.approx(0.2, abs=1e-3)
    assert float(fitted["exponent above"].value) == pytest.approx(1.5, abs=1e-3)
    assert float(fitted["break"].value) == pytest.approx(8.0, rel=1e-2)


@pytest.mark.slow
def test_predicted_intervals_of_rates_cover_new_rates_near_one() -> None:
    rng = np.random.default_rng(5)
    sizes = np.array([1.0, 2.0, 4.0, 8.0, 32.0])
    chances = special.expit(1.5 + 0.4 * np.log(sizes))
    inside = 0
    times = 200
    for _ in range(times):
        rates = rng.binomial(10, chances, size=(12, 5)) / 10
        law = fitting.fit(curves.LOGISTIC, samples.of_rates(sizes[:4], rates[:, :4], 10), 100)
        e = law.predict(32.0)
        inside += bool(e.low <= rates[:, 4].mean() <= e.high)
    assert inside / times >= 0.85, inside / times


@pytest.mark.slow
def test_intervals_of_exponents_and_predictions_cover_what_they_promise() -> None:
    rng = np.random.default_rng(1)
    covered = np.zeros(2)
    times = 300
    for _ in range(times):
        of_seeds = rng.normal(0.0, 0.15, size=(9, 1))
        noise = rng.normal(0.0, 0.3, size=(9, 5)) + of_seeds
        sizes = np.array([2.0, 4.0, 8.0, 16.0, 64.0])
        values = 5.0 * sizes**0.4 * np.exp(noise)
        law = fitting.fit(curves.POWER, samples.of_numbers(sizes[:4], values[:, :4]), 100)
        e = law.exponents()["exponent"]
        p = law.predict(64.0)
        new = 5.0 * 64.0**0.4 * np.exp(rng.normal(0.0, np.hypot(0.15, 0.3), size=9).mean())
        covered += [e.low <= 0.4 <= e.high, p.low <= new <= p.high]
    assert 0.91 <= covered[0] / times <= 0.99, "95%"
    assert covered[1] / times >= 0.85, "90%, of more laws than one that does not wander"


def test_rates_follow_a_logistic_curve() -> None:
    rng = np.random.default_rng(0)
    rates = 1.0 / (1.0 + np.exp(-(3.0 - 0.9 * np.log(SIZES))))
    law = fitting.choose(samples.of_rates(SIZES, rng.binomial(50, rates, size=(12, 6)) / 50, 50))
    assert law.curve.name == "logistic in log n"
    e = law.exponents()["exponent"]
    assert e.low <= -0.9 <= e.high
    low, high = (float(end) for end in law.predict(256.0)[1:])
    assert 0.0 < low < high < 1.0


def test_runs_that_all_ended_alike_still_have_an_interval_of_predictions() -> None:
    law = fitting.choose(samples.of_rates(SIZES, np.full((8, 6), 1.0), 10))
    e = law.predict(128.0)
    assert float(e.low) <= float(e.value) <= float(e.high)


def test_what_was_not_reached_is_known_to_be_larger() -> None:
    """Taken for reached, it would flatten the law."""
    values = drawn(lambda n: 50.0 * n**0.5, SIZES[:4], noise=0.4)
    limit = 120.0
    cut = np.minimum(values, limit)
    censored = fitting.choose(samples.of_times(SIZES[:4], cut, values > limit)).exponents()[
        "exponent"
    ]
    taken = fitting.fit(curves.POWER, samples.of_numbers(SIZES[:4], cut)).exponents()["exponent"]
    assert float(taken.value) < float(censored.value) - 0.1
    assert censored.low <= 0.5 <= censored.high


def test_exponents_are_compared_seed_by_seed() -> None:
    common = np.random.default_rng(0).normal(size=(8, 1)) * np.log(SIZES)
    one = fitting.fit(curves.POWER, samples.of_numbers(SIZES, np.exp(common + 0.5 * np.log(SIZES))))
    other = fitting.fit(
        curves.POWER, samples.of_numbers(SIZES, np.exp(common + 0.2 * np.log(SIZES)))
    )
    difference, p = fitting.compare(one, other)
    assert difference.mean() == pytest.approx(0.3)
    assert p == pytest.approx(2 / 2**8)  # the least of eight seeds
    assert fitting.compare(one, one)[1] == 1.0


@pytest.mark.parametrize(
    ("count", "sizes"),
    [
        (lambda n: n - 1, [2, 3, 4, 6]),
        (lambda n: n * (n - 1) / 2, [2, 4, 8]),
        (lambda n: 4 * n, [2, 4, 8]),
        (lambda n: 2 * n + 6, [2, 3, 5]),
    ],
)
def test_counts_of_a_hierarchy_have_the_law_that_passes_through_them(count, sizes) -> None:
    """As messages of a star, n - 1, of which every power law is wrong elsewhere."""
    sizes = np.array(sizes, dtype=float)
    law = fitting.choose(samples.of_numbers(sizes, np.tile(count(sizes), (5, 1))))
    predicted = law.predict(64)
    assert float(predicted.value) == pytest.approx(count(64), rel=1e-4)
    assert float(predicted.low) == pytest.approx(count(64), rel=0.1)
    assert float(predicted.high) == pytest.approx(count(64), rel=0.1)


@pytest.mark.parametrize(
    ("sizes", "seeds", "said"),
    [(2, 5, "2 sizes and 5 seeds: a law takes 3"), (4, 1, "4 sizes and 1 seed: a law takes 3")],
)
def test_too_little_is_no_law(sizes, seeds, said) -> None:
    with pytest.raises(ValueError, match=said):
        fitting.choose(samples.of_numbers(SIZES[:sizes], np.ones((seeds, sizes))))


def test_nothing_but_censored_runs_is_no_law() -> None:
    with pytest.raises(ValueError, match="all are censored"):
        samples.of_times(SIZES, np.ones((3, 6)), np.ones((3, 6), dtype=bool))
    with pytest.raises(ValueError, match="size 2 is 0, allowed: positive means"):
        samples.of_numbers(SIZES, np.zeros((3, 6)))
    with pytest.raises(ValueError, match="not finite"):
        samples.of_numbers(SIZES, np.full((3, 6), np.inf))


@pytest.mark.parametrize("size", [0.0, 0.5, -2.0, np.nan, np.inf])
def test_a_size_below_one_is_refused(size: float) -> None:
    sizes = np.array([size, 2.0, 4.0])
    with pytest.raises(ValueError, match=f"size = {size:g}, allowed: finite sizes of 1 or more"):
        samples.of_numbers(sizes, np.ones((3, 3)))
    with pytest.raises(ValueError, match=f"size = {size:g}, allowed"):
        samples.of_rates(sizes, np.ones((3, 3)), 10)
    law = fitting.fit(curves.POWER, samples.of_numbers(SIZES, drawn(LAWS["power law"])))
    with pytest.raises(ValueError, match=f"size = {size:g}, allowed"):
        law.predict(size)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("curve", [*samples.LOG.curves], ids=lambda curve: curve.name)
def test_every_law_holds_from_one_agent_on(curve) -> None:
    """3 n^1.5 with 10% noise, over one to sixteen agents."""
    sizes = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    values = drawn(lambda n: 3.0 * n**1.5, sizes, seeds=8)
    law = fitting.fit(curve, samples.of_numbers(sizes, values), 20)
    assert np.isfinite(law.parameters).all()
    assert float(law.predict(1.0).value) == pytest.approx(3.0, rel=0.3)
    assert float(law.predict(32.0).value) == pytest.approx(3.0 * 32**1.5, rel=0.5)
    assert fitting.choose(samples.of_numbers(sizes, values)).curve.name == "power law"


def test_the_mean_of_linearized_values_is_the_mean_of_the_table() -> None:
    """Numbers 1, 2, 6: mean 3, and relative deviations -2/3, -1/3, 1."""
    sample = samples.of_numbers(np.array([2.0]), np.array([[1.0], [2.0], [6.0]]))
    expected = np.log(3.0) + np.array([-2.0, -1.0, 3.0]) / 3.0
    np.testing.assert_allclose(sample.values[:, 0], expected)
    assert sample.means.tolist() == [3.0]
    rates = samples.of_rates(np.array([2.0]), np.array([[0.75], [1.0]]), 4)  # 7 of 8 episodes
    logit = np.log(7.5 / 1.5)  # of 7.5 / 9
    slope = 1.0 / (7.5 / 9.0 * 1.5 / 9.0)
    np.testing.assert_allclose(rates.values[:, 0], logit + slope * np.array([-0.125, 0.125]))
    assert rates.means.tolist() == [0.875]


def test_a_predicted_rate_lies_within_its_range_and_may_be_one() -> None:
    rng = np.random.default_rng(0)
    chances = 1.0 / (1.0 + np.exp(-(3.0 + 0.5 * np.log(SIZES))))
    rates = rng.binomial(10, chances, size=(12, 6)) / 10
    law = fitting.choose(samples.of_rates(SIZES, rates, 10))
    for size in (1.0, 64.0, 128.0, 1e6):
        e = law.predict(size)
        assert 0.0 <= e.low <= e.value <= e.high <= 1.0
    assert law.predict(128.0).high == 1.0  # 120 episodes all succeed one time in three
    assert [measured for _, measured, _ in law.held_out] == pytest.approx(rates.mean(axis=0)[-2:])


def test_the_noise_of_rates_is_at_least_binomial() -> None:
    """Of rates of ten episodes the variance is p (1 - p) / 10 at least: 4 / 10 on the scale."""
    rates = np.tile([0.9, 0.8, 0.7, 0.6], (6, 1))
    law = fitting.fit(curves.LOGISTIC, samples.of_rates(SIZES[:4], rates, 10))
    assert law.noise == law.scatter == 0.4


FORMULAS = {
    "power law": (curves.POWER, [np.log(5.0), 0.6], "5 n^0.6"),
    "constant": (curves.POWER, [np.log(5.0), -1.6e-16], "5 n^0"),
    "pairs": (curves.QUADRATIC, [np.log(0.5), -40.0], "0.5 n (n - 1)"),
    "linear": (curves.QUADRATIC, [np.log(0.5), np.log(3.0)], "0.5 n (n + 2)"),
    "floor": (curves.FLOOR, [np.log(2.0), 1.5, np.log(7.0)], "7 + 2 n^1.5"),
    "break": (
        curves.BREAK,
        [np.log(2.0), 1.0, 1.0, np.log(4.0)],
        "2 n^1 up to n = 4, then 0.5 n^2",
    ),
}


@pytest.mark.parametrize("name", FORMULAS)
def test_the_printed_law_is_the_curve(name) -> None:
    curve, parameters, text = FORMULAS[name]
    assert curve.formula(np.array(parameters)) == text
    own = text.split(", then ")[-1].replace("n (", "n * (").replace(" n", " * n").replace("^", "**")
    own = own.replace("+ *", "+").replace("- *", "-")
    at_eight = np.exp(curve.of(np.array(parameters), np.log([8.0])))
    assert eval(own, {"n": 8.0}) == pytest.approx(at_eight[0], rel=1e-3)


def test_a_prediction_is_the_law_itself() -> None:
    deviations = np.exp([0.3, -0.2, -0.3, 0.1, 0.2, 0.4])
    values = drawn(lambda n: 5.0 * n**0.6 * deviations)
    for curve in samples.LOG.curves:
        law = fitting.fit(curve, samples.of_numbers(SIZES, values), 20)
        e = law.predict(128.0)
        assert e.value == law.curve_at(np.array([128.0]))[0]
        assert e.low < e.value < e.high


def test_predictions_stay_within_the_bounds_of_a_measure() -> None:
    sample = samples.of_numbers(SIZES, drawn(lambda n: 0.3 * n**0.25), (0.0, 1.0))
    assert [float(end) for end in fitting.choose(sample).predict(1e4)][::2] == [1.0, 1.0]


def test_rates_of_no_and_of_every_episode_are_rates() -> None:
    rates = samples.of_rates(np.array([2.0]), np.array([[0.0], [1.0]]), 4)
    np.testing.assert_allclose(rates.values[:, 0], [-2.0, 2.0])  # slope of the logit at 1/2: 4
    for wrong in (-0.1, 1.1):
        with pytest.raises(ValueError, match="outside of 0 to 1"):
            samples.of_rates(np.array([2.0]), np.array([[wrong], [0.5]]), 4)


def test_the_mean_of_a_normal_tail() -> None:
    drawn = np.random.default_rng(0).normal(size=1_000_000)
    expected = [np.sqrt(2.0 / np.pi), drawn[drawn > 1.0].mean()]
    np.testing.assert_allclose(fitting.mean_of_tail(np.array([0.0, 1.0])), expected, rtol=2e-3)


def test_the_covariance_of_an_integrated_random_walk() -> None:
    """The integral of a Wiener process has variance 1/3 at 1, 8/3 at 2, and covariance 5/6."""
    expected = np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 5.0], [0.0, 5.0, 16.0]]) / 6.0
    np.testing.assert_allclose(drift.integrated_wiener(np.array([0.0, 1.0, 2.0])), expected)
