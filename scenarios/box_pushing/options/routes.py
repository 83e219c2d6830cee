"""Ways of one robot around a box: where a twist leads, and how far it is to a place."""

from math import pi

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.numerics.compiling import njit
from ..world.geometry import surface


def moved(poses: FloatArray, twists: FloatArray, seconds: float) -> FloatArray:
    """Return poses ``(m, 3)`` after moving with constant body twists ``(m, 3)``."""
    turn = twists[:, 2] * seconds
    middle = poses[:, 2] + turn / 2
    chord = seconds * np.sinc(turn / (2 * pi))
    cosine, sine = np.cos(middle), np.sin(middle)
    x = poses[:, 0] + chord * (cosine * twists[:, 0] - sine * twists[:, 1])
    y = poses[:, 1] + chord * (sine * twists[:, 0] + cosine * twists[:, 1])
    return np.stack([x, y, poses[:, 2] + turn], axis=1)


@njit(cache=True)
def paths(
    poses: FloatArray,
    target: FloatArray,
    box: FloatArray,
    edges: FloatArray,
    rounding: float,
    margin: float,
    reach: float,
) -> FloatArray:
    """Return about how far ``(m,)`` it is from poses to a target, around the box.

    Straight if all of the way keeps `margin` from the box, else along a circle around it. Standing
    too close to the box is penalised.
    """
    out = np.empty(len(poses))
    cos_, sin_ = np.cos(box[2]), np.sin(box[2])
    tx, ty = target[0] - box[0], target[1] - box[1]
    ring = reach + margin + 0.01
    for i in range(len(poses)):
        x, y = poses[i, 0] - box[0], poses[i, 1] - box[1]
        here = surface(edges, rounding, cos_ * x + sin_ * y, cos_ * y - sin_ * x)[0]
        near = max(margin - here, 0.0)
        blocked = False
        for k in range(1, 9):
            px, py = x + (tx - x) * k / 8, y + (ty - y) * k / 8
            gap = surface(edges, rounding, cos_ * px + sin_ * py, cos_ * py - sin_ * px)[0]
            if gap < min(margin, here):
                blocked = True
                break
        if blocked:
            rho = np.sqrt(x * x + y * y)
            turn = np.arctan2(x * ty - y * tx, x * tx + y * ty)
            out[i] = ring * abs(turn) + abs(rho - ring) + abs(np.sqrt(tx * tx + ty * ty) - ring)
        else:
            out[i] = np.sqrt((tx - x) ** 2 + (ty - y) ** 2)
        out[i] += 20.0 * near
    return out
