"""Laws of growth: against curves that are known, and their promises by simulation."""

import numpy as np
import pytest

from nested_agents.studies.results import drift, laws

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
    law = laws.choose(laws.of_numbers(SIZES, np.tile(LAWS["power law"](SIZES), (3, 1))))
    assert law.curve.name == "power law"
    exponent = law.exponents()["exponent"]
    assert [float(end) for end in exponent] == pytest.approx([0.6] * 3)
    assert float(law.predict(128.0).value) == pytest.approx(5.0 * 128.0**0.6)


@pytest.mark.parametrize("name", LAWS)
def test_the_law_that_holds_is_chosen_and_predicts(name) -> None:
    sample = laws.of_numbers(SIZES, drawn(LAWS[name]))
    law = laws.choose(sample)
    assert law.curve.name == name
    e = law.predict(128.0)
    assert e.low < LAWS[name](np.array(128.0)) < e.high
    assert [size for size, *_ in law.held_out] == [32.0, 64.0]


def test_pairs_of_agents_are_linear_to_quadratic() -> None:
    """As messages of a chain are, n (n - 1) / 2, which no power law predicts."""
    sample = laws.of_numbers(SIZES, np.tile(SIZES * (SIZES - 1.0) / 2.0, (3, 1)))
    law = laws.choose(sample)
    assert law.curve.name == "linear to quadratic"
    assert float(law.predict(128.0).value) == pytest.approx(128 * 127 / 2, rel=1e-4)


def test_sizes_that_deviate_from_a_law_widen_what_it_predicts_far_away() -> None:
    deviations = np.exp([0.2, -0.2, -0.2, 0.2, 0.2, -0.2])
    laws_of = [
        laws.fit(laws.POWER, laws.of_numbers(SIZES, np.tile(SIZES * own, (3, 1))))
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
        law = laws.fit(laws.POWER, laws.of_numbers(sizes[:7], values[:, :7]), 100)
        p = law.predict(64.0)
        inside += bool(p.low <= np.exp(np.log(values[:, 7]).mean()) <= p.high)
    assert 0.86 <= inside / times <= 0.94, inside / times


@pytest.mark.parametrize("curve", [*laws.LOG.curves, laws.LOGISTIC], ids=lambda curve: curve.name)
def test_slopes_are_derivatives(curve) -> None:
    x, p = np.log(SIZES), np.array([0.4, 0.7, -0.3, 2.0])[: curve.n_parameters]
    steps = 1e-6 * np.eye(len(p))
    each = [(curve.of(p + step, x) - curve.of(p - step, x)) / 2e-6 for step in steps]
    np.testing.assert_allclose(curve.slopes(p, x), np.transpose(each), rtol=0, atol=1e-8)


def test_a_break_is_met_by_a_fit() -> None:
    def broken(n):
        return np.where(n < 8.0, n**0.2, 8.0**0.2 * (n / 8.0) ** 1.5)

    values = np.tile(broken(SIZES), (3, 1)) * np.array([[0.9], [1.0], [1.1]])
    fitted = laws.fit(laws.BREAK, laws.of_numbers(SIZES, values)).exponents()
    assert float(fitted["exponent below"].value) == pytest.approx(0.2, abs=1e-3)
    assert float(fitted["exponent above"].value) == pytest.approx(1.5, abs=1e-3)
    assert float(fitted["break"].value) == pytest.approx(8.0, rel=1e-2)


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
        law = laws.fit(laws.POWER, laws.of_numbers(sizes[:4], values[:, :4]), 100)
        e = law.exponents()["exponent"]
        p = law.predict(64.0)
        new = 5.0 * 64.0**0.4 * np.exp(rng.normal(0.0, np.hypot(0.15, 0.3), size=9).mean())
        covered += [e.low <= 0.4 <= e.high, p.low <= new <= p.high]
    assert 0.91 <= covered[0] / times <= 0.99, "95%"
    assert covered[1] / times >= 0.85, "90%, of more laws than one that does not wander"


def test_rates_follow_a_logistic_curve() -> None:
    rng = np.random.default_rng(0)
    rates = 1.0 / (1.0 + np.exp(-(3.0 - 0.9 * np.log(SIZES))))
    law = laws.choose(laws.of_rates(SIZES, rng.binomial(50, rates, size=(12, 6)), 50))
    assert law.curve.name == "logistic in log n"
    e = law.exponents()["exponent"]
    assert e.low <= -0.9 <= e.high
    assert 0.0 < float(law.predict(1e6).low) < float(law.predict(1e6).high) < 1.0


def test_runs_that_all_ended_alike_still_have_an_interval_of_predictions() -> None:
    law = laws.choose(laws.of_rates(SIZES, np.full((8, 6), 10), 10))
    e = law.predict(128.0)
    assert float(e.low) <= float(e.value) <= float(e.high)


def test_what_was_not_reached_is_known_to_be_larger() -> None:
    """Taken for reached, it would flatten the law."""
    values = drawn(lambda n: 50.0 * n**0.5, SIZES[:4], noise=0.4)
    limit = 120.0
    cut = np.minimum(values, limit)
    censored = laws.choose(laws.of_numbers(SIZES[:4], cut, values > limit)).exponents()["exponent"]
    taken = laws.fit(laws.POWER, laws.of_numbers(SIZES[:4], cut)).exponents()["exponent"]
    assert float(taken.value) < float(censored.value) - 0.1
    assert censored.low <= 0.5 <= censored.high


def test_exponents_are_compared_seed_by_seed() -> None:
    common = np.random.default_rng(0).normal(size=(8, 1)) * np.log(SIZES)
    one = laws.fit(laws.POWER, laws.of_numbers(SIZES, np.exp(common + 0.5 * np.log(SIZES))))
    other = laws.fit(laws.POWER, laws.of_numbers(SIZES, np.exp(common + 0.2 * np.log(SIZES))))
    contrast = laws.compare(one, other)
    assert float(contrast.difference.value) == pytest.approx(0.3)
    assert contrast.p < 1e-6
    assert laws.compare(one, one).p == 1.0


@pytest.mark.parametrize(
    ("sizes", "seeds", "said"),
    [(2, 5, "2 sizes and 5 seeds: a law takes 3"), (4, 1, "4 sizes and 1 seed: a law takes 3")],
)
def test_too_little_is_no_law(sizes, seeds, said) -> None:
    with pytest.raises(ValueError, match=said):
        laws.choose(laws.of_numbers(SIZES[:sizes], np.ones((seeds, sizes))))


def test_nothing_but_censored_runs_is_no_law() -> None:
    with pytest.raises(ValueError, match="all are censored"):
        laws.of_numbers(SIZES, np.ones((3, 6)), np.ones((3, 6), dtype=bool))
    with pytest.raises(ValueError, match="of positive numbers"):
        laws.of_numbers(SIZES, np.zeros((3, 6)))
