"""Drives and motions against every local code written out."""

from itertools import product

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.prediction.wheel_commands import (
    choices_of,
    drives_of,
    motion_table,
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
def test_every_code_finds_its_speeds_and_its_twist(effect: np.ndarray, merge: bool) -> None:
    found = drives_of(COMMANDS, np.array([effect, effect]), merge)
    for r in range(2):
        for local, (left, right) in enumerate(product(range(4), repeat=2)):
            drive = found.which[r, local]
            expected = [COMMANDS[r, 0, left], COMMANDS[r, 1, right]]
            assert found.speeds[r, drive].tolist() == expected
            assert [found.levels[r, j, found.level[r, j, local]] for j in range(2)] == expected
            twist = found.twists[r, found.first[r, found.motions[r, drive]]]
            np.testing.assert_allclose(twist, effect @ [*expected, 1.0], atol=1e-10)
        distinct = len(np.unique(found.speeds[r, : found.counts[r]], axis=0))
        assert found.counts[r] == distinct == len(set(found.which[r]))
    if effect is SKID and merge:
        assert (found.n_motions < found.counts).all()
    else:
        assert (found.n_motions == found.counts).all()


def test_the_table_holds_the_motions_of_every_joint_action() -> None:
    drives = drives_of(COMMANDS, np.array([SKID, SKID]), True)
    joint = np.indices((4,) * 4).reshape(4, -1).T
    choices, row = motion_table(drives)
    assert len(choices) == drives.n_motions.prod()
    robots = np.arange(2)
    expected = drives.twists[robots, choices_of(joint, drives.which, 4)]
    np.testing.assert_allclose(drives.twists[robots, choices[row]], expected, atol=1e-10)
