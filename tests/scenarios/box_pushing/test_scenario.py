"""The box-pushing scenario: episodes, their ends, and any number of robots."""

import numpy as np
import pytest

from nested_agents.core.loop import control_loop, policy_seed
from nested_agents.core.settings import BatchTDSettings, Decision, SelfModelSettings
from nested_agents.core.team import Team
from nested_agents.scenarios import BoxPushing, BoxPushingSettings
from nested_agents.topologies import build, parse


@pytest.mark.parametrize("robots", [1, 2, 3, 4])
@pytest.mark.parametrize("space", ["paper", "relational"])
def test_teams_of_one_to_four_robots_act_and_learn(robots: int, space: str) -> None:
    scenario = BoxPushing(BoxPushingSettings(robots=robots, state_space=space))
    hierarchy = build(parse("chain"), scenario.agents)
    team = Team.build(BatchTDSettings(), scenario, hierarchy, policy_seed(0))
    for record in control_loop(scenario, team, episodes=1, steps=4, seed=0):
        assert record.states.shape == (2 * robots, scenario.state_space.n_variables)
        assert np.isfinite(record.transition.states).all()
    assert np.any(team.learner.theta != 0)


def test_equal_seeds_give_equal_episodes() -> None:
    def episode(seed: int) -> np.ndarray:
        scenario = BoxPushing(BoxPushingSettings())
        scenario.reset(seed)
        actions = np.random.default_rng(0).integers(4, size=(10, 4))
        return np.array([scenario.step(joint).states for joint in actions])

    np.testing.assert_array_equal(episode(5), episode(5))
    assert np.any(episode(5) != episode(6))


def with_box_at(x: float, settings: BoxPushingSettings) -> BoxPushing:
    scenario = BoxPushing(settings)
    scenario.reset(0)
    scenario.world.place(np.array([[x - 0.3, 0.1, 0.0], [x - 0.3, -0.1, 0.0]]), np.array([x, 0, 1]))
    return scenario


def test_the_goal_ends_the_episode_and_tells_whether_the_box_stays() -> None:
    end = with_box_at(0.97, BoxPushingSettings()).step(np.full(4, 3))
    assert end.terminated
    assert not end.truncated
    assert end.info["stopped_at_goal"]


def test_a_turned_box_is_not_there_if_orientation_counts() -> None:
    settings = BoxPushingSettings(orientation_tolerance=0.26)
    assert not with_box_at(0.97, settings).step(np.full(4, 3)).terminated


def test_an_episode_is_broken_off_when_the_box_leaves_the_arena() -> None:
    end = with_box_at(-0.6, BoxPushingSettings()).step(np.full(4, 3))
    assert end.truncated
    assert not end.terminated


def test_wheel_speeds_follow_the_actions() -> None:
    scenario = BoxPushing(BoxPushingSettings(speed_increment=0.5))
    scenario.reset(0)
    top = scenario.robot.max_speed
    for joint, expected in (
        ([0, 0, 1, 2], [0.5, 0.5, -0.5, 0.0]),
        ([0, 2, 1, 3], [1.0, 0.5, -1.0, 0.0]),
        ([0, 3, 1, 0], [1.0, 0.0, -1.0, 0.5]),
    ):
        info = scenario.step(np.array(joint)).info
        np.testing.assert_allclose(info["wheel_speeds"], np.array(expected) * top)


def test_a_team_finds_out_that_a_wheel_has_seized() -> None:
    failure = {"kind": "seized", "wheels": ["robot1.front-left"]}
    scenario = BoxPushing(BoxPushingSettings(robot="four-wheel", robots=1, failures=[failure]))
    hierarchy = build(parse("chain"), scenario.agents)
    settings = BatchTDSettings(
        self_model=SelfModelSettings(enabled=True), decision=Decision(rule="random")
    )
    team = Team.build(settings, scenario, hierarchy, policy_seed(0))
    for _ in control_loop(scenario, team, episodes=2, steps=40, seed=0):
        pass
    found, nominal = team.self_model.effects[0][0, :4], scenario.nominal_effects[0][0, :4]
    assert abs(found[0]) < 0.3 * nominal[0]
    assert (found[1:] > 0.5 * nominal[1:]).all()
