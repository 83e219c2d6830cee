"""Directions and rotations in the plane, for kernels that loop over many situations."""

from math import pi

import numpy as np

from ..core.numerics import njit


@njit(cache=True, forceinline=True, fastmath={"contract", "nsz"})
def rotate(cos: float, sin: float, x: float, y: float) -> tuple[float, float]:
    """Return a vector that is turned by the angle with this cosine and sine.

    With ``-sin`` a vector in world coordinates is expressed in the frame of a body.
    """
    return cos * x - sin * y, sin * x + cos * y


@njit(cache=True, forceinline=True, fastmath={"contract", "nsz"})
def angle_of(x: float, y: float) -> float:
    """Return ``arctan2(y, x)``, without branches and to its last bits.

    The angle with the nearer axis or diagonal is below pi / 8. There the rational function of
    Moshier's Cephes library holds.
    """
    ax, ay = abs(x), abs(y)
    low, high = min(ax, ay), max(ax, ay)
    diagonal = low > 0.41421356237309503 * high
    top = low - high if diagonal else low
    bottom = low + high if diagonal else high
    t = top / (bottom if bottom > 0.0 else 1.0)
    z = t * t
    p = -8.750608600031904122785e-1
    p = p * z - 1.615753718733365076637e1
    p = p * z - 7.500855792314704667340e1
    p = p * z - 1.228866684490136173410e2
    p = p * z - 6.485021904942025371773e1
    q = z + 2.485846490142306297962e1
    q = q * z + 1.650270098316988542046e2
    q = q * z + 4.328810604912902668951e2
    q = q * z + 4.853903996359136964868e2
    q = q * z + 1.945506571482613964425e2
    angle = t + t * (z * p / q)
    angle = 0.25 * pi + angle if diagonal else angle
    angle = 0.5 * pi - angle if ay > ax else angle
    angle = pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@njit(cache=True, forceinline=True, fastmath={"contract", "nsz"})
def cos_sin(angle: float) -> tuple[float, float]:
    """Return cosine and sine, without branches and to the last bit but one.

    The angle is reduced to an eighth of a turn on either side of a quarter, in two steps for
    accuracy. There the polynomials of Sun's fdlibm hold.
    """
    quarters = np.floor(angle * 0.6366197723675814 + 0.5)
    r = angle - quarters * 1.57079632673412561417 - quarters * 6.07710050650619224932e-11
    z = r * r
    s = 1.58969099521155010221e-10
    s = -2.50507602534068634195e-08 + z * s
    s = 2.75573137070700676789e-06 + z * s
    s = -1.98412698298579493134e-04 + z * s
    s = 8.33333333332248946124e-03 + z * s
    s = -1.66666666666666324348e-01 + z * s
    s = r + r * z * s
    c = -1.13596475577881948265e-11
    c = 2.08757232129817482790e-09 + z * c
    c = -2.75573143513906633035e-07 + z * c
    c = 2.48015872894767294178e-05 + z * c
    c = -1.38888888888741095749e-03 + z * c
    c = 4.16666666666666019037e-02 + z * c
    c = 1.0 - 0.5 * z + z * z * c
    quarter = quarters - 4.0 * np.floor(0.25 * quarters)
    odd = quarter == 1.0 or quarter == 3.0
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if quarter >= 2.0 else sine
    cosine = -cosine if quarter == 1.0 or quarter == 2.0 else cosine
    return cosine, sine
