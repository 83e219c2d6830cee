"""Numbers, intervals and p-values as text, for the terminal, pages, figures and LaTeX.

Every number that a reader sees is rounded here: ``0.82 [0.55, 0.95]``, ``95%``, ``p = 0.004``.
"""

import math
import re
from collections.abc import Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_UP, Decimal
from textwrap import wrap

from ..errors import WIDTH
from .statistics import Estimate, LowerBound

P_ADJUSTED, P_RAW = "p", "p unadjusted"
"""Headings of columns of p-values."""
MAX_DECIMALS = 2
MIN_SCIENTIFIC = 1e6
"""Magnitude from which on a number is shown with a power of ten."""
SMALL, NEGLIGIBLE = 0.005, 1e-7
"""Magnitudes between which a number, or the largest part of an estimate, has a power of ten, too:
two decimals would show none of its digits."""
MIN_LARGEST = 1e-6
"""Smallest magnitude of the largest value of a measure. What is below may be a rounding error."""
SIGNIFICANT, EXACT_DECIMALS = 12, 9
"""Digits that are not rounding errors: values that differ beyond them are shown alike."""


def format_number(value: float, *, signed: bool = False) -> str:
    """Return a number in two significant figures, but all digits before the decimal point.

    It has at most two decimals, and a power of ten from a million on and below 0.005.

    Parameters
    ----------
    value
        The number.
    signed
        Whether a positive number has a plus sign, as differences do.

    Examples
    --------
    >>> [format_number(x) for x in (0.975, 0.998, -0.0312, 0.0021, 12.34, 340, 2.7e11)]
    ['0.98', '1.00', '-0.03', '2.1e-3', '12', '340', '2.7e11']
    >>> format_number(0.5, signed=True), format_number(12345.0)
    ('+0.50', '12345')
    """
    return _fixed(value, _decimals(value), signed=signed)


def format_estimate(estimate: Estimate, *, signed: bool = False) -> str:
    """Return an estimate with its interval, if that is known.

    There are as many decimals, at most two, as give both the value and the width of the interval
    two significant figures. Bounds are rounded outward, so the interval shown contains the exact
    one. A lower bound has no interval.

    Examples
    --------
    >>> format_estimate(LowerBound(8.0, 5.4, math.inf))
    '>= 8'
    >>> format_estimate(Estimate(0.82, 0.551, 0.949))
    '0.82 [0.55, 0.95]'
    >>> format_estimate(Estimate(97.6, 78.2, 113.7)), format_estimate(Estimate(1.04, 0.96, 1.131))
    ('98 [78, 114]', '1.04 [0.96, 1.14]')
    """
    value, low, high = map(float, estimate)
    if isinstance(estimate, LowerBound):
        return f">= {format_number(value)}"
    if math.isnan(low):
        return format_number(value, signed=signed)
    decimals = _decimals(value, low, high)
    shown = _fixed(value, decimals, signed=signed)
    least = _fixed(low, decimals, ROUND_FLOOR, signed=signed)
    return f"{shown} [{least}, {_fixed(high, decimals, ROUND_CEILING, signed=signed)}]"


def format_p(p: float) -> str:
    """Return a p-value with the sign before it: three decimals below 0.1, two from there on.

    Examples
    --------
    >>> [format_p(p) for p in (0.00049, 0.0044, 0.0496, 0.35)]
    ['< 0.001', '= 0.004', '= 0.050', '= 0.35']
    """
    return "< 0.001" if p < 0.001 else f"= {p:.{3 if p < 0.1 else 2}f}"


def _decimals(value: float, low: float = math.nan, high: float = math.nan) -> int | None:
    """Return how many decimals give a value and the width of its interval two figures, at most 2.

    They are 0 if all are whole, and None if all have a power of ten because they are small.
    """
    known = [part for part in (value, low, high) if math.isfinite(part)]
    if NEGLIGIBLE <= max(map(abs, known), default=0.0) < SMALL:
        return None
    if all(part == int(part) for part in known):
        return 0
    sizes = [size for size in (abs(value), high - low) if math.isfinite(size) and size > 0.0]
    smallest = min(sizes, default=0.1)
    return min(MAX_DECIMALS, max(0, 1 - math.floor(math.log10(smallest))))


def _fixed(
    value: float, decimals: int | None, rounding: str = ROUND_HALF_UP, *, signed: bool
) -> str:
    """Return a number with so many decimals, or with a power of ten; zero has neither."""
    if not math.isfinite(value):
        return "?" if math.isnan(value) else f"{value:+}" if signed else f"{value}"
    exact = Decimal(f"{round(value, EXACT_DECIMALS):.{SIGNIFICANT}g}")
    if abs(value) >= MIN_SCIENTIFIC:
        decimals = None
    places = 1 - exact.adjusted() if decimals is None else decimals
    rounded = exact.quantize(Decimal(1).scaleb(-places), rounding)
    if rounded == 0:
        return "0"
    sign = "+" if signed else "-"
    if decimals is not None:
        return f"{rounded:{sign}f}"
    mantissa, power = f"{rounded:{sign}.1e}".split("e")
    return f"{mantissa}e{int(power)}"


WHOLE = re.compile(r"[-+]?\d\S* \[[^]]*\]|\(\S+ unadjusted\)|(\w+ [=<]|>=) \S+|\d+ seeds?|last \d+")
"""Text that is not broken: an estimate with its interval, ``p = 0.03``, a count of seeds."""


def whole(text: str) -> str:
    """Return text with no-break spaces within numbers, see `WHOLE`."""
    return WHOLE.sub(lambda part: part[0].replace(" ", "\N{NO-BREAK SPACE}"), text)


def listed(text: str, names: Iterable[str]) -> list[str]:
    """Return a remark that ends with names, in lines; no line without names."""
    joined = "; ".join(names)
    return wrapped(f"{text}: {joined}.") if joined else []


def wrapped(text: str, indent: str = "") -> list[str]:
    """Return text in lines that fit a terminal, of which none ends within a number.

    Examples
    --------
    >>> wrapped(f"{'w' * 70} 0.82 [0.55, 0.95]")[1]
    '  0.82 [0.55, 0.95]'
    """
    lines = wrap(
        whole(text),
        WIDTH,
        initial_indent=indent,
        subsequent_indent=f"{indent}  ",
        break_on_hyphens=False,
    )
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]
