"""Numbers and estimates as text: the one notation of intervals, ``.82 [.55, .95]``."""

import re
from collections.abc import Callable
from textwrap import wrap

import numpy as np

from ..errors import WIDTH
from .statistics import Estimate

MANY = 1e6
"""From here on a number in a table has a power of ten."""


def two_figures(value: float) -> str:
    """Return a number in two figures and at most two decimals, without a leading zero.

    From a million on it has a power of ten.

    Examples
    --------
    >>> [two_figures(x) for x in (0.975, 0.998, -0.0312, 0.0021, 12.34, 240.0, 2.7e11)]
    ['.97', '1.0', '-.03', '0', '12', '240', '2.7e11']
    """
    if np.isnan(value):
        return "?"
    if abs(value) < 0.005:
        return "0"
    value = float(f"{value:.2g}")
    if abs(value) >= MANY:
        mantissa, power = f"{value:.1e}".split("e")
        return f"{mantissa}e{int(power)}"
    digits = min(2, max(0, 1 - int(np.floor(np.log10(abs(value))))))
    return _without_zero(f"{value:.{digits}f}")


def two_decimals(value: float) -> str:
    """Return a ratio in two decimals, as 1.04 and .96 lie on two sides of 1.

    Examples
    --------
    >>> [two_decimals(x) for x in (0.961, 1.04, -0.05, 0.0)]
    ['.96', '1.04', '-.05', '0']
    """
    return "0" if abs(value) < 0.005 else _without_zero(f"{value:.2f}")


def signed(value: float) -> str:
    """Return a difference in two decimals and with its sign.

    Examples
    --------
    >>> [signed(x) for x in (0.5, -1.25, 1e-9)]
    ['+.50', '-1.25', '0']
    """
    return f"{'+' * (value >= 0.005)}{two_decimals(value)}"


def bracketed(estimate: Estimate, form: Callable[[float], str] = two_figures) -> str:
    """Return an estimate with its interval, if that is known.

    Examples
    --------
    >>> bracketed(Estimate(*map(np.asarray, (0.82, 0.55, 0.95))))
    '.82 [.55, .95]'
    """
    value, low, high = (form(float(part)) for part in estimate)
    return value if np.isnan(estimate.low) else f"{value} [{low}, {high}]"


WHOLE = re.compile(r"[-+]?[.\d]\S* \[[^]]*\]|\w+ [=<] \S+|\d+ seeds?|last \d+")
"""What stands in one line: an estimate and its interval, ``p = .03``, a count of seeds."""


def whole(text: str) -> str:
    """Return text with no-break spaces in what stands in one line."""
    return WHOLE.sub(lambda part: part[0].replace(" ", "\N{NO-BREAK SPACE}"), text)


def wrapped(text: str, indent: str = "") -> list[str]:
    """Return text in lines that fit a terminal, of which none ends within a number.

    Examples
    --------
    >>> wrapped(f"{'w' * 70} .82 [.55, .95]")[1]
    '  .82 [.55, .95]'
    """
    lines = wrap(
        whole(text),
        WIDTH,
        initial_indent=indent,
        subsequent_indent=f"{indent}  ",
        break_on_hyphens=False,
    )
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines]


def _without_zero(text: str) -> str:
    return text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text
