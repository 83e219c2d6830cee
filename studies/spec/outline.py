"""What a study consists of, as it was noted: read without running anything that it names."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...core.plugins.sources import Sources
from ..errors import SpecError, show
from ..store.database import DATABASE, SPEC_FILE
from .labels import lengths

if TYPE_CHECKING:
    from ..store.reading import Reading
    from .spec import Spec


@dataclass(frozen=True)
class StudyOutline:
    """A spec as plain words and numbers."""

    study: str
    """Name of the study."""
    seeds: tuple[int, ...]
    """As in `Spec`."""
    episodes: int
    """As in `Spec`."""
    steps: int
    """As in `Spec`."""
    evaluation: int
    """As in `Spec`."""
    columns: Mapping[str, Mapping[str, Any]]
    """By condition, what tells it from the others."""
    table: Mapping[str, Any]
    """The whole spec as a table."""

    @property
    def lengths(self) -> str:
        """Episodes of training, stage by stage, in words."""
        common = self.table.get("curriculum", ())
        curricula = [o.get("curriculum", common) for o in self.table.get("overrides", [{}])]
        return lengths(([s["episodes"] for s in stages] for stages in curricula), self.episodes)

    @classmethod
    def of(cls, spec: Spec) -> StudyOutline:
        """Return the outline of a spec."""
        return cls.noted(spec.table(), {c.label: c.columns for c in spec.conditions()})

    @classmethod
    def kept(cls, store: Reading) -> StudyOutline:
        """Return the outline of a kept study, as it was noted; nothing is run for it.

        Raises
        ------
        SpecError
            If it cannot be read.
        """
        try:
            return cls.noted(store.spec(), store.columns())
        except (KeyError, TypeError, ValueError):
            raise SpecError(
                f"{store.directory / DATABASE}: is damaged: spec cannot be read"
            ) from None

    @classmethod
    def noted(
        cls, table: Mapping[str, Any], columns: Mapping[str, Mapping[str, Any]]
    ) -> StudyOutline:
        """Return the outline that `Spec.table` and the columns of its conditions tell.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it is no such table.
        """
        seeds = table["seeds"]
        seeds = range(seeds) if isinstance(seeds, int) else seeds
        return cls(
            study=str(table["study"]),
            seeds=tuple(map(int, seeds)),
            episodes=int(table["episodes"]),
            steps=int(table["steps"]),
            evaluation=int(table["evaluation"]),
            columns=columns,
            table=table,
        )


def sources_of(store: Reading) -> Sources:
    """Return the files of users that a kept study names, as they were when it began."""
    return Sources(None, store.sources(), brought_by=str(store.directory))


def other_spec(store: Reading) -> str | None:
    """Return how the copy of the spec beside a database differs from it, in one line.

    One of the two may have come from another study. None if they mean the same, or there is no
    copy. Files of users are run only if they are trusted, and if the copy is written otherwise.
    """
    path, own = store.directory / SPEC_FILE, store.spec()
    if not path.exists():
        return None
    try:
        copy = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        if copy != own:
            from .overlay import dumps
            from .spec import Spec

            tables = Spec.of(copy, sources_of(store)).table(), own
            copy, own = (tomllib.loads(dumps(table)) for table in tables)  # without what is None
    except (OSError, ValueError, RecursionError) as error:
        return f"{path}: is not the spec of {DATABASE} beside it: {error}"
    for key in sorted(own.keys() | copy.keys()):
        here, there = copy.get(key, "absent"), own.get(key, "absent")
        if here != there:
            return (
                f"{path}: is not the spec of {DATABASE} beside it, whose results these are: "
                f"{key} = {show(here)} here, {show(there)} there"
            )
    return None
