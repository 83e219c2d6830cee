"""What is drawn, paid and measured in worlds of private signals."""

import numpy as np
import pytest
from nested_agents_signals.scenario import Plays, SignalEnvironments, SignalsSettings

from nested_agents.core.plugins.settings import SettingsError
from nested_agents.scenarios.checking.checker import check_scenario

SEEDS = [np.random.SeedSequence(seed) for seed in range(5)]


@pytest.mark.parametrize("pays", ["own", "vote"])
def test_it_keeps_the_promises_of_a_scenario(pays):
    check_scenario(SignalsSettings(players=4, pays=pays).build, steps=8)


def test_agents_are_paid_for_themselves_or_for_the_vote():
    # the state is b, the coin says a, signals are b, a, b
    play = Plays.of(np.array([0.1, 0.9, 0.2, 0.8, 0.6]), 0.7)
    assert play.signals.tolist() == [True, False, True]
    own = SignalsSettings(players=3).build()
    vote = SignalsSettings(players=3, pays="vote").build()
    for world in (own, vote):
        world.reset(0)
        world._play = play
    paid = own.step(np.array([1, 0, 1]))
    assert paid.reward.tolist() == [1.0, 0.0, 1.0]
    assert paid.info == {"right": 2 / 3, "vote": 1.0, "last": 1.0, "followed": 0.0}
    paid = vote.step(np.array([0, 0, 1]))
    assert (paid.reward, paid.info["followed"]) == (0.0, 1 / 3)


def test_a_coin_decides_a_tied_vote():
    named = np.array([[1, 0], [1, 0]])
    plays = Plays.of(np.array([[0.1, 0.4, 0.0, 0.0], [0.1, 0.6, 0.0, 0.0]]), 0.7)
    assert plays.vote(named).tolist() == [True, False]


def test_signals_are_as_accurate_as_they_should_be():
    plays = Plays.of(np.random.default_rng(0).random((400, 102)), 0.8)
    assert plays.right(plays.signals).mean() == pytest.approx(0.8, abs=4 * 0.4 / 200)
    assert plays.states.mean() == pytest.approx(0.5, abs=4 * 0.5 / 20)


@pytest.mark.parametrize("pays", ["own", "vote"])
def test_worlds_that_are_played_together_are_what_each_is_by_itself(pays):
    settings = SignalsSettings(players=4, pays=pays)
    worlds = SignalEnvironments(settings.build(), len(SEEDS))
    alone = [settings.build() for _ in SEEDS]
    rng = np.random.default_rng(0)
    assert np.array_equal(
        worlds.reset(SEEDS), [world.reset(seed) for world, seed in zip(alone, SEEDS, strict=True)]
    )
    for _ in range(6):
        joint = rng.integers(0, 2, size=(len(SEEDS), 4))
        together = worlds.step(joint)
        each = [world.step(own) for world, own in zip(alone, joint, strict=True)]
        assert np.array_equal(together.states, [one.states for one in each])
        for rewards, one in zip(together.rewards, each, strict=True):
            assert rewards.tolist() == np.broadcast_to(one.reward, 4).tolist()
        assert not together.terminated.any()


@pytest.mark.parametrize(
    ("wrong", "said"), [({"accuracy": 0.5}, "accuracy"), ({"players": 1}, "players")]
)
def test_what_makes_no_task_is_refused(wrong, said):
    with pytest.raises(SettingsError, match=said):
        SignalsSettings(**wrong)
