"""The push to first order: exact where at most one robot departs from the reference."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings


def moved(robots: int, seed: int, **settings):
    scenario = BoxPushingSettings(robots=robots, **settings).build()
    scenario.reset(seed)
    rng = np.random.default_rng(seed)
    for _ in range(6):
        scenario.step(rng.integers(4, size=2 * robots))
    return scenario


@pytest.mark.parametrize("seed", range(4))
def test_one_robot_is_exact(seed: int) -> None:
    prediction = moved(1, seed).predict()
    superposition = prediction.superposition
    local = np.arange(16)
    joint = np.stack([local // 4, local % 4], axis=1)
    for agent in range(2):
        found = superposition.states(
            agent, local, superposition.contributions[0, local], np.zeros((1, 16))
        )
        assert found == pytest.approx(prediction.states(agent, joint), rel=0, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_box_goes_where_the_push_says_if_few_depart(seed: int) -> None:
    prediction = moved(3, seed, action_repeat=1, prediction_horizon=2).predict()
    superposition, neutral = prediction.superposition, np.full((16, 6), 2)
    neutral[:, 0], neutral[:, 1] = np.arange(16) // 4, np.arange(16) % 4
    rest = superposition.contributions[1:, 10].sum(axis=0)  # the others maintain
    reference = superposition._box + superposition.contributions[0] + rest
    assert np.abs(prediction.poses(neutral).box - reference).max() < 2e-3


def test_many_robots_are_valued_near_and_far() -> None:
    prediction = moved(12, 1).predict()
    superposition = prediction.superposition
    assert superposition.contributions.shape == (12, 16, 3)
    for codes, effect in zip(superposition.alike, superposition.contributions, strict=True):
        assert (codes <= np.arange(16)).all()
        assert (effect[codes] == effect).all()
    shares = np.full((12, 16), 1 / 16)
    states = superposition.states(3, np.arange(16), np.zeros((16, 3)), shares)
    assert np.isfinite(states).all()
