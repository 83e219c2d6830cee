"""Recorded answers: each answer is stored under the question that it answers.

A question contains everything that an answer depends on. Every answer is stored as soon as it
arrives, with a checksum of question and answer. If two processes ask the same question at the same
time, both continue with the answer that was stored first.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

LOCK_TIMEOUT_S = 60.0
"""Maximum time to wait for another process that writes [s]."""
TABLE = (
    "CREATE TABLE IF NOT EXISTS answers"
    " (sha256 TEXT PRIMARY KEY, question TEXT, answer TEXT, checksum TEXT) WITHOUT ROWID"
)
SHOWN_CHARACTERS = 200
"""Maximum number of characters of a question in a message."""


class RecordError(ValueError):
    """The file cannot be read or written, or an answer in it is damaged."""


class RecordedAnswers:
    """The answers in one SQLite file, which is created with the first answer.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     answers = RecordedAnswers(Path(folder) / "answers.db")
    ...     first = answers.store("who?", [1])
    ...     answers.find("who?"), answers.store("who?", [2]), answers.find("why?")
    ([1], [1], None)
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def find(self, question: str) -> Any:
        """Return the answer to a question; None if it is not recorded.

        Raises
        ------
        RecordError
            If the file cannot be read, or the answer is damaged.
        """
        if not self.path.exists():
            return None
        with self._connection() as db:
            rows = db.execute(
                "SELECT answer, checksum FROM answers WHERE sha256 = ?", (_hash(question),)
            )
            row = rows.fetchone()
        if row is None:
            return None
        answer, checksum = row
        if _hash(question, answer) != checksum:
            raise RecordError(f"{self.path}: a recorded answer is damaged: {shorten(question)}")
        return json.loads(answer)

    def store(self, question: str, answer: Any) -> Any:
        """Store an answer durably; return the stored one, which another process may have written.

        Raises
        ------
        RecordError
            If the file cannot be written.
        """
        text = canonical(answer)
        row = _hash(question), question, text, _hash(question, text)
        with self._connection() as db, db:
            new = db.execute("INSERT OR IGNORE INTO answers VALUES (?, ?, ?, ?)", row).rowcount
        return json.loads(text) if new else self.find(question)

    def __len__(self) -> int:
        with self._connection() as db:
            return int(db.execute("SELECT count(*) FROM answers").fetchone()[0])

    @contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection]:
        try:
            db = sqlite3.connect(self.path, timeout=LOCK_TIMEOUT_S)
            try:
                db.execute("PRAGMA synchronous = FULL")
                db.execute(TABLE)
                yield db
            finally:
                db.close()
        except sqlite3.Error as error:
            raise RecordError(f"{self.path}: answers cannot be read or stored: {error}") from None


def shorten(question: str) -> str:
    """Return the beginning of a question for a message."""
    return question if len(question) <= SHOWN_CHARACTERS else f"{question[:SHOWN_CHARACTERS]}..."


def canonical(value: object) -> str:
    """Return the unique compact JSON text of a value."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _hash(*texts: str) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()
