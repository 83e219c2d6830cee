import json
import random
import re
import shutil
import sqlite3
import subprocess
import sys

import made_up
import pytest

import nested_agents as na
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.report import page
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import DATABASE, SPEC_FILE, TABLES_OF_TRIALS
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.workers.runner import save


def finish(directory):
    """Run what is left; return what had to be said and how many trials ran."""
    with made_up.opened(directory) as store:
        left = pending(store, made_up.TRIALS)
        for trial in left:
            save(store, trial, made_up.measure(trial), 1.5)
        return store.notes, len(left)


def content(directory):
    with Store.open(directory) as store:
        store.verify()
        rows = list(store.episodes()[1]), store.numbers()
    return rows, {p.name: p.read_bytes() for p in (directory / "recordings").iterdir()}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    directory = tmp_path_factory.mktemp("sound") / "study"
    assert finish(directory) == ([], 6)
    return directory


@pytest.fixture
def study(sound, tmp_path):
    return shutil.copytree(sound, tmp_path / "study")


def change(directory, statement, *values):
    with sqlite3.connect(directory / DATABASE) as db:
        db.execute("PRAGMA writable_schema = ON")
        db.execute(statement, values)
    db.close()


def test_what_is_sound_is_left_alone(study, sound):
    before = {p: p.stat().st_mtime_ns for p in (study / "recordings").iterdir()}
    assert finish(study) == ([], 0)
    assert {p: p.stat().st_mtime_ns for p in (study / "recordings").iterdir()} == before
    assert content(study) == content(sound)


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE episodes SET steps = steps + 1 WHERE identity = ? AND phase = 'training'",
        "UPDATE seconds SET total = 3.0 WHERE identity = ?",
        "UPDATE trials SET seed = 7 WHERE identity = ?",
        "UPDATE checksums SET sha256 = 'x' WHERE identity = ?",
        "DELETE FROM episodes WHERE identity = ? AND episode = 1",
        "DELETE FROM trials WHERE identity = ?",
    ],
)
def test_a_changed_row_is_named_and_its_trial_alone_runs_again(study, sound, statement, capsys):
    trial = made_up.TRIALS[3]
    change(study, statement, trial.identity)
    where = f"{study / DATABASE}: {trial.condition}, seed "
    for command in ("results", "export"):
        assert main([command, str(study)]) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert where in err
        assert "rows are damaged" in err
    (note,), ran = finish(study)
    assert (note, ran) == (f"{where}{trial.seed}: rows are damaged; must run again", 1)
    assert content(study) == content(sound)


@pytest.mark.parametrize("damage", ["missing", "damaged"])
def test_a_recording_is_named_and_its_trial_alone_runs_again(study, sound, damage):
    trial = made_up.TRIALS[2]
    path = study / "recordings" / f"{trial.identity}.npz"
    if damage == "missing":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:-9])
    (note,), ran = finish(study)
    assert ran == 1
    assert note == f"{path}: is {damage} ({trial.condition}, seed {trial.seed}); must run again"
    assert content(study) == content(sound)


def files(directory):
    return {p: p.read_bytes() for p in directory.rglob("*") if p.is_file()}


def refused(directory, capsys, reason="is damaged: "):
    """Assert that readers and `run` refuse a damaged database in one line and change nothing."""
    before = files(directory)
    for command in ("results", "table", "compare", "export", "report", "status"):
        name, *options = command.split()
        assert main([name, str(directory), *options]) == 2, command
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert f"{directory / DATABASE}: {reason}" in err
    with pytest.raises(SpecError, match=re.escape(reason)):
        finish(directory)
    assert files(directory) == before


@pytest.mark.parametrize(
    ("statement", "value"),
    [
        ("UPDATE meta SET value = ? WHERE key = 'spec'", json.dumps({"seeds": 5})),
        ("UPDATE meta SET value = ? WHERE key = 'conditions'", "{"),
        ("UPDATE conditions SET preset = ? WHERE position = 1", "paper"),
        ("UPDATE sqlite_master SET sql = replace(sql, 't.seed', ?) WHERE name = 'results'", "9"),
        ("UPDATE planned SET seed = ? WHERE seed = 1", 9),
        ("UPDATE meta SET value = ? WHERE key = 'results_version'", "x"),
    ],
)
def test_a_changed_description_of_the_study_is_refused(study, statement, value, capsys):
    change(study, statement, value)
    refused(study, capsys)


@pytest.mark.parametrize("content", ["truncated", "no database", "no tables"])
def test_a_damaged_database_is_refused_and_nothing_is_overwritten(study, content, capsys):
    path = study / DATABASE
    data = bytearray(path.read_bytes())
    if content == "truncated":
        data = data[:-5000]
    elif content == "no database":
        data = b"no database at all"
    else:
        data[103:105] = bytes(2)  # the number of tables on the first page
    path.write_bytes(data)
    refused(study, capsys)


def test_a_database_that_may_not_be_read_is_not_damaged(study, monkeypatch):
    def refuse(*_, **__):
        error = sqlite3.OperationalError("database is locked")
        error.sqlite_errorcode = sqlite3.SQLITE_BUSY
        raise error

    monkeypatch.setattr(sqlite3, "connect", refuse)
    with (
        pytest.raises(SpecError, match=r"database is locked$"),
        made_up.opened(study),
    ):
        pass


@pytest.mark.slow
def test_after_a_flipped_bit_a_study_ends_with_the_same_or_is_refused(sound, tmp_path):
    rng = random.Random(7)
    expected = content(sound)
    names = [DATABASE] * 4 + [f"recordings/{t.identity}.npz" for t in made_up.TRIALS[:2]]
    for number in range(20):
        study = shutil.copytree(sound, tmp_path / str(number))
        path = study / rng.choice(names)
        data = bytearray(path.read_bytes())
        where = rng.randrange(len(data))
        data[where] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        try:
            finish(study)
        except SpecError:
            assert path.name == DATABASE
        else:
            assert content(study) == expected, (path.name, where)
        shutil.rmtree(study)


def test_a_database_that_is_no_study_is_left_alone(tmp_path):
    with sqlite3.connect(tmp_path / DATABASE) as connection:
        connection.execute("CREATE TABLE precious (x)")
    before = (tmp_path / DATABASE).read_bytes()
    refused = pytest.raises(SpecError, match="is a database, but no study")
    with refused, made_up.opened(tmp_path):
        pass
    assert (tmp_path / DATABASE).read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} <= {DATABASE, ".lock"}


@pytest.mark.parametrize("name", [".lock", "recordings", DATABASE, f"{DATABASE}-journal"])
def test_what_is_in_the_way_of_a_file_is_named(study, name, tmp_path, capsys):
    path = study / name
    if path.is_dir():
        shutil.rmtree(path)
        path.touch()
    else:
        path.unlink(missing_ok=True)
        path.mkdir()
    with pytest.raises(SpecError, match=re.escape(f"{path}: ")) as caught:
        finish(study)
    assert "\n" not in str(caught.value)


def test_a_journal_that_leads_nowhere_is_named(study, capsys):
    path = study / f"{DATABASE}-journal"
    path.symlink_to(study / "nowhere")
    for command in ("results", "status"):
        assert main([command, str(study)]) == 2
        assert f"{path}: must be a file" in capsys.readouterr().err


def test_an_unreadable_copy_of_the_spec_is_replaced(study):
    (study / SPEC_FILE).write_bytes(b'preset = "fefault"\n\xff')
    assert finish(study) == ([], 0)
    assert Spec.load(study / SPEC_FILE) == made_up.SPEC


def small(directory):
    """Three of four trials are done, one has failed."""
    spec = made_up.Spec.of(made_up.SPEC.table() | {"seeds": 2, "episodes": 1, "evaluation": 1})
    trials = made_up.trials_of(spec)
    with made_up.opened(directory, spec) as store:
        for trial in trials[:3]:
            save(store, trial, made_up.measure(trial), 1.5)
        store.fail(trials[3], "Traceback:\nRuntimeError: a wheel came off")
    return directory


def told(directory, capsys):
    """Return what the commands that read say: status, output, complaints."""
    said = []
    for command in ("results --format csv", "status"):
        name, *options = command.split()
        said.append((main([name, str(directory), *options]), *capsys.readouterr()))
    return said


def flipped_bits_are_told(directory, places, rng, capsys):
    """Flip a bit in each byte at `places` of a database: equal output, or its file is named."""
    path, expected = directory / DATABASE, told(directory, capsys)
    whole, equal = path.read_bytes(), 0
    for at in places(len(whole)):
        data = bytearray(whole)
        data[at] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        for found, sound in zip(told(directory, capsys), expected, strict=True):
            named = DATABASE in found[1] + found[2] and "Traceback (most" not in found[2]
            assert found == sound or named, (at, found)
            equal += found == sound
    return equal


def test_no_flipped_bit_is_passed_over_in_silence(tmp_path, capsys):
    study, rng = small(tmp_path / "study"), random.Random(5)
    sound = (study / DATABASE).read_bytes()
    # Pages are mostly empty: what is not empty, and some that is.
    used = [at for at, byte in enumerate(sound) if byte]
    flipped_bits_are_told(study, lambda n: used[::97], rng, capsys)
    flipped_bits_are_told(study, lambda n: range(0, n, 3989), rng, capsys)


def test_trials_without_a_checksum_are_named_by_every_reader(study, capsys):
    change(study, "DELETE FROM checksums")
    for command in ("results", "table", "export", "report", "status"):
        status = main([command, str(study)])
        out, err = capsys.readouterr()
        assert f"{DATABASE}: " in out + err
        assert (status, err.count("\n")) == (2, 1) or command == "status"


INVENTED = {
    "trials": "INSERT INTO trials SELECT 'x', condition, 99, state, error, recording_sha256, code "
    "FROM trials WHERE identity = ?",
    "episodes": "INSERT INTO episodes SELECT 'x', phase, episode, steps, success, stopped_at_goal, "
    'final_distance_m, contact_fraction, "return" '
    "FROM episodes WHERE identity = ?",
    "seconds": "INSERT INTO seconds SELECT 'x', decision, physics, sensors, learning, total "
    "FROM seconds WHERE identity = ?",
    "numbers": "INSERT INTO numbers SELECT 'x', phase, 1.0, 1 FROM episodes "
    "WHERE identity = ? AND episode = 0",
}
"""What adds rows of a trial that nobody ran, of the values of one that was."""


@pytest.mark.parametrize("tables", [*([table] for table in INVENTED), [*INVENTED]])
def test_rows_that_no_run_wrote_are_reported_and_never_counted(study, tables, capsys):
    for table in tables:
        change(study, INVENTED[table], made_up.TRIALS[3].identity)
    name = "frozen, seed 99" if "trials" in tables else "trial x"
    refused(
        study, capsys, f"is damaged: it holds rows of a trial that is not of this study: {name}"
    )
    with pytest.raises(SpecError, match="not of this study"):
        na.load(study)


@pytest.mark.parametrize("table", TABLES_OF_TRIALS)
@pytest.mark.parametrize(
    "edit", ["DELETE FROM {}", "DELETE FROM {} WHERE identity = (SELECT max(identity) FROM {})"]
)
def test_run_restores_deleted_rows(study, sound, table, edit):
    change(study, edit.replace("{}", table))
    finish(study)
    assert content(study) == content(sound)
    assert finish(study) == ([], 0)


@pytest.mark.parametrize("table", ["trials", "episodes", "seconds", "checksums"])
@pytest.mark.parametrize(
    "edit", ["ALTER TABLE {} ADD COLUMN added TEXT", "UPDATE {} SET identity = 'x' || identity"]
)
def test_an_edited_table_is_refused(study, table, edit, capsys):
    change(study, edit.replace("{}", table))
    refused(study, capsys)


@pytest.mark.parametrize(
    ("before", "after"), [("default", "fefault"), ("episodes = 4", "episodes = 5"), ("=", "5")]
)
def test_a_damaged_copy_of_the_spec_is_no_other_study(study, before, after, capsys):
    path = study / SPEC_FILE
    path.write_text(path.read_text().replace(before, after, 1))
    assert main(["run", str(path), "--out", str(study)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{study}" in error
    assert f"nested-agents retry {study} continues from the database" in error


def test_a_study_of_a_newer_version_is_refused(study, capsys):
    change(study, "UPDATE meta SET value = '99' WHERE key = 'results_version'")
    refused(study, capsys, "holds results of version 99, this is version")


def test_a_study_of_an_older_version_is_read_and_not_continued(study, capsys, monkeypatch):
    monkeypatch.setattr(learning_curve, "draw", lambda analysis: {})
    monkeypatch.setattr(page, "hierarchy_pictures", lambda store: ([], ""))
    expected = {}
    commands = ("table", "compare", "results --format csv", "report", "status")
    commands += ("export --overwrite",)
    for command in commands:
        name, *options = command.split()
        assert main([name, str(study), *options]) == 0
        expected[command] = capsys.readouterr().out
    change(study, "UPDATE meta SET value = '1' WHERE key = 'results_version'")
    before = (study / DATABASE).read_bytes()
    for command in commands:
        name, *options = command.split()
        assert main([name, str(study), *options]) == 0, command
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        if command not in ("status", "report"):
            assert set(expected[command].splitlines()) <= set(out.splitlines())
        if command in ("table", "compare", "status"):
            assert (out + err).count("holds results of version 1") == 1
    assert "holds results of version 1" in (study / "report.html").read_text()
    for line in (["retry", str(study)], ["run", str(study / SPEC_FILE), "--out", str(study)]):
        assert main(line) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert "holds results of version 1" in error
        assert "run does not continue them" in error
    assert (study / DATABASE).read_bytes() == before


WITH_LITTLE_MEMORY = """
import sqlite3, sys
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main
learning_curve.draw = lambda analysis: {}
of_all = sqlite3.connect(":memory:")
try:
    for limit in range(340_000, 0, -48_000):  # it cannot be raised again
        of_all.execute(f"PRAGMA hard_heap_limit = {limit}")
        print(main(sys.argv[1:]))
except MemoryError:
    pass  # for the limit itself
"""


@pytest.mark.parametrize("command", ["status", "retry"])
def test_no_memory_is_no_damage(study, sound, command):
    line = [sys.executable, "-c", WITH_LITTLE_MEMORY, command, str(study)]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    errors = {*done.stderr.splitlines()}
    assert "2" in done.stdout.split()
    assert {line for line in errors if "error" in line} == {
        "nested-agents: error: not enough memory"
    }
    assert content(study) == content(sound)
