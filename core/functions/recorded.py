"""Recorded answers: what functions have answered is kept by what they were asked.

A question holds all that an answer may depend on: which function, its code and settings, what the
agent sees, remembers and has been told, and where its random numbers come from. So a study that is
run again, or continued after it was killed, calls nobody twice; and whoever is given the file has
the same rows. Every answer is kept the moment it arrives, with a checksum of question and answer.
Where two processes ask the same at the same time, both go on with the answer that was kept first.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

PATIENCE = 60.0
"""How long to wait for others who write [s]."""
TABLE = (
    "CREATE TABLE IF NOT EXISTS answers"
    " (sha256 TEXT PRIMARY KEY, question TEXT, answer TEXT, checksum TEXT) WITHOUT ROWID"
)
SHOWN = 200
"""Characters of a question that are shown."""


class AnswersError(ValueError):
    """Answers cannot be read, or one is missing: one line."""


class Merged(NamedTuple):
    """What has come of answers of another file."""

    added: int
    """How many were not known."""
    known: int
    """How many were."""
    other: int
    """How many of these were other answers to the same questions, which are left out."""


class RecordedAnswers:
    """The answers of one file.

    Parameters
    ----------
    path
        A SQLite database, made when the first answer is kept.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     answers = RecordedAnswers(Path(folder) / "answers.db")
    ...     first = answers.keep("who?", [1])
    ...     answers.find("who?"), answers.keep("who?", [2]), answers.find("why?")
    ([1], [1], None)
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._connection: sqlite3.Connection | None = None

    def find(self, question: str) -> Any:
        """Return the answer to a question; None if there is none.

        Raises
        ------
        AnswersError
            If the file cannot be read, or the answer is not what was kept.
        """
        if self._connection is None and not self.path.exists():
            return None
        with self._naming():
            row = self._db().execute(
                "SELECT question, answer, checksum FROM answers WHERE sha256 = ?",
                (_hash(question),),
            )
            kept = row.fetchone()
        return None if kept is None else json.loads(self._checked(*kept))

    def keep(self, question: str, answer: Any) -> Any:
        """Keep an answer, durably, and return the one that is kept: another, if it was first.

        Raises
        ------
        AnswersError
            If the file cannot be written.
        """
        value = canonical(answer)
        with self._naming(), self._db() as db:
            row = _hash(question), question, value, _hash(question, value)
            new = db.execute("INSERT OR IGNORE INTO answers VALUES (?, ?, ?, ?)", row)
        return json.loads(value) if new.rowcount else self.find(question)

    def merge(self, other: Path) -> Merged:
        """Keep the answers of another file, but for questions that have one here.

        Raises
        ------
        AnswersError
            If that one cannot be read, or one of its answers is not what was kept there.
        """
        if not other.is_file():
            raise AnswersError(f"{other}: no such file of answers")
        there = RecordedAnswers(other)
        uri = f"{other.absolute().as_uri()}?mode=ro"
        with there._naming(), closing(sqlite3.connect(uri, uri=True)) as db:
            rows = db.execute("SELECT question, answer, checksum FROM answers").fetchall()
        added = differing = 0
        with self._naming(), self._db() as db:
            for question, answer, checksum in rows:
                there._checked(question, answer, checksum)
                row = _hash(question), question, answer, checksum
                new = db.execute("INSERT OR IGNORE INTO answers VALUES (?, ?, ?, ?)", row)
                added += new.rowcount
                kept = db.execute("SELECT answer FROM answers WHERE sha256 = ?", row[:1])
                differing += kept.fetchone() != (answer,)
        return Merged(added, len(rows) - added, differing)

    def __len__(self) -> int:
        if not self.path.exists():
            return 0
        with self._naming():
            return int(self._db().execute("SELECT count(*) FROM answers").fetchone()[0])

    def missing(self, question: str) -> AnswersError:
        """Return what is to be told of a question that nobody may be asked."""
        shown = question if len(question) <= SHOWN else f"{question[:SHOWN]}..."
        return AnswersError(f"{self.path} has no answer, and no calls are allowed: {shown}")

    def close(self) -> None:
        """Close the file."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _db(self) -> sqlite3.Connection:
        if self._connection is None:
            self._connection = sqlite3.connect(self.path, timeout=PATIENCE)
            self._connection.execute("PRAGMA journal_mode = TRUNCATE")
            self._connection.execute("PRAGMA synchronous = FULL")
            with self._connection as db:
                db.execute(TABLE)
        return self._connection

    @contextmanager
    def _naming(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise AnswersError(f"{self.path}: answers cannot be read or kept: {error}") from None

    def _checked(self, question: str, answer: str, checksum: str) -> str:
        if _hash(question, answer) != checksum:
            raise AnswersError(
                f"{self.path}: is damaged, an answer is not what was kept: {question[:SHOWN]}"
            )
        return answer


def canonical(value: object) -> str:
    """Return the one JSON text of a value.

    Raises
    ------
    ValueError
        If JSON does not hold it; one line.
    """
    try:
        return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{value!r:.60}: {error}; allowed: what JSON holds") from None


def _hash(*texts: str) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()
