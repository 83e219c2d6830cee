"""What the push predictor believes of the constants of a push, and of others near them.

A push is quasi-static: with all forces multiplied by one factor, so that servos, grip and ground
friction are as many times as strong, every body moves as before. Not the three forces can be found
out by moving, only two ratios of them, and the friction at the contact (`CONSTANTS`). They are
factors of what was believed at first, in logarithms.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from ....core.numerics import FloatArray, njit
from ..world.bodies import resistance
from ..world.settings import RobotSettings
from .push import PushModel, pushed

CONSTANTS = ("load per stiffness", "load per grip", "contact friction")
"""The ground friction of the box over the stiffness of the wheels' servos, and over that of their
grip sideways; the coefficient of friction between robots and box."""


APART = 0.003
"""Gap between robots [m] below which they may push each other: the push predictor lets them pass
through one another, so that nothing is to be learned from it then."""


class PushBelief(NamedTuple):
    """Push models by constants."""

    model: PushModel
    """The model where all constants are 0: as believed at first."""
    ahead: FloatArray
    """``(M, 3, 3)`` what the servos add to the wrench per twist with which robots resist."""
    sideways: FloatArray
    """``(M, 3, 3)`` what the grip adds to it."""

    @classmethod
    def of(cls, model: PushModel, robots: Sequence[RobotSettings], stiffness: float) -> PushBelief:
        """Return what is believed of robots whose wheels are taken to be so much stiffer."""
        parts = [
            stiffness * np.stack([resistance(robot, *part) for robot in robots])
            for part in ((1.0, 0.0), (0.0, 1.0))
        ]
        return cls(model, *parts)


@njit(cache=True)
def believing(belief, constants):  # type: ignore[no-untyped-def]
    """Return the `PushModel` of constants ``(3,)``."""
    model, factors = belief.model, np.exp(constants)
    compliance = np.empty_like(belief.ahead)
    for r in range(len(compliance)):
        resists = belief.ahead[r] / factors[0] + belief.sideways[r] / factors[1]
        compliance[r] = np.linalg.inv(resists)
    return PushModel(
        model.edges, model.rounding, model.reach, model.radii, compliance,
        model.friction_force, model.friction_radius, model.contact_friction * factors[2],
    )  # fmt: skip


@njit(cache=True)
def outcomes(  # type: ignore[no-untyped-def]
    robots: FloatArray, box: FloatArray, twists: FloatArray, seconds: float, belief,
    constants: FloatArray,
):  # fmt: skip
    """Predict one push under several constants.

    Parameters
    ----------
    robots, box
        ``(M, 3)`` and ``(3,)`` present poses.
    twists
        ``(M, 3)`` twists that the robots are asked for.
    seconds
        How long the push lasts [s].
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
    asked, choices = np.expand_dims(twists, 1), np.zeros((1, n), np.int64)
    for p in range(len(constants)):
        model = believing(belief, constants[p])
        after, boxes, _ = pushed(robots, box, asked, choices, seconds, model)
        _twist(box, boxes[:, 0], seconds, moved[p, 0])
        for r in range(n):
            _twist(robots[r], after[r, :, 0], seconds, moved[p, r + 1])
    return moved


@njit(cache=True)
def _twist(before, after, seconds, out) -> None:  # type: ignore[no-untyped-def]
    """Write the constant twist between two poses, as `prediction.mean_twists` does.

    The last bits of the two differ (a sine here, a sinc there), and published rows of calibration
    hang on both; a test compares them.
    """
    half = 0.5 * (after[2] - before[2])
    # The chord of an arc is shorter than the arc by the sinc of half its angle.
    clipped = min(max(half, -0.5 * pi), 0.5 * pi)
    longer = clipped / np.sin(clipped) if abs(clipped) > 1e-9 else 1.0
    cos, sin = np.cos(before[2] + half), np.sin(before[2] + half)
    x, y = (after[0] - before[0]) * longer, (after[1] - before[1]) * longer
    out[0], out[1], out[2] = (cos * x + sin * y), (cos * y - sin * x), 2.0 * half
    out /= seconds


@njit(cache=True)
def least_gap(robots: FloatArray, radius: float) -> float:
    """Return the least gap [m] between robots ``(M, 3)`` of one radius; infinite for one robot."""
    least = np.inf
    for r in range(len(robots)):
        for other in range(r):
            dx, dy = robots[r, 0] - robots[other, 0], robots[r, 1] - robots[other, 1]
            least = min(least, np.hypot(dx, dy) - 2.0 * radius)
    return least
