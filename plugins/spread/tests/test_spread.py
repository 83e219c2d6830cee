"""Spread: its physics by hand, and that it is simple_spread."""

import numpy as np
import pytest
from nested_agents_spread import DAMPING, PERIOD_S, SpreadSettings, advance, score


def test_a_push_by_hand():
    places = np.array([[0.0, 0.0], [5.0, 5.0]])
    velocities = np.array([[1.0, 0.0], [0.0, 0.0]])
    moved, faster = advance(places, velocities, np.array([2, 3]))
    assert moved.tolist() == [[PERIOD_S, 0.0], [5.0, 5.0]]
    assert faster == pytest.approx(np.array([[DAMPING + 0.5, 0.0], [0.0, -0.5]]))


def test_contact_pushes_apart_and_costs():
    places = np.array([[0.0, 0.0], [0.2, 0.0]])
    _, velocities = advance(places, np.zeros((2, 2)), np.array([0, 0]))
    # 0.1 m of penetration, 100 N/m, 0.1 s
    assert velocities == pytest.approx(np.array([[-1.0, 0.0], [1.0, 0.0]]))
    rewards, covered, touching = score(places, np.array([[0.0, 0.0], [0.2, 1.0]]))
    assert rewards.tolist() == [-1.0, -1.0]
    assert covered == 0.5
    assert touching.tolist() == [1, 1]


def test_permuting_agents_permutes_results():
    rng = np.random.default_rng(0)
    places = rng.uniform(-0.3, 0.3, (4, 2))
    velocities = rng.normal(size=(4, 2))
    actions = np.array([0, 1, 2, 4])
    order = np.array([2, 0, 3, 1])
    plain = advance(places, velocities, actions)
    mixed = advance(places[order], velocities[order], actions[order])
    for one, other in zip(plain, mixed, strict=True):
        assert other == pytest.approx(one[order], abs=1e-12)


def test_it_is_simple_spread():
    simple_spread = pytest.importorskip("mpe2.simple_spread_v3")
    other = simple_spread.parallel_env()
    world = SpreadSettings().build()
    rng = np.random.default_rng(0)
    for episode in range(6):
        other.reset(seed=episode)
        inside = other.unwrapped.world
        world.reset(0)
        for agent in inside.agents if episode % 2 else ():
            agent.state.p_pos = 0.2 * agent.state.p_pos
        world.positions = np.array([agent.state.p_pos for agent in inside.agents])
        world.landmarks = np.array([landmark.state.p_pos for landmark in inside.landmarks])
        for _ in range(25):
            joint = rng.integers(0, 5, 3)
            seen, rewards, _, cut, _ = other.step(dict(zip(other.agents, joint, strict=True)))
            step = world.step(joint)
            assert np.array(list(seen.values()))[:, :14] == pytest.approx(step.states, abs=1e-6)
            assert np.array(list(rewards.values())) == pytest.approx(step.reward, abs=1e-6)
        assert step.truncated
        assert all(cut.values())
