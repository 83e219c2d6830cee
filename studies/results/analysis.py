"""What a study makes of its results: a table, words about it, and what its figures show."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from .comparison import Difference
from .paired_tests import LEVEL
from .power import SMALLEST, WANTED, detectable, deviation_of, seeds_for, seeds_needed
from .statistics import Estimate
from .summary import Summary, two_figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Figures: TypeAlias = "dict[str, Figure]"
"""The figures of an analysis by name."""


class Case(NamedTuple):
    """One condition of a study of systems, as its figure has it."""

    system: str
    """Name of its override: what learns and decides."""
    setting: Any
    """What else it differs in: the number of robots, the game, the exploration."""
    values: Mapping[Any, Estimate]
    """Its estimates, by title or by number of plays."""


@dataclass(frozen=True)
class Analysis:
    """The analysis of a study."""

    table: tuple[Summary, ...]
    """Its lines, one for each condition or case."""
    notes: tuple[str, ...] = ()
    """Lines that are printed below the table: legend, verdicts, power."""
    cases: Sequence[Any] = ()
    """What the study's figures are drawn from."""
    differences: Mapping[str, Sequence[Difference]] = field(default_factory=dict)
    """What was compared, by measure or by setting, p adjusted over all."""


WIDTH = 80
"""Of a line [characters]."""


NOTHING = "Nothing to compare: no two conditions share two seeds."
WORDS = ("worse", "better")
"""What a significantly lower and a higher success rate are called."""


def verdict_lines(
    differences: Sequence[Difference], words: tuple[str, str] = WORDS
) -> Iterator[str]:
    """Yield a line for every difference of one measure: the significant ones first, sorted.

    `words` are what lower and higher values are called.
    """
    for d in sorted(differences, key=lambda d: (d.p >= LEVEL, float(d.estimate.value))):
        is_higher = bool(d.estimate.value > 0)
        word = words[is_higher] if d.p < LEVEL else "no significant difference"
        text = f"  {word}: {d.condition}, {d.shown}"
        yield from wrap(text, WIDTH, subsequent_indent="    ", break_on_hyphens=False)


def verdicts(
    groups: Mapping[str, Sequence[Difference]],
    words: tuple[str, str] = WORDS,
    *,
    of_rates: bool = True,
) -> list[str]:
    """Return the verdicts of groups below their heads, how p is adjusted, and `power_lines`.

    No lines if nothing is compared. p must be adjusted over all groups.
    """
    compared = [d for group in groups.values() for d in group]
    lines = []
    for head, group in groups.items():
        if group:
            lines += wrap(f"{head}:", WIDTH, break_on_hyphens=False)
            lines += verdict_lines(group, words)
    if compared:
        counted = f"{len(compared)} comparison{'s' * (len(compared) > 1)}"
        lines.append(f"p: permutation of signs over seeds, adjusted over {counted} (Holm).")
    return lines + power_lines(compared, of_rates=of_rates)


def identity_lines(groups: Sequence[Sequence[str]]) -> list[str]:
    r"""Return lines that say which conditions are identical, see `Results.identical`.

    >>> print(*identity_lines([("chain", "star")]), sep="\n")
    Identical in every episode, by every measure:
      chain = star
    """
    head = ["Identical in every episode, by every measure:"] if groups else []
    return head + [f"  {line}" for same in groups for line in wrap(" = ".join(same), WIDTH - 2)]


def power_lines(differences: Sequence[Difference], *, of_rates: bool = True) -> list[str]:
    """Return lines on which differences the comparisons could find, and how many seeds it takes.

    Parameters
    ----------
    differences
        All that were adjusted together, of one unit.
    of_rates
        Whether they are differences of success rates, of which `SMALLEST` is of interest.
    """
    if not differences:
        return []
    seeds = min(d.seeds for d in differences)
    deviation = deviation_of([d.sample for d in differences], of_rates=of_rates)
    return power_text(seeds, len(differences), deviation, SMALLEST if of_rates else None)


def power_text(
    seeds: int, comparisons: int, deviation: float | None, smallest: float | None
) -> list[str]:
    r"""Return lines on what paired seeds can tell, given the deviation of their differences.

    Examples
    --------
    >>> print(*power_text(5, 2, 0.25, 0.2), sep="\n")
    Power: 5 seeds and 2 comparisons cannot give an adjusted p below .05, whatever
      the outcome. It needs at least 7 seeds; for a difference of .20, about 18.
    >>> print(*power_text(20, 1, 0.25, 0.2), sep="\n")
    Power: with 20 seeds, a difference of .17 is found with probability .80. For a
      difference of .20 it takes about 15 seeds.
    """
    counted = f"{seeds} seed{'s' * (seeds != 1)}"
    among = f" and {comparisons} comparisons" if comparisons > 1 else ""
    needed = seeds_needed(comparisons)
    wanted = None
    if smallest is not None and deviation is not None:
        wanted = seeds_for(smallest, deviation, comparisons)
    if seeds < needed:
        text = (
            f"{counted}{among} cannot give an adjusted p below .05, whatever the outcome. "
            f"It needs at least {needed} seeds"
        )
        if smallest is not None and wanted is not None:
            text += f"; for a difference of {two_figures(smallest)}, about {wanted}"
        text += "."
    elif deviation is None:
        text = f"{counted}{among} that deviate by nothing: how small a difference they would find "
        text += "cannot be determined."
    else:
        least = two_figures(detectable(deviation, seeds, comparisons))
        text = f"with {counted}{among}, a difference of {least} is found with probability "
        text += f"{two_figures(WANTED)}."
        if smallest is not None and wanted is not None:
            text += f" For a difference of {two_figures(smallest)} it takes about {wanted} seeds."
    return wrap(f"Power: {text}", WIDTH, subsequent_indent="  ", break_on_hyphens=False)
