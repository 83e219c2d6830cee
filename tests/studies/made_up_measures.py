"""What gives results without a simulation, and no more: a worker that imports it begins soon."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from nested_agents.scenarios.box_pushing.scenario import MEASURES
from nested_agents.studies.trials.episodes import EpisodeRow
from nested_agents.studies.trials.trial import TrialResult


def measure(trial):
    """Random numbers that are a function of the trial."""
    rng = np.random.default_rng(int(trial.identity[:8], 16))
    phases = [("training", trial.episodes), ("evaluation", trial.evaluation)]
    rows = tuple(
        EpisodeRow(
            phase, episode, int(rng.integers(1, trial.steps + 1)),
            {m.name: bool(rng.random() < 0.5) if m.is_rate else rng.random() for m in MEASURES},
            rng.random(),
        )
        for phase, count in phases
        for episode in range(count)
    )  # fmt: skip
    recording = {"box_pose": rng.random((6, 3)), "box": np.array("square")}
    seconds = dict.fromkeys(("decision", "physics", "sensors", "learning"), rng.random())
    return TrialResult(rows, MEASURES, {"first": recording, "last": recording}, seconds)


def slow(trial):
    """As `measure`, but takes its time."""
    time.sleep(0.3)
    return measure(trial)


def endless(trial):
    """As `measure` for the first seed; takes very long for others."""
    time.sleep(0.0 if trial.seed == 0 else 300.0)
    return measure(trial)


def gated(trial):
    """As `measure`, but others than the first seed wait until a file is there."""
    while trial.seed and not Path(os.environ["MADE_UP_GATE"]).exists():
        time.sleep(0.02)
    return measure(trial)


def failing(trial):
    """Fails for one seed of one condition."""
    if trial.condition == "frozen" and trial.seed == 1:
        raise RuntimeError("a wheel came off")
    return measure(trial)


def deadly(trial):
    """Kills its worker for one seed of one condition, always."""
    if trial.condition == "frozen" and trial.seed == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return measure(trial)


def deadly_once(trial):
    """Kills its worker for one trial, the first time; a file tells whether it did."""
    mark = Path(os.environ["MADE_UP_MARK"])
    if trial.condition == "frozen" and trial.seed == 1 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return measure(trial)


def threads(trial):
    """Fails unless linear algebra is told to use one thread."""
    found = {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    assert set(found.values()) == {"1"}, found
    return measure(trial)


def pids(trial):
    """Writes down its worker's process id and takes a long time."""
    with open(os.environ["MADE_UP_MARK"], "a") as file:
        file.write(f"{os.getpid()}\n")
    time.sleep(30)
    return measure(trial)
