"""The ledger of a study: a directory that loses nothing that was finished.

``results.sqlite`` holds the spec, the conditions, one row per trial and one per episode;
``recordings/IDENTITY.npz`` the recorded episodes of a trial; ``study.toml`` the spec, to read and
to run again. The database is written through (WAL, synchronous=FULL), and a recording is complete
before its trial is noted as done: a crash at any moment costs the running trials only. Rows and
recordings have checksums: what is not as it was written is named, and its trial run again.

The view `results` is made for other tools::

    pandas.read_sql("SELECT * FROM results", sqlite3.connect("DIR/results.sqlite"))
"""

from __future__ import annotations

import fcntl
import json
import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TextIO, TypeVar

from ...core.protocols import Measure
from ...core.sources import FOLDER, Sources, kept_name
from ..spec.difference import difference
from ..spec.errors import SpecError
from ..spec.outline import Outline
from ..spec.spec import Spec
from ..spec.toml import dumps
from ..trials import code
from ..trials.episodes import ELSEWHERE, STAGE, Recording
from ..trials.measures import column_of, measures_from
from ..trials.trial import RESULTS_VERSION, Trial, TrialResult
from . import database, durable, integrity
from .running import LOCK
from .schema import PLANNED, SECONDS, prepare, trial_checksum

DATABASE = "results.sqlite"
SPEC_FILE = "study.toml"


class Identified(Protocol):
    """A trial as far as the ledger needs it."""

    @property
    def identity(self) -> str: ...  # noqa: D102
    @property
    def condition(self) -> str: ...  # noqa: D102
    @property
    def seed(self) -> int: ...  # noqa: D102


T = TypeVar("T", bound=Identified)


class Planned(NamedTuple):
    """A trial as it was noted before it was run: its members are those of a `Trial`."""

    identity: str
    condition: str
    seed: int
    recorded: dict[int, str]


@dataclass(frozen=True)
class _Given:
    """What is to be run, and by what."""

    spec: Spec
    measures: Sequence[Measure]
    accept_code: bool

    @cached_property
    def code(self) -> code.Code:
        """The installed code."""
        return code.present()


class Store:
    """An open study directory. Use `Store.create` to write and `Store.open` to read.

    Attributes
    ----------
    directory
        Where it is.
    notes
        What was found damaged, and what was done about it; one line each.
    """

    def __init__(self, directory: Path, connection: sqlite3.Connection) -> None:
        self.directory = directory
        self.notes: list[str] = []
        self._db = connection
        self._code = ""  # what computes what is saved

    @classmethod
    @contextmanager
    def create(
        cls,
        directory: Path,
        spec: Spec,
        measures: Sequence[Measure],
        *,
        accept_code: bool = False,
    ) -> Iterator[Store]:
        """Open a directory to run `spec` in; make it if it does not exist.

        A damaged database is set aside under another name, and what can be trusted of it copied.

        Parameters
        ----------
        directory
            The directory.
        spec
            The study.
        measures
            What it measures of its episodes, see `nested_agents.studies.trials.trial.check`.
        accept_code
            Whether to go on although the installed code has changed since.

        Raises
        ------
        SpecError
            If it cannot be written, holds a study that differs by more than additional seeds, or
            another process is writing to it. Nothing has been changed then.
        """
        given = _Given(spec, measures, accept_code)
        _examined(directory, given)  # what is refused leaves nothing behind
        path = directory / DATABASE
        try:
            (directory / "recordings").mkdir(parents=True, exist_ok=True)
            lock = open(directory / LOCK, "w")  # noqa: SIM115 - held until the store is closed
        except OSError as error:
            raise SpecError(f"{directory}: {error.strerror or error}") from None
        with lock:
            _take(lock, directory)
            damage = _examined(directory, given)  # again: nobody else writes from here on
            aside = integrity.set_aside(path) if damage is not None else None
            with database.writing(path) as connection:
                store = cls(directory, connection)
                with database.transaction(connection):
                    prepare(connection, spec, measures, given.code)
                    recovered = 0 if aside is None else integrity.recover(aside, connection)
                if aside is not None:
                    store.notes.append(
                        f"{path}: is damaged: {damage}; kept as {aside.name}, "
                        f"{recovered} trials taken over, the others run again"
                    )
                spec_file = directory / SPEC_FILE
                if not (spec_file.exists() and Spec.load(spec_file) == spec):
                    durable.write(spec_file, dumps(spec.table()).encode())
                store._keep_sources(spec)
                store._code = code.digest(given.code)
                yield store

    @classmethod
    @contextmanager
    def open(cls, directory: Path) -> Iterator[Store]:
        """Open an existing study to read it.

        Raises
        ------
        SpecError
            If the directory holds no readable study.
        """
        if not (directory / DATABASE).is_file():
            raise SpecError(f"{directory}: holds no study (no {DATABASE})")
        with database.reading(directory / DATABASE) as connection:
            yield cls(directory, connection)

    def spec(self) -> Spec:
        """Return the spec that the study runs; what it names of users' files is run."""
        return Spec.of(self._table("spec"), self.sources())

    def sources(self) -> Sources:
        """Return the files of users that the study names, as they were when it began."""
        return Sources(None, self._table("sources"))

    def outline(self) -> Outline:
        """Return what the study consists of, as it was noted; nothing is run for it."""
        try:
            return Outline.noted(self._table("spec"), self.columns())
        except (KeyError, TypeError, ValueError):
            raise SpecError(
                f"{self.directory / DATABASE}: is damaged: spec cannot be read"
            ) from None

    def planned(self) -> tuple[Planned, ...]:
        """Return all trials of the study, as they were noted."""
        rows = self._db.execute(f"SELECT {', '.join(PLANNED)} FROM planned ORDER BY position")
        return tuple(
            Planned(identity, condition, seed, {int(k): v for k, v in json.loads(kept).items()})
            for identity, condition, seed, kept in rows
        )

    def versions_of_code(self) -> int:
        """Return by how many versions of the installed code finished trials were computed."""
        query = "SELECT count(DISTINCT code) FROM trials WHERE state = 'done'"
        return int(self._db.execute(query).fetchone()[0])

    def outdated(self) -> str | None:
        """Return why this code would not go on with the study, in one line; None if it would."""
        if (other := self.other_version()) is not None:
            return f"{other}; use another directory"
        known = {name: (text, tree) for name, (text, tree) in self._table("code").items()}
        modules = code.changed(known)
        if not modules:
            return None
        more = f" and {len(modules) - 1} more have" if len(modules) > 1 else " has"
        return (
            f"{self.directory}: its results are of other code: {modules[0]}{more} changed "
            "since; --accept-code goes on with it"
        )

    def other_version(self) -> str | None:
        """Return of which version the results are, in one line, if they are not of this one."""
        if (version := self.meta("results_version")) == str(RESULTS_VERSION):
            return None
        return (
            f"{self.directory}: holds results of version {version}, this is version "
            f"{RESULTS_VERSION}"
        )

    def measures(self) -> tuple[Measure, ...]:
        """Return what the study measures of its episodes, of any condition."""
        if (other := self.other_version()) is not None:
            raise SpecError(f"{other}; run it again to read it")
        try:
            return measures_from(json.loads(self.meta("measures")))
        except (ValueError, TypeError):
            raise SpecError(
                f"{self.directory / DATABASE}: is damaged: measures cannot be read"
            ) from None

    def refusal(self, given: _Given) -> str | None:
        """Return why a spec may not be run here by this version, in one line; None if it may."""
        outdated = self.outdated()
        is_other = self.other_version() is not None
        if is_other or (outdated is not None and not given.accept_code):
            return outdated
        if found := difference(self.spec(), self._table("conditions"), given.spec):
            return f"{self.directory}: holds another study: {found}"
        return self._other_measures(given.measures)

    def _other_measures(self, measures: Sequence[Measure]) -> str | None:
        """Return in one line that episodes are measured otherwise here; None if they are not."""
        kept = self.measures()
        if list(map(column_of, kept)) == list(map(column_of, measures)):
            return None
        told, now = (", ".join(m.name for m in group) for group in (kept, measures))
        return (
            f"{self.directory}: holds episodes measured by {told}; its scenarios now declare "
            f"{now}, or mean something else by it; use another directory"
        )

    def meta(self, key: str) -> str:
        """Return what is noted under `key`, as ``spec``, ``conditions`` or ``results_version``."""
        found = self._db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        if found is None:
            raise SpecError(f"{self.directory / DATABASE}: is no study: it has no {key}")
        return str(found[0])

    def _table(self, key: str) -> dict[str, Any]:
        try:
            table = json.loads(self.meta(key))
        except ValueError:
            table = None
        if not isinstance(table, dict):
            raise SpecError(f"{self.directory / DATABASE}: is damaged: {key} cannot be read")
        return table

    def _keep_sources(self, spec: Spec) -> None:
        """Keep copies of users' files to read, and to run ``study.toml`` again."""
        folder = self.directory / FOLDER
        for name, text in spec.sources.texts.items():
            folder.mkdir(exist_ok=True)
            path = folder / kept_name(name)
            if not path.exists():
                durable.write(path, text.encode())

    def pending(self, trials: Iterable[T]) -> list[T]:
        """Return the trials that have neither failed nor finished with undamaged results.

        What is damaged is added to the `notes`.
        """
        states = dict(self._db.execute("SELECT identity, state FROM trials").fetchall())
        damage = self.damage(trials)
        for identity, line in damage.items():
            states.pop(identity)
            self.notes.append(f"{line}; must run again")
        return [trial for trial in trials if trial.identity not in states]

    def damage(self, trials: Iterable[Identified]) -> dict[str, str]:
        """Return by identity which finished trials are not as they were written, one line each."""
        found = {}
        for trial in trials:
            query = "SELECT recording_sha256 FROM trials WHERE identity = ? AND state = 'done'"
            row = self._db.execute(query, (trial.identity,)).fetchone()
            if row is None:
                continue
            where = f"{trial.condition}, seed {trial.seed}"
            path = self._recordings(trial.identity)
            if not self._is_sound(trial.identity):
                found[trial.identity] = f"{self.directory / DATABASE}: {where}: rows are damaged"
            elif (digest := durable.sha256(path)) != row[0]:
                what = "is missing" if digest is None else "is damaged"
                found[trial.identity] = f"{path}: {what} ({where})"
        return found

    def verify(self) -> None:
        """Raise `SpecError` if the rows of a finished trial are not what was written."""
        query = "SELECT identity, condition, seed FROM trials WHERE state = 'done'"
        for identity, condition, seed in self._db.execute(query).fetchall():
            if not self._is_sound(identity):
                raise SpecError(
                    f"{self.directory / DATABASE}: {condition}, seed {seed}: rows are damaged; "
                    "nested-agents run runs it again"
                )

    def _is_sound(self, identity: str) -> bool:
        """Tell whether the rows of a trial are what was written, as far as that is known."""
        if not self._db.execute("PRAGMA table_info(checksums)").fetchall():
            return True  # begun before there were checksums
        query = "SELECT sha256 FROM checksums WHERE identity = ?"
        noted = self._db.execute(query, (identity,)).fetchone()
        return noted is None or noted[0] == trial_checksum(self._db, identity)

    def save(self, trial: Trial, result: TrialResult, total: float) -> None:
        """Keep the result of a trial that took `total` seconds; durable on return.

        Raises
        ------
        ValueError
            If it has a measure that the study has not.
        """
        identity, names = trial.identity, [m.name for m in self.measures()]
        if unknown := {m.name for m in result.measures} - set(names):
            raise ValueError(f"measures {sorted(unknown)}: the study has {names}")
        digest = durable.write_recordings(self._recordings(identity), result.recordings)
        seconds = {**result.seconds, "total": total}
        numbers = [(n, v, 1) for n, v in result.numbers.items()]
        numbers += [(n, v, 0) for n, v in result.usage.items()]
        with database.transaction(self._db):
            self._note(trial, "done", None, digest)
            self._insert("episodes", [(identity, *row.flat(names)) for row in result.rows])
            self._insert("seconds", [(identity, *(seconds[part] for part in SECONDS))])
            self._insert("numbers", [(identity, *number) for number in numbers])
            self._insert("checksums", [(identity, trial_checksum(self._db, identity))])

    def fail(self, trial: Trial, error: str) -> None:
        """Keep the traceback of a trial that failed."""
        with database.transaction(self._db):
            self._note(trial, "failed", error, None)

    def forget_failed(self) -> int:
        """Make the failed trials pending again; return how many."""
        with database.transaction(self._db):
            return self._db.execute("DELETE FROM trials WHERE state = 'failed'").rowcount

    def failed(self) -> list[tuple[str, int, str]]:
        """Return condition, seed and traceback of every failed trial."""
        return self._db.execute(
            "SELECT condition, seed, error FROM trials JOIN conditions USING (condition) "
            "WHERE state = 'failed' ORDER BY position, seed"
        ).fetchall()

    def counts(self) -> dict[str, int]:
        """Return how many trials are ``done`` and how many ``failed``."""
        query = "SELECT state, count(*) FROM trials GROUP BY state"
        return {"done": 0, "failed": 0} | dict(self._db.execute(query).fetchall())

    def phases(self) -> list[str]:
        """Return the phases that episodes were run in.

        First training and evaluation, then the stages of curricula and the further evaluations,
        each in their order, then others.
        """
        known = ["training", "evaluation"]
        query = "SELECT phase, min(episode) FROM episodes GROUP BY phase ORDER BY 2, 1"
        found = [phase for phase, _ in self._db.execute(query)]
        stages = [phase for phase in found if phase.startswith(STAGE)]
        evaluations = [f"{ELSEWHERE}{name}" for name in self._table("spec").get("evaluations", ())]
        ordered = [*known, *stages, *evaluations]
        return [phase for phase in ordered if phase in found] + sorted({*found} - {*ordered})

    def columns(self) -> dict[str, dict[str, Any]]:
        """Return what tells each condition from the others, by label; see `Condition`."""
        cursor = self._db.execute("SELECT * FROM conditions ORDER BY position")
        swept = [column[0] for column in cursor.description][2:]
        return {row[1]: dict(zip(swept, row[2:], strict=True)) for row in cursor}

    def rows(self, phase: str = "training") -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the column names and the rows of a phase, by condition, seed and episode."""
        cursor = self._db.execute("SELECT * FROM results WHERE phase = ?", (phase,))
        return [column[0] for column in cursor.description], cursor.fetchall()

    def episodes(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the column names and the rows of all phases, by condition, seed and episode."""
        cursor = self._db.execute("SELECT * FROM results")
        return [column[0] for column in cursor.description], cursor.fetchall()

    def trials(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the column names and one row per trial, by condition and seed.

        After the swept keys and the seed: its state, its identity, the last line of its traceback
        if it failed, the seconds of each part, and its `numbers`; None where there is no such.
        """
        swept = next(iter(self.columns().values()), {})
        names = [n for (n,) in self._db.execute("SELECT DISTINCT name FROM numbers ORDER BY name")]
        values = {
            (i, n): v for i, n, v in self._db.execute("SELECT identity, name, value FROM numbers")
        }
        cursor = self._db.execute(
            f"SELECT c.condition, {''.join(f'c.{database.quoted(key)}, ' for key in swept)}seed, "
            f"state, identity, error, {', '.join(SECONDS)} FROM trials "
            "JOIN conditions c USING (condition) LEFT JOIN seconds USING (identity) "
            "ORDER BY position, seed"
        )
        columns = [column[0] for column in cursor.description]
        identity, error = columns.index("identity"), columns.index("error")
        rows = []
        for row in cursor:
            last = (row[error] or "").rstrip().rpartition("\n")[2] or None
            measured = (values.get((row[identity], name)) for name in names)
            rows.append((*row[:error], last, *row[error + 1 :], *measured))
        return [*columns[: -len(SECONDS)], *(f"seconds.{part}" for part in SECONDS), *names], rows

    def seconds(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return the column names and the seconds of every part of every trial."""
        cursor = self._db.execute(
            f"SELECT condition, seed, {', '.join(SECONDS)} FROM seconds "
            "JOIN trials USING (identity) JOIN conditions USING (condition) ORDER BY position, seed"
        )
        return [column[0] for column in cursor.description], cursor.fetchall()

    def mean_seconds(self) -> dict[str, float]:
        """Return by condition how long its finished trials took on average [s]."""
        query = "SELECT condition, avg(total) FROM seconds JOIN trials USING (identity) GROUP BY 1"
        return dict(self._db.execute(query).fetchall())

    def numbers(self) -> list[tuple[str, int, str, float, bool]]:
        """Return condition, seed, name, value and whether it is a function of the trial."""
        cursor = self._db.execute(
            "SELECT condition, seed, n.name, value, repeatable FROM numbers n "
            "JOIN trials USING (identity) JOIN conditions USING (condition) "
            "ORDER BY position, seed, n.name"
        )
        return [(*row[:4], bool(row[4])) for row in cursor]

    def recording(self, trial: Identified, name: str) -> Recording:
        """Return a recorded episode of a trial, by its name in `Trial.recorded`."""
        return durable.read_recording(self._recordings(trial.identity), name)

    def _recordings(self, identity: str) -> Path:
        return self.directory / "recordings" / f"{identity}.npz"

    def _insert(self, table: str, rows: list[tuple[Any, ...]]) -> None:
        database.insert(self._db, table, rows)

    def _note(self, trial: Trial, state: str, error: str | None, digest: str | None) -> None:
        self._db.execute("DELETE FROM trials WHERE identity = ?", (trial.identity,))
        row = (trial.identity, trial.condition, trial.seed, state, error, digest, self._code)
        self._insert("trials", [row])


def _examined(directory: Path, given: _Given) -> str | None:
    """Return what is wrong with a directory's database, if anything is; refuse another study."""
    path = directory / DATABASE
    damage = integrity.damage(path) if path.exists() else None
    refusal = _refusal(directory, given, damaged=damage is not None)
    if refusal is not None:
        raise SpecError(refusal)
    return damage


def _refusal(directory: Path, given: _Given, *, damaged: bool) -> str | None:
    """Return why a spec may not be added to what a directory holds, in one line."""
    if not damaged and _holds_tables(directory):
        with Store.open(directory) as store:
            return store.refusal(given)
    path = directory / SPEC_FILE
    if not path.exists() or (old := Spec.load(path)) == given.spec:
        return None
    if not damaged:
        return f"{path}: is in the way of this study's own copy"
    settings = {c.label: c.settings.model_dump(mode="json") for c in old.conditions()}
    found = difference(old, settings, given.spec)
    return f"{directory}: holds another study: {found}" if found else None


def _holds_tables(directory: Path) -> bool:
    """Tell a study from nothing, and from a run that was killed before it had noted its spec."""
    path = directory / DATABASE
    if not path.exists():
        return False
    with database.reading(path) as db:
        return db.execute("SELECT 1 FROM sqlite_master").fetchone() is not None


def _take(lock: TextIO, directory: Path) -> None:
    """Take the lock of a directory; it is not waited for, but for a look at it."""
    for wait in (0.05, 0.1, 0.0):
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except OSError:
            time.sleep(wait)
    raise SpecError(f"{directory}: another process is writing there")
