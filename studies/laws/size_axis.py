"""The swept key that is the size of a team, and the size of each condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core.plugins.words import show
from ..errors import SpecError
from ..results.results import Results
from ..results.score_tables import NUMBER
from ..results.sizes import Sizes
from ..spec.tables import key_named, label_but

MAX_SIZE = 1_000_000_000
"""Maximum size that is fitted or predicted."""
Columns = Mapping[str, Mapping[str, object]]
"""Swept keys by condition."""


class SizeAxis(NamedTuple):
    """The swept key that is the size, with the group and the size of each condition.

    Examples
    --------
    >>> columns = {"2, chain": {"scenario.robots": 2, "topology": "chain"},
    ...            "4, chain": {"scenario.robots": "4", "topology": "chain"}}
    >>> axis = SizeAxis.by("scenario.robots", columns)
    >>> axis.name, axis.places["4, chain"]
    ('robots', ('chain', 4.0))
    """

    key: str
    places: Mapping[str, tuple[str, float]]
    """Label of the settings besides the size, empty if there are none, and size by condition."""

    @property
    def name(self) -> str:
        """Last part of the key."""
        return self.key.rpartition(".")[2]

    def groups(self) -> dict[str, dict[str, float]]:
        """Return the sizes of conditions by group, each group from small to large."""
        groups: dict[str, dict[str, float]] = {group: {} for group, _ in self.places.values()}
        for condition, (group, n) in sorted(self.places.items(), key=lambda item: item[1][1]):
            groups[group][condition] = n
        return groups

    @classmethod
    def of(cls, results: Results, size: str | None = None) -> SizeAxis:
        """Return the axis of a swept key, or of its last part; by default of the team size.

        The team size is the swept key that is the number of bodies, see `Sizes`. If trials did not
        count them, it is the only swept number that is no setting of learners or hierarchies.

        Raises
        ------
        SpecError
            If there is no such key, several keys are numbers, or a size is below 1 or above
            `MAX_SIZE`; one line.
        """
        columns = columns_of(results)
        return cls.by(_size_key(columns, size, _counted(results)), columns)

    @classmethod
    def by(cls, key: str, columns: Columns) -> SizeAxis:
        """Return the axis of a key that all conditions have; see `of` for what is refused."""
        places = {}
        for condition, row in columns.items():
            if not _is_number(row[key]):
                raise SpecError(f"{key} = {show(row[key])} (condition {condition!r}): is no size")
            n = float(str(row[key]))
            check_size(key.rpartition(".")[2], n, f" (condition {condition!r})")
            places[condition] = label_but(row, [key]), n
        return cls(key, places)


def columns_of(results: Results) -> Columns:
    """Return what distinguishes each condition; without columns it is its label."""
    if any(results.columns.values()):
        return results.columns
    return {condition: {"condition": condition} for condition in results.columns}


def key_beside_size(results: Results) -> str | None:
    """Return the `other_key` of results."""
    return other_key(results.columns, _counted(results))


def other_key(columns: Columns, counted: Sequence[str] = ()) -> str | None:
    """Return the only key that is swept besides the size, by which conditions are compared.

    None if no size is swept, or not exactly one key besides. `counted` are the swept keys that
    are the number of bodies, where that is known.
    """
    try:
        size = _size_key(columns, None, counted)
    except SpecError:
        return None
    others = {key for row in columns.values() for key in row} - {size}
    return others.pop() if len(others) == 1 else None


def _counted(results: Results) -> Sequence[str]:
    """Return the swept keys that are the number of bodies, if trials counted them."""
    is_counted = all("robots" in results.numbers(c) for c in results.conditions)
    return Sizes.of(results, results.conditions).keys if is_counted else ()


def check_size(name: str, size: float, where: str = "") -> None:
    """Refuse a size that is no number from 1 to `MAX_SIZE`; truth values are no sizes.

    Raises
    ------
    SpecError
        One line that names the size.
    """
    is_truth = isinstance(size, bool | np.bool_)
    if is_truth or not 1.0 <= size <= MAX_SIZE:
        shown = size if is_truth else f"{size:g}"
        raise SpecError(f"{name} = {shown}{where}: allowed are sizes from 1 to {MAX_SIZE:,}")


def _size_key(columns: Columns, size: str | None, counted: Sequence[str]) -> str:
    """Return the swept key that is named as size, or by default that of the counted bodies."""
    keys = dict.fromkeys(key for row in columns.values() for key in row)
    levels = {key: [row.get(key) for row in columns.values()] for key in keys}
    numbers = [k for k, own in levels.items() if all(map(_is_number, own)) and len({*own}) > 1]
    if size is not None:
        return key_named("size", size, numbers)
    sizes = [key for key in numbers if key in counted] or [
        key for key in numbers if key.partition(".")[0] not in ("learner", "topology")
    ]
    if not numbers:
        raise SpecError("size: no number is swept, such as scenario.robots = [2, 4]")
    if len(sizes) != 1:
        names = ", ".join(sizes or numbers)
        raise SpecError(f"size: name the swept key that is the size; those of numbers: {names}")
    return sizes[0]


def _is_number(value: object) -> bool:
    """Return whether a value is a number, or the text of one as in tables of scores."""
    if isinstance(value, str):
        return NUMBER.fullmatch(value.strip()) is not None
    return isinstance(value, int | float) and not isinstance(value, bool)
