"""Environments: what the ecosystem's own checks say, and that they are the scenario."""

import importlib.util
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

from nested_agents import environments
from nested_agents.core.plugins.settings import changed_values
from nested_agents.environments import env_id
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.pictures.rendering import SIDES
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.settings import WheelFailure
from nested_agents.scenarios.environments import AgentsEnv, JointEnv


def wheels(settings: BoxPushingSettings, steps: int = 450, **options: Any) -> AgentsEnv:
    return AgentsEnv(settings.build(), steps=steps, **options)


def robots(settings: BoxPushingSettings, steps: int = 450) -> AgentsEnv:
    return wheels(settings, steps, players="bodies")


def joint(settings: BoxPushingSettings, steps: int = 450, **options: Any) -> JointEnv:
    return JointEnv(settings.build(), steps=steps, **options)


PARALLEL = [wheels, robots]
PLAIN = BoxPushingSettings()
SETTINGS = [
    BoxPushingSettings(action_repeat=2),
    BoxPushingSettings(
        robots=3, robot="three-wheel", start="hard", state_space="paper", action_repeat=2
    ),
    BoxPushingSettings(
        failures=(WheelFailure.Seized(wheels=("robot1.*",), episode=1),), action_repeat=2
    ),
]


@pytest.mark.parametrize("wrong", [-1, 1.7, 5, None, [0], np.nan, "1", np.int64(5)])
def test_actions_outside_their_space_are_refused(wrong: Any) -> None:
    played = environments.parallel("line-up", carts=2)
    played.reset(seed=0)
    single = gymnasium.make(env_id("LineUp"), carts=2, disable_env_checker=True)
    single.reset(seed=0)
    for step in (
        lambda: played.step({"cart1": 0, "cart2": wrong}),
        lambda: single.step([0, wrong]),
    ):
        with pytest.raises(ValueError, match=r"^step: action .* of .*cart2, allowed: ") as raised:
            step()
        assert "\n" not in str(raised.value)
    played.step({"cart1": np.int64(0), "cart2": np.array(3)})
    single.step(np.array([0.0, 3.0]))


@pytest.mark.parametrize("kind", PARALLEL)
@pytest.mark.parametrize("settings", SETTINGS)
def test_pettingzoo_finds_nothing(kind: Any, settings: BoxPushingSettings) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(kind(settings, steps=30), num_cycles=50)
        parallel_seed_test(lambda: kind(settings, steps=30))


@pytest.mark.parametrize("settings", SETTINGS)
def test_gymnasium_finds_nothing(settings: BoxPushingSettings) -> None:
    keys = changed_values(settings)
    del keys["kind"]
    env = gymnasium.make(env_id("BoxPushing"), steps=20, render_mode="rgb_array", **keys)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Robots may go as far away as they like: such bounds are the true ones.
        warnings.filterwarnings("ignore", message=".*A Box observation space m.*infinity.*")
        check_env(env.unwrapped)
    env.close()


def play(env: AgentsEnv, seed: int | None = 3, steps: int = 12) -> list[Any]:
    """Return all that an episode of equal random actions gives, as comparable bits."""
    rng = np.random.default_rng(5)
    given: list[Any] = [env.reset(seed=seed)[0]]
    while env.agents and len(given) <= steps:
        actions = {}
        for agent in env.agents:
            shape = env.action_space(agent).shape
            actions[agent] = rng.integers(4, size=shape)
        observations, rewards, ends, breaks, _ = env.step(actions)
        given.append((observations, rewards, ends, breaks))
    return [repr(frame) for frame in given]


@pytest.mark.parametrize("kind", PARALLEL)
def test_whole_episodes_follow_from_the_seed(kind: Any) -> None:
    env = kind(SETTINGS[0])
    first, second = play(env), play(env, seed=None)
    assert first != second
    assert (play(env), play(env, seed=None)) == (first, second)
    assert (play(kind(SETTINGS[0])), play(kind(SETTINGS[0]), 4)) != (first, first)
    assert play(kind(SETTINGS[0])) == first


def test_the_three_views_show_one_scenario() -> None:
    by_agent, by_body, single = (kind(SETTINGS[1]) for kind in (wheels, robots, joint))
    scenario = BoxPushing(SETTINGS[1])
    seen = [env.reset(seed=1)[0] for env in (by_agent, by_body, single)]
    states = scenario.reset(int(np.random.default_rng(1).integers(2**63)))
    rows = joint(SETTINGS[1], by_agent=True).reset(seed=1)[0]
    np.testing.assert_array_equal(rows, states.astype(np.float32))
    rng = np.random.default_rng(2)
    for _ in range(8):
        for i, name in enumerate(scenario.agents):
            np.testing.assert_array_equal(seen[0][name], states[i].astype(np.float32))
        own = scenario.state_space.n_own
        expected = [
            np.concatenate([*states[list(group), :own], states[group[0], own:]])
            for group in scenario.groups
        ]
        for r, part in enumerate(expected):
            np.testing.assert_array_equal(seen[1][f"robot{r + 1}"], part.astype(np.float32))
        np.testing.assert_array_equal(seen[2], np.concatenate(expected).astype(np.float32))
        action = rng.integers(4, size=9)
        transition = scenario.step(action)
        states = transition.states
        by_wheel = dict(zip(scenario.agents, action, strict=True))
        by_robot = {f"robot{r + 1}": action[3 * r : 3 * r + 3] for r in range(3)}
        one, two, three = by_agent.step(by_wheel), by_body.step(by_robot), single.step(action)
        seen = [one[0], two[0], three[0]]
        assert set(one[1].values()) | set(two[1].values()) | {three[1]} == {transition.reward}


def test_rewards_are_those_of_the_agents_own_wheels() -> None:
    settings = BoxPushingSettings.model_validate({"reward": {"of": "robot"}})
    by_agent, by_body, single = (kind(settings) for kind in (wheels, robots, joint))
    scenario = BoxPushing(settings)
    scenario.reset(int(np.random.default_rng(6).integers(2**63)))
    for env in (by_agent, by_body, single):
        env.reset(seed=6)
    differed = False
    for _ in range(20):
        paid = scenario.step(np.zeros(4, dtype=int)).reward
        differed |= paid[0] != paid[2]
        assert list(by_agent.step(dict.fromkeys(by_agent.agents, 0))[1].values()) == list(paid)
        of_robots = by_body.step({robot: [0, 0] for robot in by_body.agents})[1]
        assert list(of_robots.values()) == [paid[0], paid[2]]
        assert single.step(np.zeros(4))[1] == np.mean(paid)
    assert differed


@pytest.mark.parametrize("settings", SETTINGS)
def test_observations_stay_within_their_spaces(settings: BoxPushingSettings) -> None:
    env = joint(settings, 60)
    env.action_space.seed(0)
    for seed in range(4):
        seen, _ = env.reset(seed=seed)
        truncated = False
        while not truncated:
            assert env.observation_space.contains(seen)
            seen, _, _, truncated, _ = env.step(env.action_space.sample())


def test_episodes_are_counted_so_that_failures_set_in() -> None:
    env = wheels(SETTINGS[2], 2)
    failed = []
    for options in (None, None, {"episode": 0}, {"episode": 7}, None):
        _, infos = env.reset(seed=0 if not failed else None, options=options)
        failed.append(bool(infos["robot1.left"]["failed"][0]))
    assert failed == [False, True, False, True, True]


def test_an_episode_ends_by_the_clock_and_at_the_goal() -> None:
    env = joint(BoxPushingSettings(tolerance=5.0), 1)
    env.reset(seed=0)
    assert env.step(np.zeros(4))[2:4] == (True, False)
    env = joint(PLAIN, 2)
    env.reset(seed=0)
    assert [env.step(np.zeros(4))[3] for _ in range(2)] == [False, True]


def test_a_step_after_the_end_is_empty() -> None:
    env = wheels(PLAIN, 1)
    env.reset(seed=0)
    assert env.step(dict.fromkeys(env.agents, 0))[3]["robot1.left"]
    assert env.agents == []
    assert env.step({}) == ({}, {}, {}, {}, {})
    assert env.scenario.measure()["robot_poses"].shape == (2, 3)


def test_several_side_by_side_are_those_of_their_seeds() -> None:
    envs = gymnasium.make_vec(
        env_id("BoxPushing"), num_envs=2, vectorization_mode="sync", action_repeat=2, steps=4
    )
    single = [joint(SETTINGS[0], 4) for _ in range(2)]
    seen = envs.reset(seed=6)[0]
    expected = [env.reset(seed=6 + i)[0] for i, env in enumerate(single)]
    for _ in range(4):
        np.testing.assert_array_equal(seen, expected)
        envs.action_space.seed(1)
        actions = envs.action_space.sample()
        seen, _, _, ended, _ = envs.step(actions)
        told = [env.step(action) for env, action in zip(single, actions, strict=True)]
        expected = [given[0] for given in told]
        assert ended.tolist() == [given[3] for given in told]
    assert ended.all()
    envs.close()


def test_pictures() -> None:
    env = joint(SETTINGS[2], render_mode="rgb_array")
    with pytest.raises(RuntimeError, match="call reset first"):
        env.render()
    env.reset(seed=0, options={"episode": 1})
    first = env.render()
    assert (first.shape, first.dtype) == ((SIDES[1], SIDES[0], 3), np.uint8)
    env.step(np.zeros(4))
    assert (env.render() != first).any()
    each = joint(
        BoxPushingSettings.model_validate({"reward": {"of": "robot"}}), render_mode="rgb_array"
    )
    each.reset(seed=0)
    each.step(np.zeros(4))
    assert each.render().shape == first.shape
    assert joint(PLAIN).render() is None


@pytest.mark.skipif(importlib.util.find_spec("pygame") is None, reason="extra [human]")
def test_the_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.wrappers.HumanRendering(joint(PLAIN, render_mode="rgb_array"))
    env.reset(seed=0)
    env.step(np.zeros(4, dtype=int))
    import pygame

    shown = pygame.display.get_surface()
    assert shown.get_size() == SIDES
    assert len(np.unique(pygame.surfarray.array2d(shown))) > 5
    env.close()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"steps": 0}, "steps = 0, must be at least 1"),
        ({"render_mode": "ansi"}, "render_mode = 'ansi', allowed"),
        ({"robots": 0}, "robots"),
        ({"leader": {"policy": "rule"}}, "leader"),
    ],
)
def test_refusals(arguments: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        environments.joint("box-pushing", **arguments)


def test_wrong_settings_are_one_line() -> None:
    with pytest.raises(ValueError, match="robot = 4: must be a string, or must be a table"):
        environments.parallel("box-pushing", robot=4)


def test_a_kind_is_known_and_has_its_own_steps() -> None:
    with pytest.raises(ValueError, match="did you mean 'box-pushing'"):
        environments.joint("box-pushin")
    with pytest.raises(ValueError, match="steps is missing: kind = 'gymnasium'"):
        environments.joint("gymnasium", id="Pendulum-v1")
    assert environments.parallel("box-pushing").steps == 450
