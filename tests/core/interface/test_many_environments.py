"""Many worlds at once have the bits that each has by itself."""

import numpy as np
import pytest

from nested_agents.core.interface.scenario import checked_scenario
from nested_agents.core.interface.stacked import LoopedEnvironments
from nested_agents.scenarios import SCENARIOS

TABLES = {
    "spread": {"kind": "spread", "most_decisions": 7},
    "arm": {"kind": "kinematic-chain", "joints": 4, "most_decisions": 9},
    "climbing": {"kind": "matrix-game", "game": "stochastic-climbing"},
    "three": {"kind": "matrix-game", "game": "three-agents", "observed": "above"},
    "polymatrix": {"kind": "team-game", "players": 5, "numbered": True},
    "permutation": {"kind": "team-game", "game": "permutation", "players": 4},
    "landmarks": {"kind": "team-game", "game": "landmarks", "players": 4, "numbered": True},
    "signals": {"kind": "signals", "players": 4},
    "box": {"kind": "box-pushing"},
    "box, eight": {"kind": "box-pushing", "robots": 8, "state_space": "crowd"},
    "box, pay by robot": {
        "kind": "box-pushing",
        "robots": 3,
        "start": "easy",
        "state_space": "paper",
        "reward": {"of": "robot"},
        "infrared": {"decay": 0.03},
        "action_repeat": 3,
    },
    "box, wide": {"kind": "box-pushing", "robots": 4, "state_space": "wide", "box": "circle"},
    "box, pose": {"kind": "box-pushing", "state_space": "pose", "orientation_tolerance": 0.3},
}
COUNT = 5


def build(name):
    table = dict(TABLES[name])
    return checked_scenario(SCENARIOS.parsed(table.pop("kind"), **table).build())


def seeds_from(first):
    return [np.random.SeedSequence(3, spawn_key=(0, first + k)) for k in range(COUNT)]


@pytest.mark.parametrize("name", TABLES)
def test_many_worlds_are_each_by_itself(name):
    many = build(name).environments(COUNT)
    single = LoopedEnvironments([build(name) for _ in range(COUNT)])
    assert np.array_equal(many.reset(seeds_from(0)), single.reset(seeds_from(0)))
    rng = np.random.default_rng(0)
    n, n_actions = len(build(name).agents), len(build(name).action_set)
    for step in range(20):
        joint = rng.integers(0, n_actions, (COUNT, n))
        for one, other in zip(many.step(joint), single.step(joint), strict=True):
            assert np.array_equal(one, other), step
        if step == 10 and name != "signals":
            places, seeds = [1, 3], seeds_from(9)[:2]
            begun = [worlds.begin(places, seeds, 9) for worlds in (many, single)]
            assert np.array_equal(*begun)


@pytest.mark.parametrize("name", TABLES)
def test_permuting_worlds_permutes_what_they_return(name):
    n, n_actions = len(build(name).agents), len(build(name).action_set)
    order = np.array([3, 0, 4, 1, 2])
    joint = np.random.default_rng(1).integers(0, n_actions, (6, COUNT, n))
    plain = build(name).environments(COUNT)
    mixed = build(name).environments(COUNT)
    seeds = seeds_from(0)
    states = plain.reset(seeds)
    assert np.array_equal(mixed.reset([seeds[k] for k in order]), states[order])
    for own in joint:
        for one, other in zip(plain.step(own), mixed.step(own[order]), strict=True):
            assert np.array_equal(one[order], other)


def test_an_arm_that_fails_is_stepped_by_itself():
    failure = {"kind": "stuck", "joints": "joint2"}
    settings = SCENARIOS.parsed("kinematic-chain", failures=(failure,))
    assert settings.build().environments(2) is None
