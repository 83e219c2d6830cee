"""Kinematics of a planar chain of links, and what its joints see of the goal; compiled.

A posture is an array ``(n,)`` of joint angles [rad], each counted from the direction of the link
before; the first one from the x axis. Joint i stands where link i begins, so that joint 0 is the
base at the origin. The *tip* is the end of the last link.
"""

import numpy as np

from ...core.numerics.arrays import FloatArray
from ...core.numerics.compiling import njit


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
