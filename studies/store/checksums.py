"""Checksums of what a database says of a study as a whole, and of the rows of each trial."""

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator
from itertools import chain, groupby
from operator import itemgetter


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

    What has rows in any table counts as a trial. Tables are read from end to end, as asking for
    each of many trials on its own takes longer.
    """
    columns = "identity, condition, seed, state, recording_sha256, code, error"
    trials = _by_identity(db, identity, "trials", columns=columns)
    # Only what failed has a traceback; that of a finished trial is no part of its checksum.
    first = {key: [r[:-1] if r[-1] is None else r for r in rows] for key, rows in trials}
    seconds = {key: list(rows) for key, rows in _by_identity(db, identity, "seconds")}
    numbers = {key: list(rows) for key, rows in _by_identity(db, identity, "numbers", ", name")}
    seen: set[str] = set()
    without: Rows = ((key, ()) for key in first | seconds | numbers if key not in seen)
    for key, rows in chain(_by_identity(db, identity, "episodes", ", phase, episode"), without):
        seen.add(key)
        parts = first.get(key, []), list(rows), seconds.get(key, []), numbers.get(key, [])
        yield key, _sha256(parts)


Rows = Iterator[tuple[str, Iterable[tuple[object, ...]]]]
"""The identity of each trial, with its rows of a table."""


def _by_identity(
    db: sqlite3.Connection, identity: str | None, table: str, order: str = "", columns: str = "*"
) -> Rows:
    where = "" if identity is None else "WHERE identity = ?"
    values = () if identity is None else (identity,)
    query = f"SELECT {columns} FROM {table} {where} ORDER BY identity{order}"
    return groupby(db.execute(query, values), itemgetter(0))


ENCODER = json.JSONEncoder(check_circular=False, default=repr)
"""Writes rows as text. A flipped type makes bytes of a text: hence the default."""


def _sha256(content: object) -> str:
    return hashlib.sha256(ENCODER.encode(content).encode()).hexdigest()
