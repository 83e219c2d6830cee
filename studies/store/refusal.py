"""Whether a spec may be run in a directory: what the directory holds must be the same study."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...core.interface.measures import Measure
from ...core.plugins.sources import Sources, named
from ..spec.difference import difference
from ..spec.errors import SpecError
from ..spec.spec import Spec
from ..trials.measures import column_of
from . import integrity
from .database import DATABASE, SPEC_FILE
from .reading import Reading


@dataclass(frozen=True)
class Given:
    """What is to be run.

    Attributes
    ----------
    spec
        The study.
    measures
        What it measures of its episodes.
    accept_code
        Whether to go on although the installed code has changed.
    """

    spec: Spec
    measures: Sequence[Measure]
    accept_code: bool


def examine(directory: Path, given: Given) -> str | None:
    """Return what is wrong with a directory's database as a whole, if anything is.

    Raises
    ------
    SpecError
        If the directory holds another study, or something that is none.
    """
    damage = integrity.damage(directory / DATABASE)
    refusal = _refusal(directory, given, damage)
    if refusal is not None:
        raise SpecError(refusal)
    return damage


def is_copy(path: Path, spec: Spec) -> bool:
    """Tell whether a file holds a spec; what the spec names of users' files is not read again."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        return Spec.of(table, spec.sources) == spec
    except (OSError, ValueError, RecursionError):
        return False


def _refusal(directory: Path, given: Given, damage: str | None) -> str | None:
    """Return why a spec may not be added to what a directory holds, in one line."""
    if damage is None and integrity.holds_tables(directory / DATABASE):
        with Reading.open(directory) as store:
            return _of_study(store, given)
    path = directory / SPEC_FILE
    if not path.exists() or is_copy(path, given.spec):
        return None
    if damage is None:
        return f"{path}: is in the way of this study's own copy"
    try:
        old = Spec.load(path)
    except SpecError as error:
        return (
            f"{path}: is no spec, and {DATABASE} beside it is damaged: which study this is cannot "
            f"be told ({error})"
        )
    settings = {c.label: c.settings.model_dump(mode="json") for c in old.conditions()}
    found = difference(old, settings, given.spec)
    return f"{directory}: holds another study: {found}" if found else None


def _of_study(store: Reading, given: Given) -> str | None:
    """Return why a spec may not be added to an open study, in one line; None if it may."""
    outdated = store.outdated()
    is_other = store.other_version() is not None
    if is_other or (outdated is not None and not given.accept_code):
        return outdated
    found = _other_source(store.sources(), given.spec)
    if found is None:
        # What the files mean is the same: those of the spec in hand are run, not the kept ones.
        old = store.spec(given.spec.sources)
        found = difference(old, store.settings(), given.spec)
    copy = store.directory / SPEC_FILE
    if found is not None and is_copy(copy, given.spec):
        return (
            f"{copy}: is not the spec of the study beside it: {found}; if you did not edit it, it "
            f"is damaged: nested-agents retry {store.directory} goes on by the database"
        )
    if found is not None:
        return f"{store.directory}: holds another study: {found}"
    return _other_measures(store, given.measures)


def _other_source(kept: Sources, spec: Spec) -> str | None:
    """Return which of the users' files of a study are not those of a spec, in one line."""
    of_spec = named(spec.table())
    for name in sorted(kept.texts):
        if name not in of_spec:
            return f"{name} is part of it, not of this one; use another directory"
        if kept.digest(name) != spec.sources.digest(name):
            return f"{name} has changed since; use another directory"
    return None


def _other_measures(store: Reading, measures: Sequence[Measure]) -> str | None:
    """Return in one line that episodes are measured otherwise here; None if they are not."""
    kept = store.measures()
    if list(map(column_of, kept)) == list(map(column_of, measures)):
        return None
    told, now = (", ".join(m.name for m in group) for group in (kept, measures))
    return (
        f"{store.directory}: holds episodes measured by {told}; its scenarios now declare "
        f"{now}, or mean something else by it; use another directory"
    )
