"""Constants of the push predictor that a team can calibrate.

With all forces multiplied by one factor, so that servos, grip and ground friction are equally
stronger, every body moves as before. Therefore motions determine only two ratios of the three
forces, and the friction at the contact (`CONSTANTS`). Constants are logarithms of factors on their
nominal values.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, njit
from ..world.robots import resistance
from ..world.settings import RobotSettings
from .models import PushModel
from .push import push
from .twists import mean_twists, twist_between

CONSTANTS = ("load per stiffness", "load per grip", "contact friction")
"""The ground friction of the box over the stiffness of the wheels' servos, and over that of their
grip sideways; the coefficient of friction between robots and box."""
APART = 0.003
"""Gap between robots [m] below which they may push each other, which the predictor ignores: such a
step teaches nothing about the box."""


class PushBelief(NamedTuple):
    """Push models by constants."""

    model: PushModel
    """Model with all constants at 0."""
    ahead: FloatArray
    """``(M, 3, 3)`` part of the servos in the wrench per twist with which robots resist."""
    sideways: FloatArray
    """``(M, 3, 3)`` part of the grip sideways."""

    @classmethod
    def of(cls, model: PushModel, robots: Sequence[RobotSettings], stiffness: float) -> PushBelief:
        """Return the belief about robots, with an assumed factor on their stiffness."""
        parts = [
            stiffness * np.stack([resistance(robot, *part) for robot in robots])
            for part in ((1.0, 0.0), (0.0, 1.0))
        ]
        return cls(model, *parts)


@njit(cache=True)
def model_of(belief: PushBelief, constants: FloatArray) -> PushModel:
    """Return the `PushModel` of constants ``(3,)``."""
    model, factors = belief.model, np.exp(constants)
    compliance = np.empty_like(belief.ahead)
    for r in range(len(compliance)):
        resists = belief.ahead[r] / factors[0] + belief.sideways[r] / factors[1]
        inverse = np.linalg.inv(resists)
        for i in range(3):
            for j in range(3):
                compliance[r, i, j] = inverse[i, j]
    friction = model.contact_friction * factors[2]
    return PushModel(
        model.shape, model.radii, compliance, model.friction_force, friction, model.learned
    )


@njit(cache=True)
def outcomes(
    robots: FloatArray,
    box: FloatArray,
    twists: FloatArray,
    seconds: float,
    belief: PushBelief,
    constants: FloatArray,
) -> FloatArray:
    """Predict one push under several constants.

    Parameters
    ----------
    robots, box
        ``(M, 3)`` and ``(3,)`` present poses.
    twists
        ``(M, 3)`` commanded twists of the robots.
    seconds
        Duration of the push [s].
    belief
        `PushBelief`.
    constants
        ``(k, 3)``.

    Returns
    -------
    FloatArray
        ``(k, M + 1, 3)`` mean twists of the box, and then of the robots, each in its own frame.
    """
    n = len(robots)
    moved = np.empty((len(constants), n + 1, 3))
    commanded, choices = np.expand_dims(twists, 1), np.zeros((n, 1), np.int64)
    for p in range(len(constants)):
        model = model_of(belief, constants[p])
        after, boxes, _ = push(robots, box, commanded, choices, seconds, model)
        twist_between(box, boxes[:, 0], seconds, moved[p, 0])
        for r in range(n):
            twist_between(robots[r], after[r, :, 0], seconds, moved[p, r + 1])
    return moved


def min_gap(robots: FloatArray, radius: float) -> float:
    """Return the smallest gap [m] between robots ``(M, 3)``; infinite for one robot."""
    i, j = np.triu_indices(len(robots), 1)
    apart = np.hypot(robots[i, 0] - robots[j, 0], robots[i, 1] - robots[j, 1])
    return float(apart.min(initial=np.inf)) - 2.0 * radius


def measured_twists(
    before: FloatArray, after: FloatArray, seconds: float, radius: float
) -> FloatArray:
    """Return the mean twists between poses ``(M + 1, 3)``, the box's standing first.

    If two robots were close, the twist of the box is left out: they may have pushed each other.
    """
    twists = mean_twists(before, after, seconds)
    close = min(min_gap(before[1:], radius), min_gap(after[1:], radius)) <= APART
    return twists[1:] if close else twists
