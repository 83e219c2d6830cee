"""Direction of a vector, for kernels that loop over many situations."""

from math import pi

from ..core.numerics import njit


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
