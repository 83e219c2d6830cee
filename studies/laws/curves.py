"""Curves in the logarithm of size, of which laws of growth are chosen."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...core.numerics import special
from ..results.statistics import Array


class Curve(NamedTuple):
    """A family of curves in the logarithm of size."""

    name: str
    n_parameters: int
    of: Callable[[Array, Array], Array]
    """Values for parameters ``(k,)`` at ``x`` ``(m,)``."""
    slopes: Callable[[Array, Array], Array]
    """Derivatives by the parameters ``(m, k)`` at ``x``."""
    begins: Callable[[Array, Array], list[Array]]
    """Initial parameters of a fit to values ``(m,)`` at ``x``."""
    exponents: Callable[[Array], dict[str, float]]
    """Meaning of parameters ``(k,)`` by name."""
    formula: Callable[[Array], str]
    """The curve as a formula in n."""


def _line(p: Array, x: Array) -> Array:
    return p[0] + p[1] * x


def _line_slopes(p: Array, x: Array) -> Array:
    return np.stack([np.ones_like(x), x], axis=1)


def _line_begins(x: Array, y: Array) -> list[Array]:
    b, a = np.polyfit(x, y, 1).tolist()
    return [np.array([a, b])]


def _log_others(x: Array) -> Array:
    """Return ``log(n - 1)``, minus infinity at n = 1."""
    with np.errstate(divide="ignore"):
        return np.log(np.expm1(x))


def _quadratic(p: Array, x: Array) -> Array:
    return p[0] + x + np.logaddexp(_log_others(x), p[1])


def _quadratic_slopes(p: Array, x: Array) -> Array:
    return np.stack([np.ones_like(x), special.expit(p[1] - _log_others(x))], axis=1)


def _with_floor(p: Array, x: Array) -> Array:
    return np.logaddexp(p[2], p[0] + p[1] * x)


def _floor_slopes(p: Array, x: Array) -> Array:
    share = special.expit(p[0] + p[1] * x - p[2])
    return np.stack([share, share * x, 1.0 - share], axis=1)


def _floor_begins(x: Array, y: Array) -> list[Array]:
    a, b = _line_begins(x, y)[0]
    steep = np.array([y[-1] - 2.0 * b * x[-1], 2.0 * b, y.min() - 0.1])
    return [np.array([a, b, y.min() - 3.0]), steep]


def _broken(p: Array, x: Array) -> Array:
    return p[0] + p[1] * x + p[2] * np.maximum(0.0, x - p[3])


def _broken_slopes(p: Array, x: Array) -> Array:
    beyond = np.maximum(0.0, x - p[3])
    return np.stack([np.ones_like(x), x, beyond, -p[2] * (x > p[3])], axis=1)


def _broken_begins(x: Array, y: Array) -> list[Array]:
    begins = []
    for k in x[1:-1]:
        terms = np.stack([np.ones_like(x), x, np.maximum(0.0, x - k)], axis=1)
        begins.append(np.append(np.linalg.lstsq(terms, y, rcond=None)[0], k))
    return begins


def _power_of(a: float, b: float) -> str:
    return f"{_digits(math.exp(a))} n^{_digits(round(b, 9) + 0.0)}"


def _digits(value: float) -> str:
    """Return a number with the four digits with which a prediction can be recomputed."""
    return f"{value:.4g}".replace("e+", "e")


def _plus(log_excess: float) -> str:
    """Return c with its sign, given ``log(1 + c)``."""
    c = math.exp(log_excess) - 1.0
    return f"{'-' if c < 0.0 else '+'} {_digits(abs(c))}"


def _break_formula(p: Array) -> str:
    above = _power_of(p[0] - p[2] * p[3], p[1] + p[2])
    return f"{_power_of(p[0], p[1])} up to n = {_digits(math.exp(p[3]))}, then {above}"


POWER = Curve(
    name="power law",
    n_parameters=2,
    of=_line,
    slopes=_line_slopes,
    begins=_line_begins,
    exponents=lambda p: {"exponent": float(p[1])},
    formula=lambda p: _power_of(*p.tolist()),
)
LOGISTIC = POWER._replace(name="logistic in log n")
QUADRATIC = Curve(
    name="linear to quadratic",
    n_parameters=2,
    of=_quadratic,
    slopes=_quadratic_slopes,
    begins=lambda x, y: [np.array([float((y - 2.0 * x).mean()), start]) for start in (0.0, 3.0)],
    exponents=lambda p: {"c of n (n + c)": float(np.exp(p[1]) - 1.0)},
    formula=lambda p: f"{_digits(math.exp(p[0]))} n (n {_plus(p[1])})",
)
LINEAR = Curve(
    name="linear",
    n_parameters=2,
    of=lambda p, x: _quadratic(p, x) - x,
    slopes=_quadratic_slopes,
    begins=lambda x, y: QUADRATIC.begins(x, x + y),
    exponents=lambda p: {"c of n + c": float(np.exp(p[1]) - 1.0)},
    formula=lambda p: f"{_digits(math.exp(p[0]))} (n {_plus(p[1])})",
)
FLOOR = Curve(
    name="power law with a floor",
    n_parameters=3,
    of=_with_floor,
    slopes=_floor_slopes,
    begins=_floor_begins,
    exponents=lambda p: {"exponent": float(p[1]), "floor": float(np.exp(p[2]))},
    formula=lambda p: f"{_digits(math.exp(p[2]))} + {_power_of(p[0], p[1])}",
)
BREAK = Curve(
    name="break point",
    n_parameters=4,
    of=_broken,
    slopes=_broken_slopes,
    begins=_broken_begins,
    exponents=lambda p: {
        "exponent below": float(p[1]),
        "exponent above": float(p[1] + p[2]),
        "break": float(np.exp(p[3])),
    },
    formula=_break_formula,
)
