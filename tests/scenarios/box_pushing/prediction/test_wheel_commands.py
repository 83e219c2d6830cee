"""Wheel commands and twists against every robot action written out."""

from itertools import product

import numpy as np

from nested_agents.scenarios.box_pushing.prediction.wheel_commands import (
    robot_actions,
    speeds_of,
    wheel_commands_of,
)

COMMANDS = np.array(
    [
        [[0.13, 0.0, 0.065, 0.0], [0.065, -0.065, 0.0, 0.0]],
        [[0.13, 0.065, 0.13, 0.0], [0.0, -0.13, -0.13, 0.0]],
    ]
)
EFFECT = np.array([[0.5, 0.5, 0.01], [0.0, 0.0, 0.0], [-18.0, 18.0, 0.0]])
SKID = np.array([[0.5, 0.5, 0.0], [0.0, 0.0, 0.0], [7.0, 7.0, 0.0]])


def test_every_robot_action_has_its_speeds_and_its_twist() -> None:
    found = wheel_commands_of(COMMANDS, np.array([EFFECT, SKID]))
    for r, effect in enumerate((EFFECT, SKID)):
        expected = [[COMMANDS[r, 0, i], COMMANDS[r, 1, j]] for i, j in product(range(4), repeat=2)]
        np.testing.assert_array_equal(found.speeds[r], expected)
        for action, speeds in enumerate(expected):
            twist = effect @ [*speeds, 1.0]
            np.testing.assert_allclose(found.twists[r, action], twist, atol=1e-12)
            assert found.alike[r, action] == expected.index(speeds)


def test_robot_actions_are_digits_in_base_a() -> None:
    joint = np.array([[0, 1, 2, 3], [3, 3, 0, 0]])
    np.testing.assert_array_equal(robot_actions(joint, 2, 4), [[1, 15], [11, 0]])
    commands = wheel_commands_of(COMMANDS, np.array([EFFECT, EFFECT]))
    speeds = speeds_of(robot_actions(joint, 2, 4), commands.speeds)
    np.testing.assert_array_equal(speeds.T[0], [0.13, -0.065, 0.13, 0.0])
