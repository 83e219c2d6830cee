import json
import random
import re
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import replace

import made_up
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store import integrity
from nested_agents.studies.store.checksums import trial_checksums
from nested_agents.studies.store.database import DATABASE, OF_A_TRIAL, SPEC_FILE
from nested_agents.studies.store.store import Store
from nested_agents.studies.store.writer import lock_directory
from nested_agents.studies.trials.keeping import notes_of, pending
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


@pytest.mark.parametrize(
    ("statement", "value"),
    [
        ("UPDATE meta SET value = ? WHERE key = 'spec'", json.dumps({"seeds": 5})),
        ("UPDATE meta SET value = ? WHERE key = 'conditions'", "{"),
        ("UPDATE conditions SET preset = ? WHERE position = 1", "paper"),
        ("UPDATE sqlite_master SET sql = replace(sql, 't.seed', ?) WHERE name = 'results'", "9"),
    ],
)
def test_what_concerns_the_study_as_a_whole_has_a_checksum_too(study, sound, statement, value):
    change(study, statement, value)
    notes, ran = finish(study)
    assert ran == 0
    assert notes == [
        f"{study / DATABASE}: is damaged: what it says of the study is not what was written; "
        f"kept as {DATABASE}.damaged-1, 6 trials taken over, the others run again"
    ]
    assert content(study) == content(sound)


def test_a_truncated_database_is_set_aside_and_what_can_be_read_taken_over(study, sound, capsys):
    part = (study / DATABASE).read_bytes()[:-5000]
    (study / DATABASE).write_bytes(part)
    assert main(["status", str(study)]) in (0, 2)
    capsys.readouterr()
    (note,), ran = finish(study)
    assert f"{DATABASE}: is damaged: " in note
    assert f"{6 - ran} trials taken over" in note
    assert content(study) == content(sound)
    assert (study / f"{DATABASE}.damaged-1").read_bytes() == part


def test_another_study_is_refused_even_if_the_database_is_damaged(study):
    (study / DATABASE).write_bytes(b"no database at all")
    before = {p: p.read_bytes() for p in study.rglob("*") if p.is_file()}
    other = made_up.Spec.of(made_up.SPEC.table() | {"episodes": 9})
    with (
        pytest.raises(SpecError, match="holds another study: episodes = 4 there, 9 here"),
        made_up.opened(study, other),
    ):
        pass
    assert {p: p.read_bytes() for p in study.rglob("*") if p.is_file()} == before


def test_two_damaged_databases_are_both_kept(study):
    for number in (1, 2):
        (study / DATABASE).write_bytes(b"damage %d" % number)
        (note,), ran = finish(study)
        assert (f"damaged-{number}, 0 trials taken over" in note, ran) == (True, 6)
    kept = sorted(p.read_bytes() for p in study.glob("*.damaged-*"))
    assert kept == [b"damage 1", b"damage 2"]


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
    assert not list(study.glob("*.damaged-*"))


@pytest.mark.slow
def test_no_flipped_bit_anywhere_changes_what_a_study_ends_with(sound, tmp_path):
    rng = random.Random(7)
    expected = content(sound)
    files = [DATABASE] * 4 + [f"recordings/{t.identity}.npz" for t in made_up.TRIALS[:2]]
    for number in range(20):
        study = shutil.copytree(sound, tmp_path / str(number))
        path = study / rng.choice(files)
        data = bytearray(path.read_bytes())
        where = rng.randrange(len(data))
        data[where] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        finish(study)
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


def test_a_database_without_tables_is_not_begun_anew_if_it_held_some(study):
    path = study / DATABASE
    data = bytearray(path.read_bytes())
    data[103:105] = bytes(2)  # the number of tables on the first page
    path.write_bytes(data)
    (note,), _ = finish(study)
    assert "is damaged" in note
    assert (study / f"{DATABASE}.damaged-1").read_bytes() == data


@pytest.mark.parametrize("left", ["nothing", "an empty file"])
def test_a_log_without_its_database_is_named_and_set_aside(study, left, capsys):
    path = study / DATABASE
    path.with_name(f"{DATABASE}-wal").write_bytes(b"log")
    path.unlink()
    if left == "an empty file":
        path.touch()
    assert main(["results", str(study)]) == 2
    assert f"{path}-wal: is the log of a database that is not there" in capsys.readouterr().err
    (note,), ran = finish(study)
    assert "its log is there without it" in note
    assert ran == 6
    assert (study / f"{DATABASE}.damaged-1-wal").read_bytes() == b"log"


@pytest.mark.parametrize(
    "name", [".lock", "recordings", DATABASE, f"{DATABASE}-wal", f"{DATABASE}-shm"]
)
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


def test_a_log_that_leads_nowhere_is_named(study, capsys):
    path = study / f"{DATABASE}-wal"
    path.symlink_to(study / "nowhere")
    for command in ("results", "status"):
        assert main([command, str(study)]) == 2
        assert f"{path}: is no file" in capsys.readouterr().err


def test_an_unreadable_copy_of_the_spec_is_written_anew(study):
    (study / SPEC_FILE).write_bytes(b'preset = "fefault"\n\xff')
    assert finish(study) == ([], 0)
    assert Spec.load(study / SPEC_FILE) == made_up.SPEC


def test_damage_does_not_read_as_a_slip_of_the_pen(study):
    (study / DATABASE).write_bytes(b"no database at all")
    (study / SPEC_FILE).write_text('preset = "fefault"\n')
    with pytest.raises(SpecError, match=r"is no spec, and .* beside it is damaged"):
        finish(study)


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


def test_everything_that_was_kept_is_checked(study, capsys):
    statements = [
        "UPDATE trials SET state = 'failed' WHERE seed = 1",
        "DELETE FROM trials WHERE seed = 1",
        "DELETE FROM checksums",
        "UPDATE planned SET seed = 9 WHERE seed = 1",
        "UPDATE conditions SET condition = 'x' WHERE position = 1",
        "UPDATE meta SET value = '3' WHERE key = 'results_version'",
        "UPDATE ledger SET trials = 5",
        "DELETE FROM ledger",
    ]
    whole = (study / DATABASE).read_bytes()
    for statement in statements:
        (study / DATABASE).write_bytes(whole)
        change(study, statement)
        for command in ("results", "table", "export", "report", "status"):
            status = main([command, str(study)])
            out, err = capsys.readouterr()
            assert DATABASE in out + err, (statement, command, out, err)
            assert (status, err.count("\n")) == (2, 1) or command == "status"


INVENTED = {
    "trials": "INSERT INTO trials SELECT 'x', condition, 99, state, error, recording_sha256, code "
    "FROM trials WHERE identity = ?",
    "episodes": "INSERT INTO episodes SELECT 'x', phase, episode, steps, success, stopped_at_goal, "
    'final_distance_m, final_orientation_rad, contact_fraction, "return" '
    "FROM episodes WHERE identity = ?",
    "seconds": "INSERT INTO seconds SELECT 'x', decision, physics, sensors, learning, total "
    "FROM seconds WHERE identity = ?",
    "numbers": "INSERT INTO numbers SELECT 'x', phase, 1.0, 1 FROM episodes "
    "WHERE identity = ? AND episode = 0",
}
"""What adds rows of a trial that nobody ran, of the values of one that was."""


@pytest.mark.parametrize("tables", [*([table] for table in INVENTED), [*INVENTED]])
def test_rows_that_no_run_wrote_are_told_and_never_counted(study, sound, tables, capsys):
    for table in tables:
        change(study, INVENTED[table], made_up.TRIALS[3].identity)
    name = "frozen, seed 99" if "trials" in tables else "trial x"
    for command in ("results", "table", "compare", "export", "report", "status", "status --watch"):
        first, *options = command.split()
        assert main([first, str(study), *options]) == 2, command
        out, err = capsys.readouterr()
        assert out == ""
        assert f"{study / DATABASE}: is damaged: it holds rows that no run wrote: {name}" in err
        assert err.count("\n") == 1
    with pytest.raises(SpecError, match="no run wrote"):
        na.load(study)
    (note,), ran = finish(study)
    assert ran == 0
    assert f"no run wrote: {name}; kept as {DATABASE}.damaged-1, 6 trials taken over" in note
    assert content(study) == content(sound)


@pytest.mark.parametrize("table", ["trials", *OF_A_TRIAL])
@pytest.mark.parametrize(
    "edit",
    [
        "DELETE FROM {}",
        "DELETE FROM {} WHERE identity = (SELECT max(identity) FROM {})",
        "ALTER TABLE {} ADD COLUMN added TEXT",
        "UPDATE OR IGNORE {} SET identity = NULL",
    ],
)
def test_one_run_mends_what_was_edited(study, sound, table, edit):
    try:
        change(study, edit.replace("{}", table))
    except sqlite3.Error:
        pytest.skip("the table does not take it")
    finish(study)
    assert content(study) == content(sound)
    assert finish(study) == ([], 0)


def test_a_trial_that_is_not_planned_is_told_and_not_taken_over(study, sound):
    for table in ("trials", "episodes", "seconds"):
        change(study, INVENTED[table], made_up.TRIALS[3].identity)
    with sqlite3.connect(study / DATABASE) as db:
        db.executemany("INSERT INTO checksums VALUES (?, ?)", trial_checksums(db, "x"))
        db.execute("UPDATE ledger SET trials = 7")
    db.close()
    with pytest.raises(SpecError, match="not of this study: frozen, seed 99"), Store.open(study):
        pass
    (note,), ran = finish(study)
    assert ("6 trials taken over" in note, ran) == (True, 0)
    assert content(study) == content(sound)


def test_trials_that_a_new_plan_lacks_are_set_aside_and_not_counted(study):
    # As another version of Python, in which the same file has another syntax tree.
    planned = [trial.planned._replace(identity=f"new{i}") for i, trial in enumerate(made_up.TRIALS)]
    kept = made_up.TRIALS[0].planned
    notes = replace(notes_of(made_up.SPEC, made_up.MEASURES), planned=[kept, *planned[1:]])
    with lock_directory(study), Store.create(study, notes, {}, None) as store:
        assert store.counts() == {"done": 1, "failed": 0}
        (note,) = store.notes
    assert "holds trials that are not of this study any more: " in note
    assert f"(and of 4 more); kept as {DATABASE}.damaged-1, 1 trials taken over" in note


def test_a_study_without_a_ledger_is_mended(study, sound):
    change(study, "DROP TABLE ledger")
    with pytest.raises(SpecError, match="is damaged"), Store.open(study):
        pass
    notes, again = finish(study)
    assert (len(notes), again) == (1, 0)
    assert content(study) == content(sound)


@pytest.mark.parametrize(
    ("before", "after"), [("default", "fefault"), ("episodes = 4", "episodes = 5"), ("=", "5")]
)
def test_a_damaged_copy_of_the_spec_is_no_other_study(study, before, after, capsys):
    path = study / SPEC_FILE
    path.write_text(path.read_text().replace(before, after, 1))
    assert main(["run", str(path), "--out", str(study)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{path}" in error
    assert f"it is damaged: nested-agents retry {study} continues from the database" in error


@pytest.mark.parametrize("version", [1, 99])
def test_a_study_of_another_version_is_refused_and_left_as_it_is(version, study, capsys):
    change(study, "UPDATE meta SET value = ? WHERE key = 'results_version'", str(version))
    before = (study / DATABASE).read_bytes()
    with pytest.raises(SpecError, match=f"holds results of version {version}, this is version"):
        finish(study)
    for command in ("results", "table", "status"):
        assert main([command, str(study)]) == 2
        assert f"holds results of version {version}" in capsys.readouterr().err
    assert (study / DATABASE).read_bytes() == before
    assert not list(study.glob("*.damaged-*"))


WITH_LITTLE_MEMORY = """
import sqlite3, sys
from nested_agents.studies.cli.main import main
of_all = sqlite3.connect(":memory:")
try:
    for limit in range(340_000, 0, -10_000):  # it cannot be raised again
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
    assert not [*study.glob("*damaged*")]
    assert content(study) == content(sound)


def test_what_was_set_aside_is_taken_over_even_by_the_next_run(study, sound, monkeypatch):
    change(study, "UPDATE meta SET value = 'x' WHERE key = 'spec'")

    def stop(*_):
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr(integrity, "recover", stop)
        with pytest.raises(MemoryError):
            finish(study)
    notes, run = finish(study)
    assert run == 0
    assert re.search(r"was being made anew; kept as .*damaged-1, 6 trials taken over", notes[0])
    assert content(study) == content(sound)
    assert finish(study) == ([], 0)
