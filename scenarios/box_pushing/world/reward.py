"""The reward of box pushing and the end of the task (Section VI, Eq. 15-17).

The paper's five conditions overlap: two robots in contact are also within range, and if no robot
is within range then some robot is not. They are tested from the most specific to the least:
C1 and C2 (all in contact), C3 (all within range), C5 (none), C4 (some not). The paper has one
penalty term per robot, R2 and R3 for its two; here every robot has one, with the same constants.

In a large team nearly always some robot is out of contact, and the conditions do not distinguish
it from the others. Therefore each robot can be rewarded separately (`RewardSettings.of`): the
conditions then apply to its own contact and its own reading.

A learner treats a terminal state as if it lasted forever. If the goal is reached while one robot is
out of contact, the conditions would punish this forever. Therefore reaching the goal always pays
c1, the value of R1 there (`RewardSettings.pays_at_goal`).
"""

from __future__ import annotations

from math import exp, inf
from typing import NamedTuple

import numpy as np

from ....core.numerics import BoolArray, FloatArray, njit
from .settings import RewardSettings


class Task(NamedTuple):
    """Constants of the reward, see `RewardSettings`, and tolerances of the goal."""

    c1: float
    r1: float
    c2: float
    r2: float
    c4: float
    least_approach: float
    receding: float
    some_out_of_range: float
    all_out_of_range: float
    pays_at_goal: bool
    attraction_without_contact: bool
    by_robot: bool
    """Whether each robot is rewarded separately."""
    tolerance: float
    """Distance from the goal that counts as reached [m]."""
    orientation_tolerance: float
    """Orientation error that still counts as reached [rad]; infinite: any."""

    @classmethod
    def of(
        cls, reward: RewardSettings, tolerance: float, orientation_tolerance: float | None
    ) -> Task:
        """Return the task of settings; without an orientation tolerance any orientation counts."""
        constants = {name: value for name, value in reward if name != "of"}
        return cls(
            **constants,
            by_robot=reward.of == "robot",
            tolerance=tolerance,
            orientation_tolerance=inf if orientation_tolerance is None else orientation_tolerance,
        )

    def reached(self, distance: float | FloatArray, orientation: float | FloatArray) -> BoolArray:
        """Return whether the goal is reached ``(m,)``; parameters as of `reward`."""
        near = np.asarray(distance) <= self.tolerance
        return near & (np.abs(orientation) <= self.orientation_tolerance)


@njit(cache=True)
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
        Constants.
    distance
        ``(m,)`` distance of the box from the goal [m].
    approach
        ``(m,)`` decrease of that distance since the last decision [m].
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
    >>> task = Task.of(RewardSettings(), tolerance=0.05, orientation_tolerance=None)
    >>> reward(task, ones, -ones, ones, none.astype(bool), none).tolist()
    [[-0.002]]
    """
    n_robots = contact.shape[1]
    size = 1 if task.by_robot else n_robots
    out = np.empty((len(distance), n_robots // size))
    for s in range(len(distance)):
        error = abs(orientation[s])
        is_reached = distance[s] <= task.tolerance and error <= task.orientation_tolerance
        nearness = task.c1 * exp(-task.r1 * distance[s])
        for party in range(out.shape[1]):
            touching = 0
            within_range = 0
            penalty = 0.0
            for r in range(party * size, (party + 1) * size):
                touching += contact[s, r]
                within_range += readings[s, r] > 0.0
                penalty += task.c2 * exp(-task.r2 * readings[s, r])
            if is_reached and task.pays_at_goal:
                out[s, party] = task.c1
            elif touching == size and approach[s] > task.least_approach:  # Condition 1
                out[s, party] = nearness - penalty - task.c4 * error
            elif touching == size:  # Condition 2
                out[s, party] = task.receding
            elif within_range == size:  # Condition 3
                attraction = nearness if task.attraction_without_contact else 0.0
                out[s, party] = attraction - penalty
            else:  # Conditions 4 and 5
                out[s, party] = task.some_out_of_range if within_range else task.all_out_of_range
    return out
