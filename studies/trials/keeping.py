"""Opening the store of a study to run the trials that are left, or to read its trials."""

import json
import tomllib
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from ...core.interface.measures import Measure
from ...core.plugins.sources import FOLDER, Sources, kept_name
from ...core.plugins.words import closest, show
from ...core.shell import command_line
from ..errors import SpecError
from ..spec.outline import Code, older_results, outdated, present, sources_of
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
ABSENT = object()
"""Value of a key that is missing."""


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
        code, planned = _examine(directory, spec, notes, accept_code=accept_code)
        chosen = planned | {trial.identity for trial in trials}
        computed = replace(
            notes,
            code=present(code, notes.spec, notes.sources),
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


def _examine(
    directory: Path, spec: Spec, notes: StudyNotes, *, accept_code: bool
) -> tuple[Code | None, set[str]]:
    """Return the code and the planned trials of the study in a directory, if it is the same study.

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
    try:
        with Store.open(directory) as store:
            refusal = older_results(store) if accept_code else outdated(store)
            if refusal is not None:
                raise SpecError(refusal)
            _check_same(store, spec, notes)
            planned = {trial.identity for trial in store.planned()}
            code = store.code()
    except NoStudyError:
        copy = directory / SPEC_FILE
        if copy.exists() and not is_copy(copy, spec, notes):
            raise SpecError(f"{copy}: is in the way of this study's own copy") from None
        return None, set()
    if planned - {trial.identity for trial in trials_of(spec)}:
        raise SpecError(
            f"{directory}: holds trials that are not of this spec, as after a change of Python's "
            "version; use another directory"
        )
    return code, planned


def is_copy(path: Path, spec: Spec, notes: StudyNotes) -> bool:
    """Return whether a file holds a spec; the users' files that it names are not read again."""
    try:
        table = tomllib.loads(read_text(path))
        return table == notes.spec or Spec.of(table, spec.sources) == spec
    except (OSError, ValueError, RecursionError):
        return False


def _check_same(store: Store, spec: Spec, notes: StudyNotes) -> None:
    """Raise if a spec differs from that of an open study by more than additional seeds."""
    mismatch = difference(store.study_notes(), notes)
    if mismatch is None:
        return
    copy = store.directory / SPEC_FILE
    if is_copy(copy, spec, notes):
        raise SpecError(
            f"{copy}: is not the spec of the study beside it: {mismatch}; if you did not edit it, "
            f"it is damaged: {command_line('retry', store.directory)} continues from the database"
        )
    raise SpecError(f"{store.directory}: holds another study: {mismatch}")


def difference(old: StudyNotes, new: StudyNotes) -> str | None:
    """Return one line on the first difference of two studies; None if they are the same study.

    Meanings are compared, not notation. Additional seeds are no difference.
    """
    lines = list(_differences(old, new))
    if not lines:
        return None
    more = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
    return f"{lines[0]}{more}; use another directory"


def _differences(old: StudyNotes, new: StudyNotes) -> Iterator[str]:
    yield from _changed_files(old.sources, new.sources)
    for name in SAME:
        yield from _unequal(name, old.spec.get(name, ABSENT), new.spec.get(name, ABSENT))
    seeds = _seeds(old.spec["seeds"])
    more_seeds = _seeds(new.spec["seeds"])
    if not set(seeds) <= set(more_seeds):
        yield f"seeds = {show(seeds)} there, {show(more_seeds)} here"
    if [*old.conditions] != [*new.conditions]:
        there = show([*old.conditions])
        here = show([*new.conditions])
        written = next(_written(old.spec, new.spec), "")
        yield f"conditions = {there} there, {here} here{written and f', by {written}'}"
    for stages, new_stages in zip(_curricula(old), _curricula(new), strict=False):
        yield from _unequal("curriculum", stages, new_stages)
    # The swept keys are columns of every table.
    keys, new_keys = (list(next(iter(notes.columns.values()))) for notes in (old, new))
    yield from _unequal("columns", keys, new_keys)
    if old.measures and [*map(column_of, old.measures)] != [*map(column_of, new.measures)]:
        there, here = (", ".join(m.name for m in notes.measures) for notes in (old, new))
        yield f"measures of episodes = {there} there, {here} here, or their definitions differ"
    for label in [label for label in new.conditions if label in old.conditions]:
        before, after = (dict(flat(notes.conditions[label])) for notes in (old, new))
        for key in sorted(before.keys() | after.keys()):
            there = before.get(key, ABSENT)
            here = after.get(key, ABSENT)
            yield from _unequal(f"condition {label!r}: {key}", there, here)


def _changed_files(old: Mapping[str, str], new: Mapping[str, str]) -> Iterator[str]:
    there = Sources(None, old)
    here = Sources(None, new)
    for name in sorted(old):
        if name not in new:
            yield f"{name} is a file of the study there, not of this one"
        elif there.digest(name) != here.digest(name):
            yield f"{name} has changed since"


def _seeds(written: int | Sequence[int]) -> Sequence[int]:
    """Return the seeds of a spec, which may be written as their number."""
    return list(range(written)) if isinstance(written, int) else written


def _written(old: SpecTable, new: SpecTable) -> Iterator[str]:
    """Yield the keys, except seeds, in which two specs differ."""
    before, after = (dict(flat(spec)) for spec in (old, new))
    for key in sorted((before.keys() | after.keys()) - {"seeds"}):
        yield from _unequal(key, before.get(key, ABSENT), after.get(key, ABSENT))


def _unequal(name: str, there: object, here: object) -> Iterator[str]:
    if there != here:
        texts = ["absent" if value is ABSENT else show(value) for value in (there, here)]
        yield f"{name} = {texts[0]} there, {texts[1]} here"


def _curricula(notes: StudyNotes) -> list[Sequence[SpecTable]]:
    """Return the curriculum of the spec and of each of its overrides, as written."""
    own = notes.spec.get("curriculum", [])
    return [own, *(o.get("curriculum", own) for o in notes.spec.get("overrides", ()))]
