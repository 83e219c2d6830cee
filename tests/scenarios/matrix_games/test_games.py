"""Payoffs against the published tables, and the scenario's states, rewards and refusals."""

import numpy as np
import pytest

from nested_agents.core.interface.scenario import Scenario
from nested_agents.core.plugins.settings import SettingsError
from nested_agents.scenarios.checking.checker import check_scenario
from nested_agents.scenarios.matrix_games.scenario import (
    GAMES,
    MatrixGame,
    MatrixGameSettings,
    optimal,
    payoffs_of,
)


def game_of(name, observed):
    return MatrixGameSettings(game=name, observed=observed).build


NAMES = [name if name != "penalty" else "penalty:-100" for name in GAMES]


@pytest.mark.parametrize(
    "name", ["climbing", "partially-stochastic-climbing", "stochastic-climbing"]
)
def test_all_climbing_games_have_the_means_of_climbing(name):
    expected = [[11, -30, 0], [-30, 7, 6], [0, 0, 5]]
    assert payoffs_of(name).mean(axis=0).tolist() == expected
    drawn = (payoffs_of(name)[0] != payoffs_of(name)[1]).sum()
    assert drawn == {"climbing": 0, "partially-stochastic-climbing": 1}.get(name, 9)


def test_the_penalty_game_has_two_optima():
    assert optimal(payoffs_of("penalty:-10")).tolist() == [[1, 0, 0], [0, 0, 0], [0, 0, 1]]


def test_three_agents_are_paid_the_least_of_their_pairs():
    payoffs = payoffs_of("three-agents")[0]
    assert [payoffs[a, a, a] for a in range(3)] == [11, 7, 5]
    assert (payoffs[0, 0, 1], payoffs[0, 0, 2], payoffs[1, 1, 2]) == (-30, 0, 6)
    assert optimal(payoffs_of("three-agents")).sum() == 1


@pytest.mark.parametrize(
    ("game", "said"),
    [
        ("climbling", "did you mean 'climbing'"),
        ("penalty", "penalty:K"),
        ("penalty:x", "must be a number"),
        ("penalty:inf", "must be finite"),
        ("climbing:3", "other games without"),
    ],
)
def test_what_is_no_game_is_refused(game, said):
    with pytest.raises(SettingsError, match=said):
        MatrixGameSettings(game=game)


def test_payoffs_of_ones_own_must_be_square():
    own = MatrixGameSettings(payoffs=((1.0, 0.0), (0.0, 3.0))).build()
    assert own.optimal.tolist() == [[0, 0], [0, 1]]
    with pytest.raises(ValueError, match=r"2 rows of 2, 3 numbers, must be square"):
        MatrixGameSettings(payoffs=((1.0, 0.0), (0.0, 3.0, 1.0))).build()


@pytest.mark.parametrize("observed", ["joint", "own", "above"])
@pytest.mark.parametrize("name", NAMES)
def test_it_keeps_the_promises_of_a_scenario(name, observed):
    game = MatrixGameSettings(game=name, observed=observed).build()
    assert isinstance(game, Scenario)
    check_scenario(game_of(name, observed), steps=8)
    assert game.predict().rewards(np.zeros((1, len(game.agents)), dtype=int)) is not None
    game.reset(0)
    joint = np.array([2, 1, 0])[: len(game.agents)]
    entered = game.step(joint).states
    prediction = game.predict()
    assert prediction.rewards(joint[None]).shape == (1,)
    for i in range(len(game.agents)):
        assert (prediction.states(i, joint[None])[0] == entered[i]).all()


def test_an_agent_sees_what_it_is_told():
    joint = np.array([2, 1, 2])
    states = {
        observed: MatrixGame(
            MatrixGameSettings(game="three-agents", observed=observed)
        ).states_after(joint)
        for observed in ("joint", "own", "above")
    }
    assert states["joint"].tolist() == [[2, 1, 2]] * 3
    assert states["own"].tolist() == [[2], [1], [2]]
    assert states["above"].tolist() == [[2, 0, 0], [1, 2, 0], [2, 2, 1]]


def test_stochastic_payoffs_follow_from_the_seed():
    def paid(seed):
        game = MatrixGameSettings(game="stochastic-climbing").build()
        game.reset(seed)
        return [game.step(np.array([0, 0])).reward for _ in range(40)]

    assert paid(1) == paid(1) != paid(2)
    assert set(paid(1)) == {10.0, 12.0}
