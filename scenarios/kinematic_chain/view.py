"""What state variables are computed from: postures of the arm and the goal, many at once.

The kinematics of a planar chain of links are compiled.

A posture is an array ``(n,)`` of joint angles [rad], each counted from the direction of the link
before; the first one from the x axis. Joint i stands where link i begins, so that joint 0 is the
base at the origin. The *tip* is the end of the last link.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.numerics.arrays import FloatArray
from ...core.numerics.compiling import njit
from ..state_variables import fixed


@dataclass(frozen=True)
class ChainView:
    """Situations to be described, ``m`` at once."""

    places: FloatArray
    """``(m, n + 1, 2)`` the joints from the base on, and the tip [m]."""
    angles: FloatArray
    """``(m, n)`` joint angles [rad]."""
    speeds: FloatArray
    """``(m, n)`` commanded speeds of the joints, as fractions of the greatest."""
    goal: FloatArray
    """``(2,)`` where the tip is to be [m]."""
    before: float
    """Distance of the tip from the goal before the decision that led here [m]."""

    @property
    def n_situations(self) -> int:
        """How many situations there are."""
        return len(self.places)

    @property
    def tip(self) -> FloatArray:
        """The tip ``(m, 2)`` [m]."""
        return self.places[:, -1]

    @cached_property
    def distance(self) -> FloatArray:
        """Distance ``(m,)`` of the tip from the goal [m]."""
        return fixed(np.hypot(*(self.goal - self.tip).T))

    @property
    def approach(self) -> FloatArray:
        """How much nearer ``(m,)`` the tip has come to the goal in the decision [m]."""
        return self.before - self.distance


@njit(cache=True)
def ends_of(angles, length):  # type: ignore[no-untyped-def]
    """Return all joints and the tip ``(n + 1, 2)`` of a posture ``(n,)``, links of `length`."""
    n = len(angles)
    places = np.zeros((n + 1, 2))
    heading = 0.0
    for i in range(n):
        heading += angles[i]
        places[i + 1, 0] = places[i, 0] + length * np.cos(heading)
        places[i + 1, 1] = places[i, 1] + length * np.sin(heading)
    return places


@njit(cache=True)
def postures_of(angles, length):  # type: ignore[no-untyped-def]
    """Return the joints and tips ``(m, n + 1, 2)`` of postures ``(m, n)``."""
    places = np.empty((len(angles), angles.shape[1] + 1, 2))
    for k in range(len(angles)):
        places[k] = ends_of(angles[k], length)
    return places


def jacobian_of(places: FloatArray) -> FloatArray:
    """Return how the tip moves ``(n, 2)`` as each joint turns, given `ends_of` a posture [m/rad].

    A joint turns all that is behind it: the tip moves at right angles to the line from the joint.
    """
    x, y = (places[-1] - places[:-1]).T
    return np.stack([-y, x], axis=1)
