"""Wheel commands and twists against every robot-action index written out."""

from itertools import product

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.prediction.wheel_commands import (
    choices_of,
    twist_table,
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


@pytest.mark.parametrize("merge", [False, True])
@pytest.mark.parametrize("effect", [EFFECT, SKID])
def test_every_index_finds_its_speeds_and_its_twist(effect: np.ndarray, merge: bool) -> None:
    found = wheel_commands_of(COMMANDS, np.array([effect, effect]), merge)
    for r in range(2):
        for index, (left, right) in enumerate(product(range(4), repeat=2)):
            command = found.which[r, index]
            expected = [COMMANDS[r, 0, left], COMMANDS[r, 1, right]]
            assert found.speeds[r, command].tolist() == expected
            assert [found.levels[r, j, found.level[r, j, index]] for j in range(2)] == expected
            twist = found.twists[r, found.first[r, found.distinct[r, command]]]
            np.testing.assert_allclose(twist, effect @ [*expected, 1.0], atol=1e-10)
        told = len(np.unique(found.speeds[r, : found.counts[r]], axis=0))
        assert found.counts[r] == told == len(set(found.which[r]))
    if effect is SKID and merge:
        assert (found.n_distinct < found.counts).all()
    else:
        assert (found.n_distinct == found.counts).all()


def test_the_table_holds_the_twists_of_every_joint_action() -> None:
    commands = wheel_commands_of(COMMANDS, np.array([SKID, SKID]), True)
    joint = np.indices((4,) * 4).reshape(4, -1).T
    choices, row = twist_table(commands)
    assert len(choices) == commands.n_distinct.prod()
    robots = np.arange(2)
    expected = commands.twists[robots, choices_of(joint, commands.which, 4)]
    np.testing.assert_allclose(commands.twists[robots, choices[row]], expected, atol=1e-10)
