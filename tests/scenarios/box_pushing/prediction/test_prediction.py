"""Predictions: block tables, single joint actions and rewards agree with each other."""

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


@pytest.mark.parametrize("robots", [1, 2])
def test_relational_blocks_are_the_states_of_every_joint_action(robots: int) -> None:
    scenario = moving(robots=robots)
    prediction, joint = scenario.predict(), all_joint_actions(2 * robots)
    for agent in range(len(scenario.agents)):
        tables = prediction.blocks(agent).states(np.arange(len(joint)))
        np.testing.assert_array_equal(tables, prediction.states(agent, joint))


def distinct_commands(prediction) -> int:
    return len(set(prediction.alike[0].tolist()))


def test_wheel_commands_of_one_twist_are_pushed_once() -> None:
    scenario = moving(robot="four-wheel", robots=1)
    prediction, joint = scenario.predict(), all_joint_actions(4)
    for agent in range(4):
        blocks = prediction.blocks(agent)
        # Three speeds of each wheel, so six sums at most on each side; two are at rest.
        assert len(blocks.shared) <= 36 < distinct_commands(prediction)
        tables = blocks.states(np.arange(len(joint)))
        np.testing.assert_allclose(tables, prediction.states(agent, joint), rtol=0, atol=1e-12)


def test_simulated_predictions_distinguish_wheel_commands_of_one_twist() -> None:
    prediction = moving(robot="four-wheel", robots=1, predictor="exact").predict()
    assert len(prediction.blocks(0).shared) == distinct_commands(prediction)


def test_the_own_block_of_the_paper_is_that_of_the_robot_alone() -> None:
    scenario = moving(state_space="paper")
    prediction, joint = scenario.predict(), all_joint_actions(4)
    for agent in range(4):
        tables = prediction.blocks(agent).states(np.arange(256))
        states = prediction.states(agent, joint)
        np.testing.assert_array_equal(tables[:, 3:], states[:, 3:])
        # The distance from the goal of a robot that the other one hardly moves.
        assert np.abs(tables - states)[:, 2].max() < 0.05


def test_predicted_rewards_know_the_sensors() -> None:
    usual = moving().predict().reward_table()
    short = moving(infrared={"reach": 0.001}).predict().reward_table()
    assert (short <= usual).all()
    assert (short < usual).any()


def test_rewards_by_index_are_the_rewards_of_every_joint_action() -> None:
    prediction = moving().predict()
    np.testing.assert_array_equal(
        prediction.reward_table(), prediction.rewards(all_joint_actions(4))
    )


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
