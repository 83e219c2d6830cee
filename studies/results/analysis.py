"""What a study makes of its results: a table, words about it, and what its figures show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from .comparison import Difference
from .statistics import Estimate
from .summary import Summary

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
