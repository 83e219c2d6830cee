"""Trials that go on from checkpoints have the rows of those that were never interrupted."""

import os
import signal
import subprocess
import sys
import time

import pytest

import nested_agents as na
from nested_agents import SpecError
from nested_agents.studies.api import running
from nested_agents.studies.api.status import Status
from nested_agents.studies.catalogue.study import load_study
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.database import CHECKPOINTS
from nested_agents.studies.trials.checkpoints import Checkpoint
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import Observer

PPO = {"rollout": 20, "batch_size": 60, "epochs": 1, "hidden": [8]}
MANY = {"study": "experience", "seeds": 1, "decisions": 2400, "steps": 25, "evaluation": 2}
ONE = {"seeds": 1, "episodes": 4, "steps": 12, "evaluation": 1, "keep_teams": True}
TABLES = {
    "one world, by decisions": {**MANY, "decisions": 40, "steps": 10},
    "ours": ONE,
    "fitted": {**ONE, "preset": "fitted-q", "scenario": {"kind": "line-up"}},
    "paper": {**ONE, "preset": "paper"},
    "scaling": {**ONE, "study": "scaling"},
    "a wheel fails": {
        **ONE, "scenario": {"failures": [{"kind": "noisy", "wheels": "robot1.left", "episode": 2}]},
        "learner": {"self_model": {}},
    },
    "a copy keeps its weights": {
        **ONE, "study": "wheel-failure", "episodes": 10,
        "scenario": {"failures": [{"kind": "noisy", "wheels": "robot1.left", "episode": 5}]},
        "learner": {"self_model": {}},
    },
    "curriculum": {
        **ONE, "scenario": {"start": "medium"},
        "curriculum": [{"name": "easy", "episodes": 2, "scenario": {"start": "easy"}}],
    },
}  # fmt: skip


class Notes(Observer):
    """Keeps what is noted."""

    def __init__(self):
        self.notes = []

    def note(self, text):
        self.notes.append(text)


class Killed(BaseException):
    """What happens to a trial in the middle."""


def trial_of(table, folder, seconds=0.0, code="of today"):
    trial = trials_of(Spec.of(table))[0]
    trial.sources.checkpoints = None if folder is None else (folder, seconds, code)
    return trial


def measured(trial):
    result = load_study(trial.study).measure(trial)
    recordings = {
        (name, key): array.tobytes()
        for name, recording in result.recordings.items()
        for key, array in recording.items()
    }
    return result.rows, result.numbers, recordings


def kill_after(writes, trial, monkeypatch):
    """Run a trial until it has written so many checkpoints; return whether it came so far."""
    left = [writes]
    write = Checkpoint.write

    def counted(self, *reached):
        write(self, *reached)
        left[0] -= 1
        if not left[0]:
            raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(Checkpoint, "write", counted)
        try:
            measured(trial)
        except Killed:
            return True
    return False


@pytest.mark.parametrize("name", TABLES)
def test_a_trial_goes_on_to_the_same_bits(name, tmp_path, monkeypatch):
    table = TABLES[name]
    straight = measured(trial_of(table, None))
    for writes in (1, 40, 7):  # the last one begins where the one before was killed
        if not kill_after(writes, trial_of(table, tmp_path), monkeypatch):
            break
    assert list(tmp_path.glob("*.npz"))
    assert measured(trial_of(table, tmp_path)) == straight


def test_what_is_done_is_not_done_again(tmp_path, monkeypatch):
    trial = trial_of(TABLES["ours"], tmp_path)
    assert kill_after(3, trial, monkeypatch)
    table, _ = Checkpoint(trial).read()
    assert [episode for _, episode, *_ in table["rows"]] == [0, 1, 2]
    assert kill_after(1, trial, monkeypatch)
    assert len(Checkpoint(trial).read()[0]["rows"]) == 4
    assert not kill_after(1, trial, monkeypatch)  # all is trained; only the evaluation is left


@pytest.mark.parametrize("spoil", [
    lambda content: content[:-1] + bytes([content[-1] ^ 1]),
    lambda content: content[:50],
    lambda content: b"",
])  # fmt: skip
def test_a_damaged_checkpoint_is_as_if_it_were_not_there(spoil, tmp_path, monkeypatch):
    trial = trial_of(TABLES["ours"], tmp_path)
    straight = measured(trial_of(TABLES["ours"], None))
    assert kill_after(2, trial, monkeypatch)
    (file,) = tmp_path.glob("*.npz")
    file.write_bytes(spoil(file.read_bytes()))
    assert Checkpoint(trial).read() is None
    assert measured(trial) == straight


def test_damage_is_remarked_once_and_the_trial_begins_anew(tmp_path):
    (trial,) = trials_of(Spec.of(TABLES["ours"]))
    observer = Notes()
    folder = tmp_path / CHECKPOINTS
    folder.mkdir()
    (folder / f"{trial.identity}.npz").write_bytes(b"0" * 100)
    (tmp_path / "recordings").mkdir()
    for half in (folder / ".half.npz.new", tmp_path / "recordings" / ".half.npz.1.new"):
        half.write_bytes(b"")
    na.run(TABLES["ours"], tmp_path, jobs=1, observer=observer)
    assert [note for note in observer.notes if "damaged" in note] == [
        f"{folder / trial.identity}.npz: is damaged, its trial starts from the beginning"
    ]
    assert not folder.exists()
    assert not list((tmp_path / "recordings").glob(".*"))


def test_what_a_killed_worker_has_not_finished_is_removed_at_the_end(tmp_path, monkeypatch):
    folder = tmp_path / CHECKPOINTS
    monkeypatch.setattr(running, "pending", lambda *_: (folder / ".half.new").write_text("") or [])
    na.run(TABLES["ours"], tmp_path, jobs=1, progress=False)
    assert not folder.exists()


def test_that_of_other_code_or_of_another_trial_is_not_taken(tmp_path, monkeypatch):
    trial = trial_of(TABLES["ours"], tmp_path)
    assert kill_after(1, trial, monkeypatch)
    assert Checkpoint(trial_of(TABLES["ours"], tmp_path, code="of tomorrow")).read() is None
    (file,) = tmp_path.glob("*.npz")
    other = trial_of({**TABLES["ours"], "seeds": [7]}, tmp_path)
    file.rename(tmp_path / f"{other.identity}.npz")
    assert Checkpoint(other).read() is None


def test_nothing_is_written_before_it_is_time_or_of_things_of_users(tmp_path):
    measured(trial_of(TABLES["ours"], tmp_path, seconds=1e6))
    assert not list(tmp_path.iterdir())
    trial = trial_of(TABLES["ours"], tmp_path)
    trial.sources._texts["mine.py"] = "pass"
    measured(trial)
    assert not list(tmp_path.iterdir())
    measured(trial_of(TABLES["ours"], tmp_path / "missing"))


def test_a_run_that_is_killed_in_the_middle_of_a_trial(tmp_path):
    table = {
        **MANY, "decisions": 15_000, "scenario": {"kind": "spread"}, "evaluation": 1,
        "learner": {"kind": "ippo", **PPO, "rollout": 100, "epochs": 2},
    }  # fmt: skip
    (tmp_path / "study.toml").write_text(dumps(Spec.of(table).table()))
    out = tmp_path / "out"
    command = ["run", "study.toml", "--out", "out", "--jobs", "1", "--checkpoint", "0.3"]
    process = subprocess.Popen(
        [sys.executable, "-m", "nested_agents", *command],
        cwd=tmp_path, start_new_session=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    until = time.monotonic() + 120.0
    while not list((out / "checkpoints").glob("*.npz")) and time.monotonic() < until:
        assert process.poll() is None
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    now = Status.of(out)
    assert (now.done, now.left) == (0, 1)
    again = na.run(tmp_path / "study.toml", out, jobs=1, progress=False)
    assert not (out / "checkpoints").exists()
    whole = na.run(tmp_path / "study.toml", tmp_path / "whole", jobs=1, progress=False)
    assert again.episodes.equals(whole.episodes)


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), float("inf")])
def test_how_often_must_make_sense(seconds, tmp_path):
    with pytest.raises(SpecError, match=r"--checkpoint .*: must be 0 or more seconds"):
        na.run({"seeds": 1}, tmp_path / "out", checkpoint=seconds)
    assert not (tmp_path / "out").exists()
