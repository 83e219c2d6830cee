"""The reward of box pushing (Section VI, Eq. 15-17).

The paper's five conditions overlap: two robots in contact are also within range, and if no robot
is within range then some robot is not. They are tested from the most specific to the least:
C1 and C2 (all in contact), C3 (all within range), C5 (none), C4 (some not). The paper has one
penalty term per robot, R2 and R3 for its two; here every robot has one, with the same constants.
"""

from __future__ import annotations

import numpy as np

from ..core.arrays import BoolArray, FloatArray
from .config import RewardSettings


def reward(
    settings: RewardSettings,
    distance: FloatArray,
    approach: FloatArray,
    orientation: FloatArray,
    contact: BoolArray,
    readings: FloatArray,
) -> FloatArray:
    """Return the reward ``(m,)`` of ``m`` situations.

    Parameters
    ----------
    settings
        The constants.
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
    >>> reward(RewardSettings(), ones, ones, ones, none.astype(bool), none).tolist()
    [-0.002]
    """
    r1 = settings.c1 * np.exp(-settings.r1 * distance)
    r2_r3 = (settings.c2 * np.exp(-settings.r2 * readings)).sum(axis=1)
    r4 = settings.c4 * np.abs(orientation)
    touching = contact.all(axis=1)
    within = readings > 0.0
    near = -r2_r3 + (r1 if settings.attraction_without_contact else 0.0)
    nearer = approach < -settings.least_approach
    return np.select(
        [touching & nearer, touching, within.all(axis=1), ~within.any(axis=1)],
        [r1 - r2_r3 - r4, np.full_like(r1, settings.receding), near, settings.all_out_of_range],
        default=settings.some_out_of_range,
    )
