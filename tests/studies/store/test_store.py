import os
import shutil
import sqlite3
from dataclasses import replace

import made_up
import pytest

from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec import spec as spec_module
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store import database, durable, writer
from nested_agents.studies.store import store as store_module
from nested_agents.studies.store.database import DATABASE, SPEC_FILE
from nested_agents.studies.store.durable import NotRecordedError
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import pending, spec_of
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

NAMES = [measure.name for measure in made_up.MEASURES]


def changed(**changes):
    return Spec.of(made_up.SPEC.table() | changes)


@pytest.fixture
def finished(tmp_path):
    directory = tmp_path / "study"
    with made_up.opened(directory) as store:
        for trial in made_up.TRIALS:
            save(store, trial, made_up.measure(trial), 1.5)
    return directory


def test_what_was_saved_is_read_back_digit_by_digit(finished):
    with Store.open(finished) as store:
        names, episodes = store.episodes()
        rows = list(episodes)
        assert spec_of(store) == made_up.SPEC
        for trial in made_up.TRIALS:
            result = made_up.measure(trial)
            expected = [row.flat(NAMES) for row in result.rows]
            head = (trial.condition, trial.condition, trial.seed)
            assert [row[3:] for row in rows if row[:3] == head] == expected
            recording = store.recording(trial.identity, "last")
            assert recording.keys() == result.recordings["last"].keys()
            assert (recording["box_pose"] == result.recordings["last"]["box_pose"]).all()
    assert names[2:] == [
        "seed", "phase", "episode", "steps", "success", "stopped_at_goal", "final_distance_m",
        "contact_fraction", "return",
    ]  # fmt: skip


def test_rows_are_in_order_whatever_the_order_of_arrival(tmp_path, finished):
    with made_up.opened(tmp_path / "other") as other:
        for trial in reversed(made_up.TRIALS):
            save(other, trial, made_up.measure(trial), 9.0)
        with Store.open(finished) as store:
            assert list(store.episodes()[1]) == list(other.episodes()[1])


def test_recordings_are_equal_bytes(tmp_path, finished):
    with made_up.opened(tmp_path / "other") as other:
        save(other, made_up.TRIALS[0], made_up.measure(made_up.TRIALS[0]), 9.0)
    name = f"recordings/{made_up.TRIALS[0].identity}.npz"
    assert (tmp_path / "other" / name).read_bytes() == (finished / name).read_bytes()


def test_another_tool_reads_it_with_one_query(finished):
    connection = sqlite3.connect(finished / DATABASE)
    rows = connection.execute('SELECT seed, "return" FROM results WHERE preset = "frozen"')
    assert len(rows.fetchall()) == 3 * (4 + 2)
    connection.close()


def test_the_database_is_written_through(finished):
    with made_up.opened(finished) as store:
        assert store._db.execute("PRAGMA journal_mode").fetchone() == ("delete",)
        assert store._db.execute("PRAGMA synchronous").fetchone() == (3,)


def test_a_saved_trial_replaces_what_was_there(finished):
    trial = made_up.TRIALS[0]
    with made_up.opened(finished) as store:
        before = list(store.episodes()[1])
        save(store, trial, made_up.measure(trial), 1.0)
        assert list(store.episodes()[1]) == before
        assert store.counts() == {"done": 6, "failed": 0}


def test_seconds_are_kept_apart(finished):
    with Store.open(finished) as store:
        names, rows = store.trials()
    parts = [f"seconds.{part}" for part in ("decision", "physics", "sensors", "learning", "total")]
    assert [name for name in names if name.startswith("seconds.")] == parts
    assert {row[names.index("seconds.total")] for row in rows} == {1.5}


def test_a_part_that_no_trial_measured_took_no_known_time(finished):
    with sqlite3.connect(finished / DATABASE) as database:
        database.execute("UPDATE seconds SET physics = 0.0")
    with Store.open(finished) as store:
        names, rows = store.trials()
    assert {row[names.index("seconds.physics")] for row in rows} == {None}


def test_a_recording_that_cannot_be_read_is_named(finished):
    trial = made_up.TRIALS[0]
    path = finished / "recordings" / f"{trial.identity}.npz"
    with Store.open(finished) as store:
        with pytest.raises(SpecError, match="holds no recording 'middle'"):
            store.recording(trial.identity, "middle")
        path.write_bytes(b"PK")
        with pytest.raises(SpecError, match="is damaged"):
            store.recording(trial.identity, "last")
        path.unlink()
        with pytest.raises(SpecError, match="is missing"):
            store.recording(trial.identity, "last")


def test_a_trial_that_records_nothing_has_no_file(tmp_path):
    trial = made_up.TRIALS[0]
    result = replace(made_up.measure(trial), recordings={})
    with made_up.opened(tmp_path / "study") as store:
        save(store, trial, result, 1.5)
        assert pending(store, made_up.TRIALS) == list(made_up.TRIALS[1:])
    assert list((tmp_path / "study" / "recordings").iterdir()) == []
    path = tmp_path / "study" / "recordings" / f"{trial.identity}.npz"
    path.write_bytes(b"of somebody else")
    with Store.open(tmp_path / "study") as store:
        assert store.damage() == {}
        with pytest.raises(NotRecordedError, match="the trial recorded nothing"):
            store.recording(trial.identity, "last")


def test_seeds_may_be_added(finished):
    more = changed(seeds=5)
    with made_up.opened(finished, more) as store:
        left = pending(store, trials_of(more))
        assert {trial.seed for trial in left} == {3, 4}
        assert spec_of(store) == more
    assert Spec.load(finished / SPEC_FILE) == more


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"episodes": 9}, "episodes = 4 there, 9 here"),
        ({"seeds": 2}, "seeds = 3 there, 2 here"),
        ({"learner": {"discount": 0.5}}, "learner.discount = absent there, 0.5 here"),
        ({"sweep": {"preset": ["default"]}}, "sweep.preset = ['default', 'frozen'] there, ['def"),
        ({"sweep": {"learner.kind": ["batch-td", "frozen"]}}, "sweep.learner.kind = absent there"),
        ({"evaluation": 3, "steps": 6}, "evaluation = 2 there, 3 here (and 1 more)"),
    ],
)
def test_another_study_is_refused_and_nothing_changed(finished, changes, said):
    before = {p: p.read_bytes() for p in finished.rglob("*") if p.is_file()}
    with (
        pytest.raises(SpecError) as caught,
        made_up.opened(finished, changed(**changes)),
    ):
        pass
    assert said in str(caught.value)
    assert "--out" in str(caught.value)
    assert {p: p.read_bytes() for p in finished.rglob("*") if p.is_file()} == before


def test_results_of_an_older_version_are_not_continued(finished, monkeypatch):
    monkeypatch.setattr(store_module, "RESULTS_VERSION", 99)
    monkeypatch.setattr(database, "RESULTS_VERSION", 99)
    with pytest.raises(SpecError, match="results of version"), made_up.opened(finished):
        pass
    with (
        pytest.raises(SpecError, match="run does not continue"),
        made_up.opened(finished, accept_code=True),
    ):
        pass


def test_two_writers_at_a_time_are_refused(finished):
    with (
        made_up.opened(finished),
        pytest.raises(SpecError, match="another process is writing"),
        made_up.opened(finished),
    ):
        pass


def test_another_study_that_came_first_is_not_overwritten(tmp_path, monkeypatch):
    take = writer._take
    other = made_up.SPEC.model_copy(update={"steps": 99})

    def late(lock, directory):
        with monkeypatch.context() as patch:
            patch.setattr(writer, "_take", take)
            with made_up.opened(directory, other):
                pass
        take(lock, directory)

    monkeypatch.setattr(writer, "_take", late)
    with (
        pytest.raises(SpecError, match="holds another study"),
        made_up.opened(tmp_path),
    ):
        pass
    with Store.open(tmp_path) as store:
        assert spec_of(store) == other


def test_one_reads_one_state_while_another_writes(finished):
    with made_up.opened(finished) as store:
        with Store.open(finished) as reader:
            store.fail(made_up.TRIALS[0], "Traceback")
            assert reader.counts() == {"done": 6, "failed": 0}
            assert len(list(reader.episodes()[1])) == 6 * (4 + 2)
        with Store.open(finished) as reader:
            assert reader.counts() == {"done": 5, "failed": 1}


def test_a_run_killed_before_it_described_its_study_starts_again(tmp_path):
    sqlite3.connect(tmp_path / DATABASE).close()
    (tmp_path / DATABASE).touch()
    with made_up.opened(tmp_path) as store:
        assert pending(store, made_up.TRIALS) == list(made_up.TRIALS)


@pytest.mark.parametrize("content", ["", "no database"])
def test_what_is_no_study_is_named(tmp_path, content):
    with pytest.raises(SpecError, match="holds no study"), Store.open(tmp_path):
        pass
    (tmp_path / DATABASE).write_text(content)
    with pytest.raises(SpecError, match=r"results\.sqlite: "), Store.open(tmp_path) as store:
        spec_of(store)


def test_a_file_in_the_way_is_named(tmp_path):
    (tmp_path / "file").touch()
    for directory in (tmp_path / "file", tmp_path / "file" / "below"):
        with (
            pytest.raises(SpecError, match="file"),
            made_up.opened(directory),
        ):
            pass


def test_a_users_own_spec_is_neither_overwritten_nor_refused(tmp_path):
    (tmp_path / SPEC_FILE).write_text("# mine\nseeds = 2\n")
    with made_up.opened(tmp_path, Spec.of({"seeds": 2})):
        pass
    assert (tmp_path / SPEC_FILE).read_text().startswith("# mine")
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(tmp_path / SPEC_FILE, other)
    with (
        pytest.raises(SpecError, match="in the way"),
        made_up.opened(other),
    ):
        pass


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_an_unwritable_directory_is_named(tmp_path):
    tmp_path.chmod(0o500)
    with (
        pytest.raises(SpecError, match="Permission denied"),
        made_up.opened(tmp_path),
    ):
        pass


def test_a_full_disk_is_one_line_and_keeps_what_was_there(finished, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    with made_up.opened(finished) as store:
        before = list(store.episodes()[1])
        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            save(store, made_up.TRIALS[0], made_up.measure(made_up.TRIALS[0]), 1.0)
        assert list(store.episodes()[1]) == before
        assert pending(store, made_up.TRIALS) == []


def test_no_condition_is_computed_again_to_continue_a_study(finished, monkeypatch):
    monkeypatch.setattr(spec_module, "conditions_of", None)
    with made_up.opened(finished) as store:
        assert pending(store, made_up.TRIALS) == []


def test_two_processes_may_write_a_file_at_once(tmp_path, monkeypatch):
    path = tmp_path / "figure.png"
    with durable.replacing(path) as first:
        first.write(b"first")
        with monkeypatch.context() as other:
            other.setattr("os.getpid", lambda: 1)
            durable.write(path, b"second")
        assert path.read_bytes() == b"second"
    assert path.read_bytes() == b"first"
    assert [p.name for p in tmp_path.iterdir()] == ["figure.png"]
