"""Checksums of what a database says of a study as a whole, and of the rows of each trial."""

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator
from itertools import chain, groupby
from operator import itemgetter
from typing import NamedTuple

from pydantic_core import to_json


def study_checksum(db: sqlite3.Connection) -> str:
    """Return the SHA-256 of what the database says of the study as a whole."""
    queries = (
        "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY name",
        "SELECT key, value FROM meta WHERE key <> 'sha256' ORDER BY key",
        "SELECT * FROM conditions ORDER BY condition",
        "SELECT * FROM planned ORDER BY position",
    )
    return _sha256([db.execute(query).fetchall() for query in queries])


def trial_checksums(
    db: sqlite3.Connection, identity: str | None = None
) -> Iterator[tuple[str, str]]:
    """Yield the SHA-256 of all rows of each trial, or of one alone, after its identity.

    What has rows in any table counts as a trial.
    """
    for key, rows in _rows(db, identity):
        yield key, _sha256(rows)


def find_altered(db: sqlite3.Connection) -> list[str]:
    """Return the identities of trials whose rows are not those of their checksums."""
    lenient = db.text_factory
    try:
        db.text_factory = str  # takes a third less time
        return _find_altered(db)
    except sqlite3.OperationalError:  # a text is no UTF-8, or what comes again
        db.text_factory = lenient
        return _find_altered(db)
    finally:
        db.text_factory = lenient


def _find_altered(db: sqlite3.Connection) -> list[str]:
    written = dict(db.execute("SELECT identity, sha256 FROM checksums").fetchall())
    altered: list[str] = []
    for key, rows in _rows(db, None):
        digest = written.pop(key, None)
        if digest is not None and (digest == _quick_sha256(rows) or digest == _sha256(rows)):
            continue
        altered.append(key)
    return [*altered, *written]


RowsOfTable = Iterator[tuple[str, Iterable[tuple[object, ...]]]]
"""The identity of each trial, with its rows of a table."""


class RowsOfTrial(NamedTuple):
    """All that was written of a trial, in the order of its checksum."""

    trials: list[tuple[object, ...]]
    episodes: list[tuple[object, ...]]
    seconds: list[tuple[object, ...]]
    numbers: list[tuple[object, ...]]


def _rows(db: sqlite3.Connection, identity: str | None) -> Iterator[tuple[str, RowsOfTrial]]:
    """Yield the rows of each trial, or of one alone, after its identity.

    Tables are read from end to end, as asking for each of many trials on its own takes longer.
    """
    columns = "identity, condition, seed, state, recording_sha256, code, error"
    trials = _by_identity(db, identity, "trials", columns=columns)
    # Only what failed has a traceback; that of a finished trial is no part of its checksum.
    first = {key: [r[:-1] if r[-1] is None else r for r in rows] for key, rows in trials}
    seconds = {key: list(rows) for key, rows in _by_identity(db, identity, "seconds")}
    numbers = {key: list(rows) for key, rows in _by_identity(db, identity, "numbers", ", name")}
    for key, rows in _by_identity(db, identity, "episodes", ", phase, episode"):
        yield (
            key,
            RowsOfTrial(first.pop(key, []), list(rows), seconds.pop(key, []), numbers.pop(key, [])),
        )
    for key in first | seconds | numbers:
        yield key, RowsOfTrial(first.get(key, []), [], seconds.get(key, []), numbers.get(key, []))


def _by_identity(
    db: sqlite3.Connection, identity: str | None, table: str, order: str = "", columns: str = "*"
) -> RowsOfTable:
    where = "" if identity is None else "WHERE identity = ?"
    values = () if identity is None else (identity,)
    query = f"SELECT {columns} FROM {table} {where} ORDER BY identity{order}"
    return groupby(db.execute(query, values), itemgetter(0))


ENCODER = json.JSONEncoder(check_circular=False, default=repr)
"""Writes rows as text. A flipped type makes bytes of a text: hence the default."""


def _sha256(content: object) -> str:
    return hashlib.sha256(ENCODER.encode(content).encode()).hexdigest()


def _quick_sha256(rows: RowsOfTrial) -> str | None:
    """Return in less than half the time what `_sha256` does, or another digest, or None.

    The text of episodes is written by another library, which writes some numbers, as 1e-5, and
    some letters in another way. Different rows never have the same text.
    """
    episodes = rows.episodes
    if bytes in map(type, chain.from_iterable(episodes)):
        return None
    text = to_json(episodes, inf_nan_mode="constants")
    if episodes and text.count(b",") != len(episodes) * len(episodes[0]) - 1:  # a text has one
        return None
    before = ENCODER.encode(rows.trials).encode()
    after = ENCODER.encode([rows.seconds, rows.numbers])[1:].encode()
    parts = b"[", before, b", ", text.replace(b",", b", "), b", ", after
    return hashlib.sha256(b"".join(parts)).hexdigest()
