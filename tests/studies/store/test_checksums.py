"""Checksums of trials detect every change of their rows."""

import sqlite3
from contextlib import closing
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nested_agents.studies.store.checksums import find_altered, trial_checksums

SCHEMA = """
CREATE TABLE trials (identity, condition, seed, state, recording_sha256, code, error);
CREATE TABLE episodes (identity, phase, episode, steps, measure, PRIMARY KEY (identity, episode));
CREATE TABLE seconds (identity, total);
CREATE TABLE numbers (identity, name, value, repeatable);
CREATE TABLE checksums (identity PRIMARY KEY, sha256);
"""
PLAIN = [(0.5, 0.25), (1e-5, 1e16), (-0.0, 123456789012345680.0), (float("inf"), None), (1, 2**62)]
VALUES = st.one_of(
    st.none(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False), st.binary(max_size=6),
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=6),
)  # fmt: skip


def written(rows):
    """Return a database of trials `a` and `b` with some values of an episode, as it was written."""
    db = sqlite3.connect(":memory:", isolation_level=None)
    db.text_factory = partial(str, encoding="utf-8", errors="replace")
    db.executescript(SCHEMA)
    for identity in "ab":
        trial = (identity, "chain, 2 robots", 0, "done", None, "", None)
        db.execute("INSERT INTO trials VALUES (?, ?, ?, ?, ?, ?, ?)", trial)
        db.execute("INSERT INTO seconds VALUES (?, 3e-5)", identity)
        episodes = [(identity, phase, i, 1, value) for i, (phase, value) in enumerate(rows)]
        db.executemany("INSERT INTO episodes VALUES (?, ?, ?, ?, ?)", episodes)
    db.executemany("INSERT INTO checksums VALUES (?, ?)", trial_checksums(db).items())
    return closing(db)


@pytest.mark.parametrize("rows", [*([row] for row in PLAIN), PLAIN, [("a, b", "ü"), ("a,b", b"x")]])
def test_what_was_written_is_sound(rows):
    with written(rows) as db:
        assert find_altered(db) == []


@given(st.lists(st.tuples(VALUES, VALUES), min_size=1, max_size=3), VALUES)
def test_whatever_is_altered_is_named(rows, other):
    with written(rows) as db:
        assert find_altered(db) == []
        before = trial_checksums(db)
        db.execute("UPDATE episodes SET measure = ? WHERE identity = 'b' AND episode = 0", (other,))
        same = trial_checksums(db) == before
        assert find_altered(db) == ([] if same else ["b"])


@pytest.mark.parametrize(
    ("before", "after"),
    [("a, b", "a,b"), ("a", b"a"), (0.0, -0.0), (1, 1.0), (None, "null")],
)
def test_what_would_look_alike_is_told_apart(before, after):
    with written([(before, 0.5)]) as db:
        db.execute("UPDATE episodes SET phase = ? WHERE identity = 'a'", (after,))
        assert find_altered(db) == ["a"]


def test_text_that_is_no_text_any_more_and_checksums_that_are_gone():
    with written([("training", 0.5)]) as db:
        db.execute("UPDATE episodes SET phase = CAST(x'74ff' AS TEXT) WHERE identity = 'a'")
        assert find_altered(db) == ["a"]
        db.execute("UPDATE checksums SET sha256 = NULL WHERE identity = 'b'")
        assert find_altered(db) == ["a", "b"]
        db.execute("DELETE FROM trials")
        db.execute("DELETE FROM episodes")
        db.execute("DELETE FROM seconds")
        assert find_altered(db) == ["a", "b"]
