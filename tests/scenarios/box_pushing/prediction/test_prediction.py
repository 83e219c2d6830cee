"""Predictions: states of single agents, of all agents, and rewards agree with each other."""

import numpy as np
import pytest

from nested_agents.core.interface.prediction import Assumptions
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.prediction.twists import mean_twists
from nested_agents.scenarios.box_pushing.scenario import BoxPushing


def moving(**settings) -> BoxPushing:
    scenario = BoxPushing(BoxPushingSettings(**settings))
    scenario.reset(3)
    scenario.step(np.arange(len(scenario.agents)) % 2)
    return scenario


def all_joint_actions(n: int) -> np.ndarray:
    return np.indices((4,) * n).reshape(n, -1).T


def test_predicted_rewards_know_the_sensors() -> None:
    joint = all_joint_actions(4)
    usual = moving().predict().rewards(joint)
    short = moving(infrared={"reach": 0.001}).predict().rewards(joint)
    assert (short <= usual).all()
    assert (short < usual).any()


def test_commands_are_what_the_servo_layer_commands() -> None:
    scenario = moving()
    joint = np.array([0, 1, 2, 3])
    commands = scenario.predict().commands(joint)
    scenario.step(joint)
    np.testing.assert_array_equal(commands, scenario.measure()["wheel_speeds"])


def test_free_robots_do_not_slip() -> None:
    scenario = BoxPushing(BoxPushingSettings())
    scenario.reset(3)
    scenario.world.place(
        np.array([[-1.0, 0.3, 0.4], [-1.0, -0.3, 1.0]]), scenario.world.box_pose.copy()
    )
    slips = scenario.predict().slips(np.array([0, 0, 0, 2]))
    np.testing.assert_allclose(slips, 0.0, atol=2e-3)


def test_mean_twists_invert_driving_an_arc() -> None:
    before = np.array([[0.2, -0.1, 3.0]])
    ahead, turn, seconds = 0.08, 0.9, 0.5
    heading = 3.0 + turn * seconds
    radius = ahead / turn
    chord = radius * np.array([np.sin(heading) - np.sin(3.0), np.cos(3.0) - np.cos(heading)])
    after = before + np.append(chord, turn * seconds)
    found = mean_twists(before, after, seconds)
    np.testing.assert_allclose(found, [[ahead, 0.0, turn]], atol=1e-12)


def test_mean_twists_count_whole_turns_and_stay_finite() -> None:
    turns = np.array([0.5, -0.9, 1.0, 2.5, -7.0]) * 2.0 * np.pi
    before = np.zeros((5, 3))
    after = np.column_stack([np.full(5, 1e-3), np.zeros(5), turns])
    found = mean_twists(before, after, 0.5)
    np.testing.assert_allclose(found[:, 2], turns / 0.5)
    assert np.hypot(found[:, 0], found[:, 1]).max() < 0.004


@pytest.mark.parametrize("rate", [5.0, 9.0, 40.0, 3000.0])
def test_contact_takes_nothing_from_robots_in_the_open_however_fast_they_are_believed(
    rate: float,
) -> None:
    scenario = BoxPushing(BoxPushingSettings())
    scenario.reset(0)
    scenario.world.place(
        np.array([[-1.0, 0.3, 0.4], [-1.0, -0.3, 1.0]]), scenario.world.box_pose.copy()
    )
    believed = [effect.copy() for effect in scenario.nominal_effects]
    believed[0][2, -1] = rate  # turns by itself [rad/s]
    slips = scenario.predict().assuming(Assumptions(effects=believed)).slips(np.full(4, 2))
    np.testing.assert_allclose(slips[:, 2], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "settings", [{}, {"state_space": "paper"}, {"robots": 1}, {"predictor": "exact"}], ids=str
)
def test_the_states_of_all_agents_are_those_of_each(settings: dict) -> None:
    scenario = moving(**settings)
    n = len(scenario.agents)
    joint = np.random.default_rng(0).integers(4, size=(20, n))
    expected = np.stack([scenario.predict().states(agent, joint) for agent in range(n)])
    own, shared = scenario.predict().states_by_group(joint)
    together = np.concatenate([own, np.repeat(shared, n // len(shared), axis=0)], axis=2)
    np.testing.assert_array_equal(together, expected)


def test_equivalent_robot_actions_command_the_same_wheel_speeds() -> None:
    prediction = moving().predict()
    speeds, alike = prediction.wheel_commands.speeds, prediction.alike
    for r in range(2):
        np.testing.assert_array_equal(speeds[r][alike[r]], speeds[r])
    assert (alike < np.arange(alike.shape[1])).any()


@pytest.mark.parametrize(
    "settings", [{}, {"state_space": "paper"}, {"robots": 1}, {"predictor": "exact"}], ids=str
)
def test_equivalent_robot_actions_lead_to_the_same_states(settings: dict) -> None:
    prediction = moving(**settings).predict()
    joint = all_joint_actions(4 if "robots" not in settings else 2)[::5]
    pairs = joint.reshape(len(joint), -1, 2) @ [4, 1]
    first = np.take_along_axis(prediction.alike, pairs.T, axis=1).T
    replaced = np.stack([first // 4, first % 4], axis=-1).reshape(joint.shape)
    for agent in range(joint.shape[1]):
        expected = prediction.states(agent, joint)
        np.testing.assert_array_equal(prediction.states(agent, replaced), expected)
