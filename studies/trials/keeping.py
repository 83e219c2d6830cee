"""Opening the store of a study to run the trials that are left, or to read its trials."""

import json
import tomllib
from collections.abc import Container, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from ...core.interface.measures import Measure
from ...core.plugins.sources import FOLDER, Sources, kept_name
from ...core.plugins.words import closest, show
from ...core.shell import command_line
from ..errors import SpecError
from ..spec.outline import older_results, outdated, present, sources_of
from ..spec.spec import Spec
from ..spec.tables import SpecTable, aliases, dumps, flat, named
from ..store.database import DATABASE, RESULTS_VERSION, SPEC_FILE, NoStudyError, StudyNotes
from ..store.durable import read_text
from ..store.store import Store
from ..store.writer import lock_directory
from .episodes import column_of
from .trial import Trial, trials_of

SAME = (
    "study",
    "episodes",
    "steps",
    "evaluation",
    "evaluation_steps",
    "keep_teams",
    "evaluations",
)
"""Keys of a spec that must be equal for a study to continue."""
OTHER_FOLDER = "write to a new folder (--out)"
"""Advice for a study that does not fit into a directory."""


@contextmanager
def open_to_run(
    directory: Path,
    spec: Spec,
    trials: Sequence[Trial],
    measures: Sequence[Measure],
    *,
    accept_code: bool = False,
) -> Iterator[Store]:
    """Open the store of a study in a directory, and create it if it does not exist.

    Parameters
    ----------
    directory
        The directory.
    spec
        The study.
    trials
        Trials to run now. Other trials that were planned before remain planned.
    measures
        Measures of its episodes, see `arrangement.check_conditions`.
    accept_code
        Whether to continue although the installed code has changed.

    Raises
    ------
    SpecError
        If the directory cannot be written, contains a study that differs by more than additional
        seeds, or another process is writing to it. Nothing has been changed then.
    """
    notes = notes_of(spec, measures)
    _examine(directory, spec, notes, accept_code=accept_code)  # a refusal leaves nothing behind
    with lock_directory(directory):
        # Again, because another process may have written meanwhile.
        planned = _examine(directory, spec, notes, accept_code=accept_code)
        chosen = planned | {trial.identity for trial in trials}
        computed = replace(
            notes,
            code=present(notes.spec, notes.sources),
            planned=[trial.planned for trial in trials_of(spec) if trial.identity in chosen],
        )
        copies = spec.sources.texts.items()  # so that the study can be run again
        files = {f"{FOLDER}/{kept_name(name)}": text.encode() for name, text in copies}
        if not is_copy(directory / SPEC_FILE, spec, notes):
            files[SPEC_FILE] = dumps(spec.table()).encode()
        with Store.create(directory, computed, files) as store:
            yield store


def spec_of(store: Store) -> Spec:
    """Return the spec of a stored study. This runs the user files that it names."""
    return Spec.of(store.spec(), sources_of(store))


def pending(store: Store, trials: Iterable[Trial]) -> list[Trial]:
    """Return the trials that have neither failed nor finished with undamaged results.

    A remark on each damaged trial is added to the store's `notes`.
    """
    states = store.states()
    return [trial for trial in trials if trial.identity not in states]


def finished_trial(store: Store, condition: str | None, seed: int | None) -> Trial:
    """Return the finished trial of a condition and seed; by default the first ones of the study.

    Raises
    ------
    SpecError
        If there is no such condition or seed, the trial has not finished, its results are damaged,
        or an older results version has computed them.
    """
    _check_version(store)
    spec = spec_of(store)
    known = {c.label: aliases(c.label, c.columns) for c in spec.conditions()}
    label = next(iter(known)) if condition is None else named(condition, known)
    if label is None:
        raise SpecError(f"condition = {condition!r}: {closest(condition, known)}")
    seed = spec.seeds[0] if seed is None else seed
    if seed not in spec.seeds:
        raise SpecError(f"seed = {seed}: known: {', '.join(map(str, spec.seeds))}")
    trial = next(t for t in trials_of(spec) if (t.condition, t.seed) == (label, seed))
    if store.states().get(trial.identity) != "done":
        unfinished = f"{trial.condition}, seed {seed}: has not finished"
        raise SpecError(store.damage().get(trial.identity, unfinished))
    return trial


def check_teams(store: Store, identities: Container[str] = ()) -> None:
    """Raise if a study keeps no teams, or the teams of some trials are damaged or older."""
    _check_version(store)
    if not store.spec().get("keep_teams"):
        raise SpecError(f"{store.directory}: keeps no teams: its spec has no keep_teams = true")
    for identity, line in store.damage().items():
        if identity in identities:
            raise SpecError(f"{line}; {command_line('run')} runs it again")


def _check_version(store: Store) -> None:
    """Raise if another version has trained the teams of a study, which might act differently."""
    if store.is_older:
        raise SpecError(
            f"{store.directory / DATABASE}: holds results of version {store.version}, this is "
            f"version {RESULTS_VERSION}: tables and reports can read them, but its teams and "
            "recordings are not used"
        )


def notes_of(spec: Spec, measures: Sequence[Measure] = ()) -> StudyNotes:
    """Return the description of a study without its trials and code."""
    return StudyNotes(
        spec=json.loads(json.dumps(spec.table())),
        conditions={c.label: c.settings.model_dump(mode="json") for c in spec.conditions()},
        columns={c.label: c.columns for c in spec.conditions()},
        sources=spec.sources.texts,
        measures=measures,
    )


def _examine(directory: Path, spec: Spec, notes: StudyNotes, *, accept_code: bool) -> set[str]:
    """Return the identities of the planned trials of the study in a directory.

    Parameters
    ----------
    directory
        The directory.
    spec, notes
        The study that is to be run in it, and its description.
    accept_code
        Whether to continue although the installed code has changed.

    Raises
    ------
    SpecError
        If the directory holds another study, a damaged one, or other files.
    """
    copy = directory / SPEC_FILE
    try:
        with Store.open(directory) as store:
            refusal = older_results(store) if accept_code else outdated(store)
            if refusal is not None:
                raise SpecError(refusal)
            mismatch = difference(store.study_notes(), notes)
            planned = {trial.identity for trial in store.planned()}
    except NoStudyError:
        if copy.exists() and not is_copy(copy, spec, notes):
            raise SpecError(f"{copy}: is in the way of this study's own copy") from None
        return set()
    if mismatch is not None:
        retry = command_line("retry", directory)
        hint = f"; {retry} continues from the database" if is_copy(copy, spec, notes) else ""
        raise SpecError(f"{directory}: holds another study: {mismatch}{hint}")
    if planned - {trial.identity for trial in trials_of(spec)}:
        raise SpecError(
            f"{directory}: holds trials that are not of this spec, as after a change of Python's "
            f"version; {OTHER_FOLDER}"
        )
    return planned


def is_copy(path: Path, spec: Spec, notes: StudyNotes) -> bool:
    """Return whether a file holds a spec; the users' files that it names are not read again."""
    try:
        table = tomllib.loads(read_text(path))
        return table == notes.spec or Spec.of(table, spec.sources) == spec
    except (OSError, ValueError, RecursionError):
        return False


def difference(old: StudyNotes, new: StudyNotes) -> str | None:
    """Return one line on the first difference of two studies; None if they are the same study.

    Meanings are compared, not notation. Additional seeds are no difference.
    """
    there = Sources(None, old.sources)
    here = Sources(None, new.sources)
    for name in sorted(old.sources):
        if name not in new.sources or there.digest(name) != here.digest(name):
            return (
                f"{name} has changed since, or this spec does not name it; restore it from "
                f"{FOLDER}/{kept_name(name)}, or {OTHER_FOLDER}"
            )
    has_all_seeds = set(_seeds(old.spec["seeds"])) <= set(_seeds(new.spec["seeds"]))
    if has_all_seeds and _meaning(old) == _meaning(new):
        return None
    allowed = {"title", "seeds"} if has_all_seeds else {"title"}
    specs = [{k: v for k, v in notes.spec.items() if k not in allowed} for notes in (old, new)]
    lines = [*_unequal(*specs)]
    lines += _unequal(dict(old.conditions), dict(new.conditions)) if not lines else []
    more = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
    return f"{next(iter(lines), 'its measures of episodes differ')}{more}; {OTHER_FOLDER}"


def _meaning(notes: StudyNotes) -> tuple[object, ...]:
    """Return all that must be equal for a study to continue, in a form without notation."""
    common = notes.spec.get("curriculum", [])
    stages = [common, *(o.get("curriculum", common) for o in notes.spec.get("overrides", ()))]
    return (
        [notes.spec.get(name) for name in SAME],
        list(notes.conditions.items()),
        list(next(iter(notes.columns.values()))),  # the swept keys are columns of every table
        stages,
        [*map(column_of, notes.measures)],
    )


def _seeds(written: int | Sequence[int]) -> Sequence[int]:
    """Return the seeds of a spec, which may be written as their number."""
    return list(range(written)) if isinstance(written, int) else written


def _unequal(old: SpecTable, new: SpecTable) -> Iterator[str]:
    """Yield one line for each key in which two tables differ."""
    before = dict(flat(old))
    after = dict(flat(new))
    for key in sorted(before.keys() | after.keys()):
        if before.get(key) != after.get(key):
            there, here = (show(t[key]) if key in t else "absent" for t in (before, after))
            yield f"{key} = {there} there, {here} here"
