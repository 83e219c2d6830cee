"""Exploration: the paper's schedule, bursts, Eq. 14, ties."""

from math import e, exp

import numpy as np
import pytest

from nested_agents.core.plugins.settings import SettingsError
from nested_agents.core.search.exploration import (
    BurstExploration,
    Bursts,
    EpsilonDecreasingBoltzmann,
    PaperExploration,
    boltzmann,
    greatest,
)

VALUES = np.array([0.0, 3.0, 1.0, 2.0])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def fractions(draws: list[int], n: int) -> np.ndarray:
    return np.bincount(draws, minlength=n) / len(draws)


def after(explorer: EpsilonDecreasingBoltzmann, steps: int) -> EpsilonDecreasingBoltzmann:
    explorer.begin_episode()
    for _ in range(steps):
        explorer.advance()
    return explorer


def test_boltzmann_by_hand() -> None:
    # exp(0), exp(1), exp(2) over 1 + e + e^2 at temperature 2.
    expected = np.array([1.0, e, e * e]) / (1.0 + e + e * e)
    assert boltzmann(np.array([0.0, 2.0, 4.0]), 2.0) == pytest.approx(expected, abs=1e-15)


def test_boltzmann_at_the_ends() -> None:
    assert boltzmann(VALUES, 1e12) == pytest.approx(np.full(4, 0.25), abs=1e-11)
    assert boltzmann(VALUES, 1e-3) == pytest.approx([0, 1, 0, 0], abs=1e-15)
    assert boltzmann(VALUES * 1e6 - 1e9, 1.0) == pytest.approx([0, 1, 0, 0], abs=1e-15)
    assert boltzmann(VALUES + 1e5, 1.0) == pytest.approx(boltzmann(VALUES, 1.0), rel=1e-9)


def test_temperature_and_rate_at_the_start_and_later() -> None:
    # T(0) = 1 + T_max and the rate is eps T_max / (T_max - 1); T(t) -> 1 and the rate -> 0.
    explorer = after(EpsilonDecreasingBoltzmann(PaperExploration(epsilon=0.5), 1), 0)
    assert explorer.temperature == pytest.approx(101.0)
    assert explorer.rate == pytest.approx(0.5 * 100.0 / 99.0)
    after(explorer, 450)
    assert explorer.temperature == pytest.approx(1.0 + 100.0 * exp(-2.25))
    assert explorer.rate == pytest.approx(0.5 * 100.0 * exp(-2.25) / 99.0)
    after(explorer, 20000)
    assert explorer.temperature == pytest.approx(1.0)
    assert explorer.rate == pytest.approx(0.0, abs=1e-12)


def test_the_rate_is_cut_off_at_one() -> None:
    # The rate 100 exp(-0.005 t) / 99 exceeds 1 until t = 200 ln(100 / 99) = 2.01.
    explorer = EpsilonDecreasingBoltzmann(PaperExploration(), 1)
    assert after(explorer, 0).rate == 1.0
    assert after(explorer, 2).rate == 1.0
    assert explorer.memory[0] == 2.0
    explorer.advance()
    assert explorer.rate == pytest.approx(100.0 * exp(-0.015) / 99.0)
    assert explorer.rate < 1.0


@pytest.mark.parametrize(("clock", "expected"), [("run", 9.0), ("episode", 4.0)])
def test_the_clock_counts_the_run_or_the_episode(clock: str, expected: float) -> None:
    explorer = EpsilonDecreasingBoltzmann(PaperExploration(clock=clock), 1)
    assert after(after(explorer, 5), 4).memory[0] == expected


def test_of_values_that_are_no_numbers_none_is_greatest(rng: np.random.Generator) -> None:
    with pytest.raises(ArithmeticError, match="2 action values have no maximum"):
        greatest(np.full(2, np.nan), rng)


def test_without_epsilon_the_greatest_is_taken(rng: np.random.Generator) -> None:
    explorer = EpsilonDecreasingBoltzmann(PaperExploration(epsilon=0.0), 1)
    assert {explorer.choose(0, VALUES, rng) for _ in range(200)} == {1}


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        # rate 1: uniform, or Eq. 14 at T = 1 + 3.
        ({"epsilon": 1.0, "explore": "uniform"}, np.full(4, 0.25)),
        ({"epsilon": 1.0, "explore": "boltzmann"}, boltzmann(VALUES, 4.0)),
        # rate 0.2 * 3 / 2 = 0.3: seven tenths on action 1, the rest uniform.
        ({"epsilon": 0.2, "explore": "uniform"}, 0.3 * 0.25 + 0.7 * np.array([0, 1, 0, 0])),
        (
            {"epsilon": 0.2, "explore": "uniform", "exploit": "sample"},
            0.3 * 0.25 + 0.7 * boltzmann(VALUES, 4.0),
        ),
        ({"epsilon": 0.0, "exploit": "sample"}, boltzmann(VALUES, 4.0)),
    ],
)
def test_how_actions_are_drawn(
    settings: dict, expected: np.ndarray, rng: np.random.Generator
) -> None:
    explorer = EpsilonDecreasingBoltzmann(PaperExploration(max_temperature=3.0, **settings), 1)
    drawn = fractions([explorer.choose(0, VALUES, rng) for _ in range(20000)], 4)
    # Five standard deviations of a share of 20000 draws are below 0.018.
    assert drawn == pytest.approx(expected, abs=0.018)


@pytest.mark.parametrize("rate", [0.0, 0.05, 0.3, 0.9, 1.0])
@pytest.mark.parametrize("length", [1.0, 4.0, 10.0])
def test_the_fraction_of_explorative_decisions_is_the_rate(
    rate: float, length: float, rng: np.random.Generator
) -> None:
    settings = BurstExploration(rate=rate, floor=0.0, length=length)
    explorer = Bursts(settings, 1)
    explorer.begin_episode()
    decisions, values = 30000, np.eye(20)[0]
    random = np.count_nonzero([explorer.choose(0, values, rng) for _ in range(decisions)])
    # Bursts of mean length l give as much certainty as decisions / 2 l independent ones.
    deviation = np.sqrt(rate * (1 - rate) * 2 * length / decisions)
    # One in twenty random actions is the greatest.
    assert random / decisions / 0.95 == pytest.approx(rate, abs=5 * deviation + 0.005)


def test_a_random_action_is_held(rng: np.random.Generator) -> None:
    # With very many actions two bursts in a row never hold the same one.
    explorer = Bursts(BurstExploration(rate=1.0, length=4.0), 1)
    explorer.begin_episode()
    values = np.zeros(10**6)
    held = np.array([explorer.choose(0, values, rng) for _ in range(8000)])
    bursts = 1 + np.count_nonzero(np.diff(held))
    assert 8000 / bursts == pytest.approx(4.0, abs=0.4)


def test_bursts_decay_by_episode_to_the_floor() -> None:
    explorer = Bursts(BurstExploration(rate=0.4, decay=0.5, floor=0.03, length=4.0), 2)
    rates = []
    for _ in range(6):
        explorer.begin_episode()
        rates.append(explorer.rate)
    assert rates == pytest.approx([0.4, 0.2, 0.1, 0.05, 0.03, 0.03])


def test_an_episode_ends_every_burst(rng: np.random.Generator) -> None:
    explorer = Bursts(BurstExploration(rate=1.0, decay=0.0, floor=0.0, length=1e6), 2)
    explorer.begin_episode()
    for agent in range(2):
        explorer.choose(agent, VALUES, rng)
    assert (explorer.memory[[1, 3]] > 0).all()
    explorer.begin_episode()
    assert [explorer.choose(agent, VALUES, rng) for agent in range(2)] == [1, 1]


def test_agents_burst_independently(rng: np.random.Generator) -> None:
    explorer = Bursts(BurstExploration(rate=0.5, length=5.0), 2)
    explorer.begin_episode()
    busy = []
    for _ in range(4000):
        for agent in range(2):
            explorer.choose(agent, VALUES, rng)
        busy.append(explorer.memory[[1, 3]] > 0)
    assert abs(np.corrcoef(np.array(busy).T)[0, 1]) < 0.15


def test_ties_are_broken_at_random(rng: np.random.Generator) -> None:
    values = np.array([1.0, 5.0, 5.0, 5.0 - 1e-13, 5.0 - 1e-6])
    drawn = fractions([greatest(values, rng) for _ in range(9000)], 5)
    assert drawn == pytest.approx([0, 1 / 3, 1 / 3, 1 / 3, 0], abs=0.025)


def test_without_a_tie_no_random_number_is_used(rng: np.random.Generator) -> None:
    before = rng.bit_generator.state
    assert greatest(-VALUES, rng) == 0
    assert rng.bit_generator.state == before


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_ties_are_relative_for_large_values(scale: float, rng: np.random.Generator) -> None:
    drawn = {greatest(scale * np.array([1.0, 1.0 + 1e-15]), rng) for _ in range(60)}
    assert drawn == {0, 1}


def test_settings_choose_the_explorer() -> None:
    assert isinstance(PaperExploration().build(3), EpsilonDecreasingBoltzmann)
    bursts = BurstExploration().build(3)
    assert isinstance(bursts, Bursts)
    assert bursts.memory.shape == (7,)


@pytest.mark.parametrize(
    ("settings", "values"),
    [
        (PaperExploration, {"max_temperature": 1.0}),
        (PaperExploration, {"epsilon": 1.1}),
        (PaperExploration, {"decay": -0.1}),
        (BurstExploration, {"length": 0.5}),
        (BurstExploration, {"rate": -0.1}),
        (BurstExploration, {"epsilon": 0.1}),
    ],
)
def test_settings_outside_their_range_are_refused(settings: type, values: dict) -> None:
    with pytest.raises(SettingsError):
        settings(**values)
