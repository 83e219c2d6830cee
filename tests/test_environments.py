"""Our worlds in the registries: what the libraries' own checks say of each, and refusals."""

import warnings
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test

from nested_agents.core.interface.scenario import checked_scenario
from nested_agents.environments import WORLDS, env_id, register
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.environments import players_of

OPTIONS: dict[str, dict[str, Any]] = {
    "BoxPushing": {"action_repeat": 2, "failures": [{"kind": "weak", "wheels": "*", "gain": 0.5}]},
    "Arm": {"joints": 3, "failures": [{"kind": "locked", "joints": "joint2", "episode": 1}]},
}
LOSS = {"kind": "chain", "failures": [{"kind": "lost", "agents": "*", "probability": 0.5}]}
ADVICE = (
    "We recommend agents to be named", "Action space for each agent probably should",
    "Agent's m.* observation space value is", ".*A Box observation space m.*infinity.*",
    "Observation numpy array is all zeros",
)  # fmt: skip
"""What checks advise against: names with dots, infinite bounds, observations of 0 alone."""


@pytest.fixture(autouse=True)
def _strict():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for advice in ADVICE:
            warnings.filterwarnings("ignore", message=advice)
        yield


@pytest.mark.parametrize("name", WORLDS)
def test_the_checkers_find_nothing(name: str) -> None:
    options = {"steps": 12, **OPTIONS.get(name, {})}
    check_env(gymnasium.make(env_id(name), **options).unwrapped, skip_render_check=True)

    def make() -> Any:
        return pettingzoo.make("parallel", env_id(name), **options)

    parallel_api_test(make(), num_cycles=30)
    parallel_seed_test(make)

    def take_turns() -> Any:
        return pettingzoo.make("aec", env_id(name), topology=LOSS, **options)

    api_test(take_turns(), num_cycles=30)
    seed_test(take_turns, num_cycles=30)


def test_several_worlds_at_once_are_those_of_their_seeds() -> None:
    envs = gymnasium.make_vec("nested_agents.environments:NestedAgents/Arm-v0", 3, joints=2)
    seen, _ = envs.reset(seed=5)
    for i in range(3):
        alone, _ = gymnasium.make(env_id("Arm"), joints=2).reset(seed=5 + i)
        np.testing.assert_array_equal(seen[i], alone)
    envs.close()


def test_an_environment_is_its_scenario() -> None:
    env = pettingzoo.make("parallel", env_id("LineUp"))
    seen, _ = env.reset(seed=0, options={"world": 7})
    world = checked_scenario(SCENARIOS.parsed("line-up").build())
    states = world.reset(7)
    np.testing.assert_array_equal([seen[a] for a in env.agents], states.astype(np.float32))
    _, rewards, *_ = env.step(dict.fromkeys(env.agents, 2))
    assert [*rewards.values()] == [world.step(np.array([2, 2])).reward] * 2


@pytest.mark.parametrize(("probability", "heard"), [(0.0, True), (1.0, False)])
def test_lost_messages_are_not_heard(probability: float, *, heard: bool) -> None:
    failures = [{"kind": "lost", "agents": "*", "probability": probability}]
    topology = {"kind": "chain", "failures": failures}
    env = pettingzoo.make("aec", env_id("LineUp"), topology=topology)
    env.reset(seed=0)
    env.step(2)
    told = env.last()[0][-8:].tolist()
    assert told == [0.0, 0.0, float(heard), *[0.0] * 5]
    assert env.last()[0][-8:].tolist() == told  # asked again, nothing else is drawn


def test_bodies_are_players() -> None:
    env = pettingzoo.make("parallel", env_id("BoxPushing"), players="bodies", robots=3)
    assert env.possible_agents == ["robot1", "robot2", "robot3"]
    arm = pettingzoo.make("parallel", env_id("Arm"), players="bodies", joints=3)
    assert len(arm.possible_agents) == len(arm.scenario.groups)


def test_bodies_whose_names_begin_alike_are_as_many_players() -> None:
    scenario = checked_scenario(SCENARIOS.parsed("line-up").build())
    scenario.agents, scenario.groups = ("team.a", "team.b"), ((0,), (1,))
    assert players_of(scenario, "bodies") == {"team.a": [0], "team.b": [1]}


@pytest.mark.parametrize(
    ("name", "options", "complaint"),
    [
        ("Arm", {"jionts": 3}, "jionts"),
        ("BoxPushing", {"robots": 0}, "robots"),
        ("Arm", {"players": "robots"}, "players = 'robots', allowed: agents, bodies"),
        ("LineUp", {"render_mode": "ansi"}, "render_mode = 'ansi', allowed None"),
    ],
)
def test_refusals(name: str, options: dict[str, Any], complaint: str) -> None:
    register()  # again: nothing is registered twice
    with pytest.raises(ValueError, match=complaint):
        pettingzoo.make("parallel", env_id(name), **options)
