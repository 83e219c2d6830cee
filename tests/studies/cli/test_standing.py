import json

import made_up
import pytest

from nested_agents.studies.api.status import _estimate, progress
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec import outline
from nested_agents.studies.store.store import Store
from nested_agents.studies.store.writer import LOCK, MARK, Running, read_running
from nested_agents.studies.workers.runner import save


@pytest.fixture
def study(tmp_path):
    """Four of six trials are done: both conditions, seeds 0 and 1; each took 2 s or 4 s."""
    with made_up.opened(tmp_path) as store:
        for trial in made_up.TRIALS[:4]:
            save(store, trial, made_up.measure(trial), 2.0 if trial.condition == "default" else 4.0)
    return tmp_path


def read(directory):
    with Store.open(directory) as store:
        return progress(store)


def test_between_two_runs_everything_unfinished_is_left(study):
    now = read(study)
    assert (now.total, now.done, now.failed, now.left, now.running) == (6, 4, 0, 2, ())
    assert now.seconds == pytest.approx((2.0 + 4.0) / now.processes)


def test_what_a_run_has_handed_out_is_running(study):
    with made_up.opened(study) as store, Running(study, 3) as running:
        assert read_running(study)[1] == {}
        running.start(made_up.TRIALS[5].identity)
        now = read(study)
        assert (now.done, now.left, now.processes) == (4, 1, 3)
        ((condition, seed, seconds),) = now.running
        assert (condition, seed) == ("frozen", 2)
        assert 0 <= seconds < 60
        save(store, made_up.TRIALS[5], made_up.measure(made_up.TRIALS[5]), 4.0)
        assert read(study).running == ()
        running.end(made_up.TRIALS[5].identity)
        running.start(made_up.TRIALS[4].identity)
        assert [*read_running(study)[1]] == [made_up.TRIALS[4].identity]
    assert read_running(study) is None
    assert not (study / MARK).exists()


def test_a_mark_that_outlived_its_process_is_passed_over(study):
    mark = {"processes": 2, "begun": {made_up.TRIALS[5].identity: 0.0}}
    (study / MARK).write_text(json.dumps(mark))
    assert read(study).running == ()
    (study / LOCK).unlink()
    assert read(study).running == ()


@pytest.mark.parametrize("content", ["", "{", "[]", '{"begun": 3}'])
def test_a_mark_that_cannot_be_read_does_no_harm(study, content):
    with made_up.opened(study):
        (study / MARK).write_text(content)
        assert read(study).done == 4


def test_looking_does_not_keep_a_run_from_beginning(study):
    for _ in range(10):
        read_running(study)
        with made_up.opened(study):
            pass


def test_failed_and_damaged_trials_are_counted_once(study, capsys):
    with made_up.opened(study) as store:
        store.fail(made_up.TRIALS[4], "Traceback\nRuntimeError: a wheel came off\n")
    path = study / "recordings" / f"{made_up.TRIALS[0].identity}.npz"
    path.write_bytes(b"PK")
    now = read(study)
    assert (now.done, now.failed, now.left) == (3, 1, 2)
    assert main(["status", str(study)]) == 1
    said = capsys.readouterr().out
    assert f"{path}: is damaged (default, seed 0); must run again" in said
    assert "done     3 of 6 trials\nrunning  0\nfailed   1\nleft     2\n" in said
    assert "default, seed 2 failed:\nTraceback\nRuntimeError: a wheel came off" in said


def test_what_other_code_has_done_is_done(study, monkeypatch, capsys):
    monkeypatch.setattr(outline, "changed", lambda *known: ["core/a.py"])
    now = read(study)
    assert (now.done, now.left, now.seconds) == (4, 2, None)
    assert main(["status", str(study)]) == 0
    text = capsys.readouterr().out
    assert "done     4 of 6 trials" in text
    assert "nothing can be added: " in text
    with made_up.opened(study, accept_code=True), Running(study, 3) as running:
        running.start(made_up.TRIALS[5].identity)
        assert main(["status", str(study)]) == 0
    text = capsys.readouterr().out
    assert "running  1\n         frozen, seed 2, for" in text
    assert "left     1\n" in text


@pytest.mark.parametrize(
    ("means", "left", "running", "processes", "expected"),
    [
        ({}, ["a"], [], 2, None),
        ({"a": 5.0}, ["a"], [], 0, None),
        ({"a": 5.0}, [], [], 2, 0.0),
        ({"a": 10.0}, ["a", "a"], [], 2, 10.0),
        ({"a": 10.0, "b": 20.0}, ["a", "b", "unknown"], [], 1, 45.0),
        ({"a": 10.0}, [], [("a", 4.0)], 2, 6.0),
        ({"a": 10.0}, ["a"], [("a", 4.0), ("a", 99.0)], 2, 8.0),
    ],
)
def test_the_time_left(means, left, running, processes, expected):
    assert _estimate(means, left, running, processes) == expected


def test_equal_tracebacks_are_printed_once(study, capsys):
    with made_up.opened(study) as store:
        for trial in made_up.TRIALS[3:5]:
            store.fail(trial, "Traceback\nRuntimeError: a wheel came off\n")
    assert main(["status", str(study)]) == 1
    out = capsys.readouterr().out
    assert out.count("a wheel came off") == 1
    assert "default, seed 2; frozen, seed 1 failed:\nTraceback\n" in out


def test_the_spec_of_a_kept_study_is_named_where_its_directory_is_given(study, capsys):
    assert main(["plan", str(study)]) == 2
    assert f"{study}: Is a directory; the spec of this study is {study}" in capsys.readouterr().err
