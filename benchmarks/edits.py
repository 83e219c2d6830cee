"""Studies and results that somebody else has edited, for `benchmarks.adversary`.

*Edits* are made in the database of a finished study by SQL. Each may be without effect, or it is
told by every command that reads. *Published* files of results are mutated as JSON or as bytes; they
have no checksums, so that other numbers are accepted; what is no result is refused in one line.
Both also name modules of somebody else, which must never be imported.
"""

from __future__ import annotations

import contextlib
import io
import json
import random
import shutil
import sqlite3
import sys
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nested_agents.studies.api.loading import load
from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.store.database import DATABASE

from .victim import EXPLAIN, LINES, Adversary, mended, read, without_figures

PAYLOAD = "payload_of_others"
"""A module that must not be imported."""
VALUES: tuple[Any, ...] = (
    None, 0, 1, -1, 2**62, 1e308, -1e-308, float("inf"), "", "x", "1", b"\xff", "\x1b[2J", "{}",
    "[]", "null", "done", "failed", f"{PAYLOAD}.go:Study", '{"study": "' + PAYLOAD + '.go:Study"}',
    "x" * 100_000, "[" * 50_000,
)  # fmt: skip
COMMANDS = ("table", "compare", "table --format json")


def sql(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Edit a study's database again and again; return what happened."""
    without_figures()
    _offer_payload(folder)
    adversary, tally = Adversary(folder, rng, (*LINES, EXPLAIN)), Counter[str]()
    path = adversary.study / DATABASE
    while tally["edits"] < number:
        with contextlib.closing(sqlite3.connect(path)) as database:
            statement, values = _statement(database, rng)
            try:
                with database:
                    changed = database.execute(statement, values).rowcount
            except sqlite3.Error:
                continue
        if changed == 0:
            continue
        tally["edits"] += 1
        shown = f"{statement} {str(values)[:60]}"
        for line in (*LINES, *([EXPLAIN] if tally["edits"] % 10 == 0 else [])):
            tally["reads"] += 1
            became = read(adversary, line, path)
            if became in ("silence", "traceback"):
                print(f"  by: {shown}", file=sys.stderr)
            tally[became] += 1
        tally["runs"] += 1
        became = mended(adversary, path)
        if became not in ("run: equal", "run: refused"):
            print(f"  {became}, by: {shown}", file=sys.stderr)
        tally[became] += 1
        tally["not trusted and run"] += PAYLOAD in sys.modules
        adversary.restore()
    return tally


def _statement(database: sqlite3.Connection, rng: random.Random) -> tuple[str, tuple[Any, ...]]:
    """Return an edit of a database."""
    names = [n for (n,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
    table = rng.choice(names)
    columns = [row[1] for row in database.execute(f'PRAGMA table_info("{table}")')]
    one, other = (f'"{rng.choice(columns)}"' for _ in range(2))
    keys = list(database.execute(f'SELECT * FROM "{table}"'))
    at = rng.choice(keys) if keys else [None] * len(columns)
    this = " AND ".join(f'"{column}" IS ?' for column in columns)
    held = ", ".join("?" * len(columns))
    changed = list(at)
    changed[rng.randrange(len(columns))] = rng.choice([*VALUES, *rng.choice(keys or [[None]])])
    near = at[columns.index(one[1:-1])]
    value = (
        near * 1.5 + 1 if isinstance(near, float) else near + 1 if isinstance(near, int) else "y"
    )
    kinds: list[tuple[str, tuple[Any, ...]]] = [
        (f'UPDATE "{table}" SET {one} = ? WHERE {this}', (rng.choice(VALUES), *at)),
        (f'UPDATE "{table}" SET {one} = ? WHERE {this}', (value, *at)),
        (f'UPDATE "{table}" SET {one} = {other}', ()),
        (f'DELETE FROM "{table}" WHERE {this}', tuple(at)),
        (f'DELETE FROM "{table}"', ()),
        (f'INSERT INTO "{table}" VALUES ({held})', tuple(changed)),
        (f'INSERT OR REPLACE INTO "{table}" VALUES ({held})', tuple(changed)),
        (f'DROP TABLE "{table}"', ()),
        (f'ALTER TABLE "{table}" RENAME COLUMN {one} TO "another"', ()),
        (f'ALTER TABLE "{table}" ADD COLUMN "added" TEXT DEFAULT 1', ()),
        (f'ALTER TABLE "{table}" RENAME TO "another"', ()),
        (f'CREATE TRIGGER t AFTER INSERT ON "{table}" BEGIN DELETE FROM "{table}"; END', ()),
        (f"PRAGMA user_version = {rng.choice([0, 1, 99])}", ()),
        (f"PRAGMA application_id = {rng.choice([0, 1, 99])}", ()),
        ("DROP VIEW results", ()),
        (f'CREATE TABLE more AS SELECT * FROM "{table}"', ()),
    ]  # fmt: skip
    return rng.choices(kinds, [6, 6, 2, 4, 2, 5, 3, 1, 1, 1, 1, 1, 1, 1, 0.3, 0.5])[0]


def published(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Offer mutated files of results; return what became of them."""
    _offer_payload(folder)
    adversary, tally = Adversary(folder, rng), Counter[str]()
    path = folder / "results.json"
    sound = _published_text(adversary, folder)
    for _ in range(number):
        tally["published files"] += 1
        path.write_bytes(_mutated(sound, rng))
        for line in COMMANDS:
            name, *options = line.split()
            became = _answer(lambda c=[name, str(path), *options]: command_line(c), path.name)
            tally[f"published files: {became}"] += 1
        tally["not trusted and run"] += PAYLOAD in sys.modules
    return tally


def _published_text(adversary: Adversary, folder: Path) -> str:
    """Return the results of the study as they are published."""
    from nested_agents.studies.results import published as format_published

    study = load(adversary.study)
    return format_published.dumps(study.outline, study.results)


def _answer(command: Callable[[], int], name: str) -> str:
    """Run a command; return what it says of a file."""
    out, error = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = command()
    except BaseException:
        print(traceback.format_exc(), file=sys.stderr)
        return "traceback"
    if not (out.getvalue() + error.getvalue()).replace("\n", "").isprintable():
        return "raw"
    if status == 0:
        return "accepted"
    text = error.getvalue()
    is_one_line = text.count("\n") == 1 and "Traceback" not in text and status == 2
    if not is_one_line:
        print(text, file=sys.stderr)
    return "refused in one line" if is_one_line else "refused at length"


def _mutated(sound: str, rng: random.Random) -> bytes:
    """Return a file of results in which a few things are otherwise."""
    kind = rng.randrange(8)
    data = bytearray(sound.encode())
    if kind == 0:
        for _ in range(rng.randrange(1, 4)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return bytes(data)
    if kind == 1:
        return bytes(data[: rng.randrange(len(data))])
    if kind == 2:
        depth = rng.choice([100, 100_000])
        at = sound.index(rng.choice(['"spec": ', '"seeds": ', '"phases": ', '"columns": ']))
        return (sound[:at] + '"x": ' + "[" * depth + "]" * depth + ", " + sound[at:]).encode()
    content = json.loads(sound)
    for _ in range(rng.randrange(1, 3)):
        _mutate(content, rng)
    return json.dumps(content).encode("utf-8", "surrogatepass")


def _mutate(content: Any, rng: random.Random) -> None:
    """Change one thing at some depth of JSON."""
    values: list[Any] = [value for value in VALUES if not isinstance(value, bytes)]
    values += [10**400, [], {}, [[]], [1e308] * 3, True, "\ud800", {"shape": [10**9], "of": 1}]
    holder = content
    while True:
        keys = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
        if not keys:
            return
        key = rng.choice(keys)
        if not isinstance(holder[key], dict | list) or rng.random() < 0.25:
            break
        holder = holder[key]
    act = rng.randrange(4)
    if act == 0:
        del holder[key]
    elif act == 1 and isinstance(holder, dict):
        holder[rng.choice(["x", "\x1b[2J", "", "k" * 5000, "kind", "study"])] = holder.pop(key)
    elif act == 2 and isinstance(holder, list):
        holder.insert(key, rng.choice(holder))
    else:
        holder[key] = rng.choice(values)


def _offer_payload(folder: Path) -> None:
    """Put a module of somebody else where Python looks first."""
    package = folder / PAYLOAD
    shutil.rmtree(package, ignore_errors=True)
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "go.py").write_text("class Study:\n    pass\n")
    sys.path.insert(0, str(folder))
