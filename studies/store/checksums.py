"""Checksums of the study as a whole and of each trial's rows."""

import hashlib
import sqlite3
from collections import defaultdict
from itertools import groupby
from operator import itemgetter

from pydantic_core import to_json

TRIAL_TABLES = {
    "trials": "identity, condition, seed, state, error, recording_sha256, code",
    "seconds": "*",
    "numbers": "*",
    "episodes": "*",
}
"""Columns that the checksum of a trial covers, by table."""
ROW_ORDER = {"episodes": ", phase, episode", "numbers": ", name"}
"""Order of a trial's rows in tables with several rows."""


def study_checksum(db: sqlite3.Connection) -> str:
    """Return the SHA-256 of the tables that describe the study as a whole."""
    queries = (
        "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY name",
        "SELECT key, value FROM meta WHERE key <> 'sha256' ORDER BY key",
        "SELECT * FROM conditions ORDER BY condition",
        "SELECT * FROM planned ORDER BY position",
    )
    return hashlib.sha256(_encode([db.execute(query).fetchall() for query in queries])).hexdigest()


def trial_checksums(db: sqlite3.Connection, identity: str | None = None) -> dict[str, str]:
    """Return the SHA-256 of the rows of each trial by identity, or of a single trial.

    An identity with rows in any table counts as a trial.
    """
    where = "" if identity is None else "WHERE identity = ?"
    values = () if identity is None else (identity,)
    digests = defaultdict[str, "hashlib._Hash"](hashlib.sha256)
    for table, columns in TRIAL_TABLES.items():
        order = f"identity{ROW_ORDER.get(table, '')}"
        query = f"SELECT {columns} FROM {table} {where} ORDER BY {order}"
        for key, rows in groupby(db.execute(query, values), itemgetter(0)):
            digests[key].update(_encode((table, list(rows))))
    return {key: digest.hexdigest() for key, digest in digests.items()}


def find_altered(db: sqlite3.Connection) -> list[str]:
    """Return the identities of trials with rows that do not match their checksums."""
    written: dict[str, str] = dict(db.execute("SELECT identity, sha256 FROM checksums").fetchall())
    present = trial_checksums(db)
    # An identity without rows has the checksum "", because a damaged checksum may be NULL.
    return sorted(k for k in written | present if written.get(k) != present.get(k, ""))


def _encode(content: object) -> bytes:
    """Return rows as JSON. A text and the same text as bytes differ, as do 1 and 1.0."""
    return to_json(content, inf_nan_mode="constants", bytes_mode="base64")
