"""Team sizes of conditions, and the words for them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from ..spec.tables import SpecTable
from .results import Results

UNKNOWN = "agent groups"
"""Name of the bodies if their number is not swept."""


def with_name(number: float, plural: str) -> str:
    """Return a number of bodies.

    >>> with_name(1, "robots"), with_name(8.0, "robots")
    ('1 robot', '8 robots')
    """
    return f"{number:g} {plural.removesuffix('s') if number == 1 else plural}"


class Sizes(NamedTuple):
    """Numbers of bodies.

    Examples
    --------
    >>> joints = Sizes({"2": 2, "8": 8}, ("scenario.joints",))
    >>> joints.shown(1), joints.shown(8), Sizes({"chain": 3, "star": 5}).shown(3)
    ('1 joint', '8 joints', '3 agent groups')
    >>> Sizes({"chain": 3, "star": 3}).shown(3)
    ''
    """

    counts: Mapping[str, int]
    """Number by condition."""
    keys: Sequence[str] = ()
    """Swept keys that are this number, whatever the scenario calls it."""

    @classmethod
    def of(cls, results: Results, conditions: Iterable[str]) -> Sizes:
        """Return the sizes of conditions from the counts of their trials."""
        counts = {c: int(results.numbers(c)["robots"][0]) for c in conditions}
        return cls.counted(counts, results.columns)

    @classmethod
    def counted(cls, counts: Mapping[str, int], columns: Mapping[str, SpecTable]) -> Sizes:
        """Return the sizes of conditions from their counts and swept keys."""
        swept = {c: columns.get(c, {}) for c in counts}
        keys = dict.fromkeys(key for row in swept.values() for key in row)
        own = (k for k in keys if all(str(swept[c].get(k)) == str(n) for c, n in counts.items()))
        return cls(counts, tuple(own))

    @property
    def word(self) -> str:
        """Name of the bodies in the plural."""
        names = (k.removeprefix("scenario.") for k in self.keys if k.startswith("scenario."))
        return next(names, UNKNOWN)

    def shown(self, number: int) -> str:
        """Return a number with its name; nothing if it is the same everywhere and not swept."""
        if not self.keys and len(set(self.counts.values())) == 1:
            return ""
        return with_name(number, self.word)
