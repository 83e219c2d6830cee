"""Results without a simulation: measures that workers can import, and specs that are valid."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from nested_agents.scenarios.box_pushing.scenario import MEASURES
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.trials.trial import EpisodeRow, TrialResult, trials_of

SPEC = Spec.of({"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2,
                "sweep": {"preset": ["default", "frozen"]}})  # fmt: skip
TRIALS = trials_of(SPEC)


def opened(directory, spec=SPEC, measures=MEASURES, **options):
    """Open the store of a study to run it."""
    return open_to_run(directory, spec, trials_of(spec), measures, **options)


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


NOTED = """
import os
import time


class Noted(Tank):
    def reset(self, seed, episode=0):
        if episode == 0 and "MADE_UP_MARK" in os.environ:
            with open(os.environ["MADE_UP_MARK"], "a") as file:
                file.write(f"{os.getpgid(0)}\\n")
            time.sleep(1.0)
        return super().reset(seed, episode)
"""
"""A tank that writes down which process group begins a trial, and takes its time there."""

STUDY = """
study = "learning-curve"
seeds = 3
episodes = 3
steps = 20
evaluation = 1
scenario.kind = "tank.py:Noted"
sweep.preset = ["default", "frozen"]
"""


def write_study(folder):
    """Write a study of six trials, and its world, that leaves time to kill who runs it."""
    tank = Path(__file__).resolve().parents[2] / "examples" / "tank.py"
    (folder / "tank.py").write_text(tank.read_text(encoding="utf-8") + NOTED)
    (folder / "study.toml").write_text(STUDY)


def begun(mark):
    """Return the process groups that began a trial of that study, in order."""
    return [*map(int, mark.read_text().split())] if mark.exists() else []


def kill_group(mark, n):
    """Kill the process group that begins the `n`-th trial of that study, while it runs it."""
    until = time.monotonic() + 60
    while time.monotonic() < until and len(begun(mark)) < n:
        time.sleep(0.02)
    os.killpg(begun(mark)[n - 1], signal.SIGKILL)


def exported(study):
    """Return the exported rows of a study and its recordings, byte for byte."""
    assert main(["export", str(study), "--format", "csv"]) == 0
    files = [Path(study, "export", "episodes.csv"), *Path(study).glob("recordings/*.npz")]
    return {path.name: path.read_bytes() for path in files}
