"""Outline of a kept study, read without running any code that it names.

The installed code that computes results is noted, too, so that an edit of it is reported: a digest
of each module on which a trial's numbers depend. These are modules of this package, of packages
that offer things to it, and those in `foreign_code`.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ...core.plugins.sources import Sources
from ...core.plugins.words import show
from ..errors import SpecError
from ..store.database import DATABASE, RESULTS_VERSION, SPEC_FILE
from ..store.durable import read_text
from ..store.store import Store
from .foreign_code import foreign_code, python_files

if TYPE_CHECKING:
    from .spec import Spec
    from .tables import SpecTable


def lengths(curricula: Iterable[Sequence[int]], episodes: int) -> str:
    """Return the numbers of training episodes in words, stage by stage.

    Parameters
    ----------
    curricula
        Episodes of each stage, for every condition.
    episodes
        Episodes of training after the stages.

    Examples
    --------
    >>> lengths([[10, 6], [10, 6]], 8), lengths([[10, 6], []], 8), lengths([[]], 1)
    ('10 + 6 + 8 episodes', '10 + 6 + 8 or 8 episodes', '1 episode')
    """
    sums = dict.fromkeys(" + ".join(map(str, [*stages, episodes])) for stages in curricula)
    return f"{' or '.join(sums)} episode{'' if list(sums) == ['1'] else 's'}"


class StudyOutline(NamedTuple):
    """A spec as plain words and numbers."""

    study: str
    """Name of the study."""
    seeds: tuple[int, ...]
    """Seeds of the trials of each condition."""
    episodes: int
    """Number of training episodes of a trial."""
    steps: int
    """Maximum number of decisions in an episode."""
    evaluation: int
    """Number of evaluation episodes after training."""
    columns: Mapping[str, SpecTable]
    """Columns that distinguish each condition from the others."""
    table: SpecTable
    """The whole spec as a table."""

    @property
    def lengths(self) -> str:
        """Episodes of training, stage by stage, or decisions, in words."""
        if (decisions := self.table.get("decisions")) is not None:
            return f"{decisions:,} decisions in episodes"
        common = self.table.get("curriculum", ())
        curricula = [o.get("curriculum", common) for o in self.table.get("overrides", [{}])]
        return lengths(([s["episodes"] for s in stages] for stages in curricula), self.episodes)

    @classmethod
    def of(cls, spec: Spec) -> StudyOutline:
        """Return the outline of a spec."""
        return cls.noted(spec.table(), {c.label: c.columns for c in spec.conditions()})

    @classmethod
    def kept(cls, store: Store) -> StudyOutline:
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
    def noted(cls, table: SpecTable, columns: Mapping[str, SpecTable]) -> StudyOutline:
        """Return the outline that `Spec.table` and the columns of its conditions tell.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it is no such table.
        """
        seeds = table["seeds"]
        seeds = tuple(range(seeds) if isinstance(seeds, int) else map(int, seeds))
        episodes, steps, evaluation = (int(table[k]) for k in ("episodes", "steps", "evaluation"))
        return cls(str(table["study"]), seeds, episodes, steps, evaluation, columns, table)


def sources_of(store: Store) -> Sources:
    """Return the files of users that a kept study names, as they were when it began."""
    return Sources(None, store.sources(), brought_by=str(store.directory))


def other_spec(store: Store) -> str | None:
    """Return the difference between a study and the copy of the spec in its folder, in one line.

    One of the two may have come from another study. None if they are equal or there is no copy.
    Files of users run only if they are trusted and the copy differs.
    """
    path = store.directory / SPEC_FILE
    own = store.spec()
    if not path.exists():
        return None
    try:
        copy = tomllib.loads(read_text(path))
        if copy != own:
            from .spec import Spec
            from .tables import dumps

            copy = tomllib.loads(dumps(Spec.of(copy, sources_of(store)).table()))
            own = tomllib.loads(dumps(own))  # without what is None
    except (OSError, ValueError, RecursionError) as error:
        return f"{path}: cannot be compared with {DATABASE} in its folder: {error}"
    for key in sorted(own.keys() | copy.keys()):
        here = copy.get(key, "absent")
        there = own.get(key, "absent")
        if here != there:
            return (
                f"{path}: is not the spec of {DATABASE} in its folder, which has the results: "
                f"{key} = {show(here)} here, {show(there)} there"
            )
    return None


PACKAGE = Path(__file__).parents[2]
"""Folder of the installed package."""
COMPUTING = (
    "core/**/*.py",
    "topologies/**/*.py",
    "scenarios/**/*.py",
    "scenarios/**/*.toml",
    "studies/trials/**/*.py",
    "studies/catalogue/**/*.py",
)
"""Modules that compute results, and what they are given."""
SILENT = ("checking", "pictures", "environments.py", "figure.py", "drawing.py")
"""Parts of them that do not."""
GROUPS = "nested_agents."
"""Prefix of the names of entry-point groups."""

Code = dict[str, str]
"""Digest of each module, and version of each library."""


def modules() -> dict[str, str]:
    """Return the text of every module that computes results, by its path in its package."""
    texts = {}
    for pattern in COMPUTING:
        for path in sorted(PACKAGE.glob(pattern)):
            name = path.relative_to(PACKAGE).as_posix()
            if not set(name.split("/")) & set(SILENT):
                texts[name] = path.read_text(encoding="utf-8")
    for package in _offering():
        for name, path in python_files(package):
            texts[name] = path.read_text(encoding="utf-8", errors="replace")
    return texts


def _offering() -> list[str]:
    """Return the installed packages that offer things to studies."""
    from importlib.metadata import entry_points

    points = entry_points()
    groups = [group for group in points.groups if group.startswith(GROUPS)]
    packages = {p.module.partition(".")[0] for g in groups for p in points.select(group=g)}
    return sorted(packages - {__name__.partition(".")[0]})


def present(table: SpecTable, texts: Mapping[str, str]) -> Code:
    """Return digests of the code that computes a study, and versions of libraries.

    Parameters
    ----------
    table
        The spec as a table.
    texts
        Texts of the users' files that it names.
    """
    files, versions = foreign_code(table, texts)
    read = {n: p.read_text(encoding="utf-8", errors="replace") for n, p in files.items()}
    digests = {
        name: hashlib.sha256(text.encode()).hexdigest()[:16]
        for name, text in (modules() | read).items()
    }
    return digests | versions


def changed(known: Mapping[str, str], here: Code) -> list[str]:
    """Return the modules and libraries that differ from known ones, or are new or gone."""
    names = sorted(known.keys() | here.keys())
    return [name for name in names if known.get(name) != here.get(name)]


def older_results(store: Store) -> str | None:
    """Return one line if an older version has computed the results of a study, else None."""
    if not store.is_older:
        return None
    return (
        f"{store.directory / DATABASE}: holds results of version {store.version}, this is version "
        f"{RESULTS_VERSION}: they are read without their checksums, and run does not continue them"
    )


def outdated(store: Store) -> str | None:
    """Return one line if this code does not continue a study, else None."""
    if store.is_older:
        return older_results(store)
    modules = changed(store.code(), present(store.spec(), store.sources()))
    if not modules:
        return None
    more = f" and {len(modules) - 1} more have" if len(modules) > 1 else " has"
    return (
        f"{store.directory}: {modules[0]}{more} changed since its trials were run; continue with "
        "--accept-code"
    )
