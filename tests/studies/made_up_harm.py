"""Trials that harm the process that runs them, and one that tells whether it was harmed."""

import os
import random
import shutil
import signal
import sys
import tempfile
from dataclasses import replace

import numpy as np
from made_up_measures import measure

TAKEN = []
"""Grows with every trial that this process runs."""


def innocent(trial):
    """As `measure`; says what it finds in its process."""
    TAKEN.append(trial.seed)
    numbers = {
        "trials": len(TAKEN),
        "random": random.random(),
        "numpy": np.random.random(),  # noqa: NPY002 - what a user's file may use
        "sum": float(np.add(1, 1)),
        "is there": float(os.path.exists(os.getcwd())),
        "path": float("PATH" in os.environ),
        "set": float(list({"a", "b", "c", "d", "e"}).index("a")),
    }
    return replace(measure(trial), numbers=numbers)


def harmful(trial):
    """As `innocent`, and leaves nothing as it was."""
    result = innocent(trial)
    random.seed(99)
    np.random.seed(99)  # noqa: NPY002
    np.add = lambda *_: np.nan
    folder = tempfile.mkdtemp()
    os.chdir(folder)
    shutil.rmtree(folder)
    os.environ.clear()
    return result


def exits(trial):
    """Ends its process."""
    os._exit(3)


def crashes(trial):
    """As a fault in native code does."""
    os.kill(os.getpid(), signal.SIGSEGV)


def leaves(trial):
    """Leaves a process behind that keeps its files open."""
    if not os.fork():
        os.execvp("sleep", ["sleep", "3"])
    return measure(trial)


def leaves_and_crashes(trial):
    """Forks a process that holds whatever is open, and dies."""
    if not os.fork():
        signal.alarm(3)
        signal.pause()
    crashes(trial)


def tells_parents(trial):
    """As `measure`; says by which process it was begun, and what that runs."""
    threads = len(os.listdir(f"/proc/{os.getppid()}/task"))
    numbers = {"parent": os.getppid(), "threads": float(threads), "own": os.getpid()}
    return replace(measure(trial), numbers=numbers)


def odd(trial):
    """Gives what cannot be pickled."""
    return replace(measure(trial), numbers={"odd": lambda: 3})


def prints(trial):
    """As `measure`; also speaks."""
    print("I speak")
    sys.stderr.write("I complain\n")
    return measure(trial)
