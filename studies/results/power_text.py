"""Lines on the power of comparisons, for terminals and reports."""

import math
from collections.abc import Sequence
from textwrap import wrap

from ...core.interface.measures import SUCCESS, Measure
from ..errors import WIDTH
from .notation import format_number, wrapped
from .permutation_tests import LEVEL
from .power import (
    SMALLEST,
    WANTED,
    detectable,
    detectable_independent,
    deviation_of,
    seeds_for,
    seeds_needed,
)
from .recovery import is_over_episodes
from .statistics import Array

AT_POWER = f" with power {format_number(WANTED)}"
"""End of a sentence on a difference that is detected."""


def power_text(
    seeds: int,
    comparisons: int,
    deviation: float | None,
    smallest: float | None,
    measure: str = "",
    unit: str = "",
    most: float = math.inf,
) -> list[str]:
    r"""Return lines on what paired seeds can tell, given the deviation of their differences.

    Parameters
    ----------
    seeds, comparisons
        How many.
    deviation
        Standard deviation of the differences of single seeds; None: it is not known.
    smallest
        The smallest difference that is of interest; None: none is named.
    measure
        By what conditions are compared.
    unit
        Of differences, to be read after a number.
    most
        The greatest possible difference.

    Examples
    --------
    >>> print(*power_text(5, 2, 0.25, 0.2), sep="\n")
    Power: 5 seeds cannot give a p below 0.05 (p adjusted over 2 comparisons),
      whatever the outcome. At least 7 seeds are needed; a difference of 0.20 needs
      about 18.
    >>> print(*power_text(20, 1, 0.25, 0.2, "evaluation success"), sep="\n")
    Power: 20 seeds detect a difference of 0.17 in evaluation success with power
      0.80. A difference of 0.20 needs about 15 seeds.
    """
    counted = f"{seeds} seed{'s' * (seeds != 1)}"
    detect = f"{counted} detect{'s' * (seeds == 1)}"
    adjusted = f" (p adjusted over {comparisons} comparisons)" if comparisons > 1 else ""
    needed = seeds_needed(comparisons)
    enough = seeds_for(smallest, deviation, comparisons) if smallest and deviation else None
    goal = format_number(smallest or 0.0)
    within = f" in {measure}" if measure else ""
    if seeds < needed:
        text = (
            f"{counted} cannot give a p below {LEVEL:g}{within}{adjusted}, whatever the "
            f"outcome. At least {needed} seeds are needed"
        )
        text += f"; a difference of {goal} needs about {enough}." if enough else "."
    elif deviation is None:
        text = (
            f"unknown{within}, because all seeds have the same difference. A further seed may "
            "deviate from them; more seeds show by how much."
        )
    else:
        least = detectable(deviation, seeds, comparisons)
        text = f"{detect} {_difference(least, most, unit)}{within}{AT_POWER}{adjusted}."
        if enough and goal != format_number(least):
            text += f" A difference of {goal} needs about {enough} seeds."
    return wrapped(f"Power: {text}")


def _difference(least: float, most: float, unit: str = "") -> str:
    """Return the difference that is detected, unless the greatest possible one is smaller."""
    return f"a difference of {format_number(least)}{unit}" if least < most else "no difference"


def planned_text(
    seeds: int,
    comparisons: int,
    deviation: float | None,
    smallest: float | None,
    *,
    of_rates: bool,
) -> list[str]:
    """Return lines on what paired seeds can tell before any have run, and of what it is.

    Parameters are those of `power_text`; a deviation that is not known is the unit. `of_rates`:
    whether success rates are compared, or returns.
    """
    unit = "" if deviation else " standard deviations"
    what = "success rates" if of_rates else "returns, as nothing is a success"
    supposed = (
        f"differences of single seeds are taken to deviate by {deviation:g}"
        if deviation
        else "how much those of single seeds deviate is not known before (--deviation)"
    )
    text = f"Differences of {what}, as the study compares conditions, p adjusted; "
    text += f"{supposed}."
    most = 1.0 if of_rates else math.inf
    known = power_text(seeds, comparisons, deviation or 1.0, smallest, unit=unit, most=most)
    return [*known, *wrap(text, WIDTH)]


def power_lines(
    samples: Sequence[Array], comparisons: int, measure: Measure = SUCCESS, title: str = ""
) -> list[str]:
    """Return lines on which differences comparisons could find, and how many seeds it takes.

    Parameters
    ----------
    samples
        Differences of single seeds ``(n_seeds,)``, by comparison, of one unit.
    comparisons
        Number of comparisons over which p is adjusted.
    measure
        Measure that is compared. For success rates, `SMALLEST` is of interest.
    title
        Its title in the lines.
    """
    if not samples:
        return []
    of_rates = is_over_episodes(measure)
    deviation = deviation_of(samples, of_rates=of_rates)
    smallest = SMALLEST if of_rates else None
    seeds = min(map(len, samples))
    return power_text(seeds, comparisons, deviation, smallest, title, most=_greatest(measure))


def _greatest(measure: Measure) -> float:
    """Return the greatest possible difference of a measure."""
    low, high = measure.bounds
    return high - low


def independent_power_lines(
    groups: Sequence[tuple[Array, Array]], comparisons: int, measure: Measure, title: str = ""
) -> list[str]:
    """Return lines on which difference independent runs detect.

    Parameters
    ----------
    groups
        Values of the runs of both conditions, by comparison.
    comparisons
        Number of comparisons over which p is adjusted.
    measure
        Measure that is compared.
    title
        Title of the measure in the lines.
    """
    if not groups:
        return []
    deviation = deviation_of([own for pair in groups for own in pair], of_rates=False)
    counts = min(((len(own), len(base)) for own, base in groups), key=sorted)
    counted = f"{counts[0]} and {counts[1]} independent runs"
    adjusted = f" (p adjusted over {comparisons} comparisons)" if comparisons > 1 else ""
    within = f" in {title}" if title else ""
    least = detectable_independent(deviation or 1.0, counts, comparisons)
    if math.isinf(least):
        text = f"{counted} cannot give a p below {LEVEL:g}{within}{adjusted}."
    elif deviation is None:
        text = f"unknown{within}, because the runs of each condition are all equal."
    else:
        difference = _difference(least, _greatest(measure))
        text = f"{counted} detect {difference}{within}{AT_POWER}{adjusted}."
    return wrapped(f"Power: {text}")
