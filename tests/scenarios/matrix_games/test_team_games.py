"""Games of many agents: their payoffs by hand, and their optima by enumeration."""

from itertools import permutations, product

import numpy as np
import pytest

from nested_agents.core.agents.loop import world_seed
from nested_agents.scenarios.matrix_games.team_games import TeamGame, TeamGameSettings


def begun(seed: int = 3, **keys: object) -> TeamGame:
    game = TeamGameSettings(**keys).build()
    game.reset(world_seed(seed, 0))
    return game


@pytest.mark.parametrize("shape", ["line", "ring", "tree", "grid"])
def test_the_best_payoff_of_a_polymatrix_game_is_that_of_enumeration(shape: str) -> None:
    game = begun(players=6, actions=3, shape=shape)
    every = np.array(list(product(range(3), repeat=6)))
    payoffs = game.payoffs(game.present[None], every)
    assert game.best == payoffs.max()
    best = game.step(every[payoffs.argmax()])
    assert (best.info["optimal"], best.info["share_of_best"]) == (1.0, 1.0)
    worst = game.step(every[payoffs.argmin()])
    assert worst.info["optimal"] == 0.0
    assert worst.info["share_of_best"] == pytest.approx(payoffs.min() / payoffs.max())


def test_a_polymatrix_game_is_a_trials_own_unless_it_has_a_seed() -> None:
    joint = np.zeros(8, dtype=int)
    paid, game = {}, TeamGameSettings().build()
    for seed, episode in product((0, 1), (0, 5)):
        game.reset(world_seed(seed, episode))
        paid[seed, episode] = game.step(joint).reward
    assert paid[0, 0] == paid[0, 5] != paid[1, 0] == paid[1, 5]
    fixed = TeamGameSettings(seed=7).build()
    played = [(fixed.reset(world_seed(s, 0)), fixed.step(joint).reward)[1] for s in (0, 1)]
    assert played[0] == played[1]


def test_landmarks_pay_for_those_taken_less_the_way() -> None:
    game = begun(game="landmarks", players=3, distance_cost=0.5)
    far = game.reset(4)
    assert far.shape == (3, 3)
    taken = game.payoffs(far[None].repeat(3, 0), np.array([[0, 1, 2], [1, 1, 1], [2, 2, 0]]))
    ways = [far[0, 0] + far[1, 1] + far[2, 2], far[:, 1].sum(), far[0, 2] + far[1, 2] + far[2, 0]]
    np.testing.assert_allclose(taken, [1, 1 / 3, 2 / 3] - np.array(ways) / 6)
    every = np.array(list(product(range(3), repeat=3)))
    payoffs = game.payoffs(far[None].repeat(len(every), 0), every)
    optimal = [tuple(joint) for joint in every if game.is_optimal(joint)]
    assert sorted(optimal) == sorted(permutations(range(3)))
    transition = game.step(every[payoffs.argmax()])
    assert transition.info["share_of_best"] == pytest.approx(1.0)
    assert (transition.states != far).all(), "other places at the next play"


def test_numbered_agents_see_which_they_are_and_others_see_no_difference() -> None:
    plain, numbered = (begun(game="permutation", players=3, numbered=n) for n in (False, True))
    assert plain.reset(0).tolist() == [[0.0]] * 3
    assert numbered.reset(0).tolist() == [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]]
    assert [v.name for v in numbered.state_space.variables] == ["play", "number"]
    assert set(plain.roles) == {"player"}
    assert [plain.step(np.array(a)).reward for a in ([2, 0, 1], [2, 0, 2])] == [1.0, 0.0]
