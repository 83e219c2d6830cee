"""The reward of box pushing (Section VI, Eq. 15-17).

The paper's five conditions overlap: two robots in contact are also within range, and if no robot
is within range then some robot is not. They are tested from the most specific to the least:
C1 and C2 (all in contact), C3 (all within range), C5 (none), C4 (some not). The paper has one
penalty term per robot, R2 and R3 for its two; here every robot has one, with the same constants.

Of a large team one robot is hardly ever out of contact with nobody else, and one that has lost
touch is not distinguished from those that have not. So every robot may be paid by itself
(`RewardSettings.of`): the conditions then hold for its own contact and its own reading.

A learner takes a terminal state for one that is entered for ever. By the conditions a goal that is
reached while one of the robots has lost touch would be punished for ever, so reaching it pays c1,
what R1 is there, whatever the robots do (`RewardSettings.pays_at_goal`).
"""

from typing import NamedTuple

import numpy as np

from ....core.numerics import BoolArray, FloatArray
from .settings import RewardSettings


class Task(NamedTuple):
    """What the robots are asked for, and paid."""

    reward: RewardSettings
    tolerance: float
    """Distance from the goal that counts as reached [m]."""
    orientation_tolerance: float | None
    """Orientation error that still counts as reached [rad]; none: any."""

    def reached(self, distance: FloatArray, orientation: FloatArray) -> BoolArray:
        """Return whether the goal is reached ``(m,)``; parameters as of `reward`."""
        near: BoolArray = distance <= self.tolerance
        if self.orientation_tolerance is not None:
            near = near & (np.abs(orientation) <= self.orientation_tolerance)
        return near


def reward(
    task: Task,
    distance: FloatArray,
    approach: FloatArray,
    orientation: FloatArray,
    contact: BoolArray,
    readings: FloatArray,
) -> FloatArray:
    """Return the reward of ``m`` situations: ``(m, 1)`` of the team, or ``(m, M)`` of every robot.

    Parameters
    ----------
    task
        The constants, and what counts as reached.
    distance
        ``(m,)`` of the box from the goal [m].
    approach
        ``(m,)`` change of that distance since the last decision [m]; negative: nearer.
    orientation
        ``(m,)`` orientation error of the box [rad].
    contact
        ``(m, M)`` whether each robot touches the box.
    readings
        ``(m, M)`` strongest infrared reading of the box by each robot, 0 when out of range.

    Examples
    --------
    Out of range of both robots (Condition 5):

    >>> ones, none = np.ones(1), np.zeros((1, 2))
    >>> task = Task(RewardSettings(), tolerance=0.05, orientation_tolerance=None)
    >>> reward(task, ones, ones, ones, none.astype(bool), none).tolist()
    [[-0.002]]
    """
    settings = task.reward
    if settings.of == "team":  # of robots (m, parties, members)
        contact, readings = contact[:, None], readings[:, None]
    else:
        contact, readings = contact[:, :, None], readings[:, :, None]
    distance, approach, orientation = distance[:, None], approach[:, None], orientation[:, None]
    r1 = settings.c1 * np.exp(-settings.r1 * distance)
    r2_r3 = (settings.c2 * np.exp(-settings.r2 * readings)).sum(axis=2)
    r4 = settings.c4 * np.abs(orientation)
    touching = contact.all(axis=2)
    within = readings > 0.0
    near = -r2_r3 + (r1 if settings.attraction_without_contact else 0.0)
    nearer = approach < -settings.least_approach
    there = task.reached(distance, orientation) & settings.pays_at_goal
    gained = np.full(near.shape, settings.some_out_of_range)
    for condition, pay in (  # from the least specific on
        (~within.any(axis=2), settings.all_out_of_range),
        (within.all(axis=2), near),
        (touching, settings.receding),
        (touching & nearer, r1 - r2_r3 - r4),
        (there, settings.c1),
    ):
        gained = np.where(condition, pay, gained)
    return gained
