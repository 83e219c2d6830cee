"""Results without a simulation: who gives them, and specs that are valid."""

import os
import signal
import time
from pathlib import Path

from made_up_measures import (
    MEASURES,
    deadly,
    deadly_once,
    endless,
    failing,
    gated,
    measure,
    pids,
    slow,
    threads,
)

from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.trials.trial import trials_of

__all__ = [
    "MEASURES", "deadly", "deadly_once", "endless", "failing", "gated", "measure", "pids", "slow",
    "threads",
]  # fmt: skip

SPEC = Spec.of({"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2,
                "sweep": {"preset": ["default", "frozen"]}})  # fmt: skip
TRIALS = trials_of(SPEC)


def opened(directory, spec=SPEC, measures=MEASURES, **options):
    """Open the store of a study to run it."""
    return open_to_run(directory, spec, trials_of(spec), measures, **options)


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
