"""The normal and Student's distributions, as far as intervals and power need them.

SciPy has them all, but takes longer to import than most commands take altogether. The tests compare
these with SciPy's.

Student's t with n degrees of freedom is ``sqrt(n) tan(a)``, where the angle a has the density
``cos(a) ** (n - 1)``, but for a constant: smooth, and almost polynomial between 0 and any quantile.
"""

from __future__ import annotations

import math
from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

NODES = 64
"""Points of Gauss-Legendre quadrature: 13 digits of quantiles up to .99 are right with them."""
STEPS = 60
"""Most steps of Newton's method; it takes fewer than ten but far out in heavy tails."""
FEW = 300.0
"""Up to so many degrees of freedom the gamma function does not overflow."""
WIDEST = 10.0
"""Standard deviations of the estimated deviation beyond which nothing counts."""


def normal_cdf(x: float) -> float:
    """Return the probability that a standard normal variable is no more than x.

    >>> normal_cdf(0.0)
    0.5
    """
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


def normal_quantile(p: float) -> float:
    """Return what a standard normal variable exceeds with probability 1 - p, 0 < p < 1.

    >>> round(normal_quantile(0.975), 4)
    1.96
    """
    return NormalDist().inv_cdf(p)


def t_quantile(freedom: ArrayLike, p: float) -> Array:
    """Return the quantile of Student's t distribution for each number of degrees of freedom.

    Parameters
    ----------
    freedom
        Degrees of freedom, 1 or more, not necessarily whole; any shape.
    p
        Probability, 0.5 <= p < 1.

    Examples
    --------
    >>> [round(float(t), 3) for t in t_quantile([1, 4, 29, 1e300], 0.975)]
    [12.706, 2.776, 2.045, 1.96]
    """
    n = np.asarray(freedom, dtype=float)
    density = _at_zero(n)
    # The distribution function is concave in the angle, so that Newton's method, begun below the
    # quantile, comes ever nearer to it; the normal quantile is below that of any t.
    angle = np.arctan(normal_quantile(p) / np.sqrt(n))
    for _ in range(STEPS):
        missing = (p - 0.5) / density - _up_to(angle, n - 1.0)
        step = missing / _power_of_cosine(angle, n - 1.0)
        angle = angle + step
        if (abs(step) <= 1e-15 * angle).all():
            break
    return np.asarray(np.sqrt(n) * np.tan(angle))


def power_of_t(freedom: int, shift: float, beyond: float) -> float:
    """Return the probability that a noncentral t variable is more than `beyond` from 0.

    The variable is ``(z + shift) / s``, z standard normal, s the root of a chi square over its
    degrees of freedom. It is integrated over s.

    Parameters
    ----------
    freedom
        Degrees of freedom, 4 or more.
    shift
        The noncentrality.
    beyond
        At least 0.

    Examples
    --------
    >>> round(power_of_t(9, 0.0, 2.262), 3), round(power_of_t(9, 3.0, 2.262), 3)
    (0.05, 0.761)
    """
    nodes, weights = _quadrature()
    reach = WIDEST / math.sqrt(2.0 * freedom)
    low = max(0.0, 1.0 - reach)
    s = low + 0.5 * (1.0 + reach - low) * (1.0 + nodes)
    density = weights * np.exp((freedom - 1) * np.log(s) - 0.5 * freedom * (s**2 - 1.0))
    outside = [normal_cdf(shift - beyond * x) + normal_cdf(-shift - beyond * x) for x in s.tolist()]
    return float(density @ outside / density.sum())


def _at_zero(n: Array) -> Array:
    """Return the density of the angle at 0, ``gamma((n + 1) / 2) / (gamma(n / 2) sqrt(pi))``."""
    few = np.array([_ratio(x) for x in np.minimum(n, FEW).ravel().tolist()]).reshape(n.shape)
    # Its expansion for many degrees of freedom (Abramowitz and Stegun 1964, 6.1.47).
    x = 1.0 / np.maximum(n, FEW)
    series = 1.0 - x / 4.0 + x**2 / 32.0 + 5.0 * x**3 / 128.0 - 21.0 * x**4 / 2048.0
    series -= 399.0 * x**5 / 8192.0
    many = np.sqrt(n / 2.0) * series
    return np.where(n > FEW, many, few) / math.sqrt(math.pi)


def _ratio(n: float) -> float:
    return math.gamma(0.5 * n + 0.5) / math.gamma(0.5 * n)


def _up_to(angle: Array, m: Array) -> Array:
    """Return the integral of ``cos(a) ** m`` from 0 to an angle, by parts from that of m + 2.

    The lower power has no smooth end if m is near 0.
    """
    nodes, weights = _quadrature()
    heights = _power_of_cosine(0.5 * angle[..., None] * (1.0 + nodes), m[..., None] + 2.0)
    higher = 0.5 * angle * (heights @ weights)
    edge = np.sin(angle) * _power_of_cosine(angle, m + 1.0)
    return ((m + 2.0) * higher - edge) / (m + 1.0)


def _power_of_cosine(angle: Array, power: Array) -> Array:
    # By way of the sine, since the angle may be so small that its cosine is 1.
    return np.exp(0.5 * power * np.log1p(-(np.sin(angle) ** 2)))


@cache
def _quadrature() -> tuple[Array, Array]:
    """Return nodes and weights on [-1, 1], by eigenvalues (Golub and Welsch 1969)."""
    k = np.arange(1, NODES)
    nodes, vectors = np.linalg.eigh(np.diag(k / np.sqrt(4.0 * k**2 - 1.0), -1))
    return nodes, 2.0 * vectors[0] ** 2
