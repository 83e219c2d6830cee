"""A process for each trial: forked in milliseconds from a warm one in which no trial has run.

What a user's file leaves behind in its process (state of its modules, a patched library, another
working directory, changed environment variables) is gone with it: no trial can change another,
wherever and in whatever order they run. Global random number generators are seeded with the seed of
the trial. The warm process, the nursery, has one thread, so that it may fork. It imports and loads
what trials have, see `Warmth`, and never a user's file. Each worker has one.
"""

from __future__ import annotations

import gc
import importlib
import os
import pickle
import random
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable
from functools import cache
from multiprocessing.connection import Connection, Pipe, wait
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...core.isolation import python_command, restore_child_signal
from .runner import Outcome, RunTrial, attempt, begin, storable
from .warmth import Warmth, measure_warmth, warm_up

if TYPE_CHECKING:
    from ..trials.trial import Trial

LOOK = 0.2
"""Polling interval for processes that died without an answer [s]."""


class Answer(NamedTuple):
    """Result of a process."""

    content: bytes
    """Answer of the process; empty if it died before."""
    death: str = ""
    """Cause of its death in words."""

    def outcome(self, trial: Trial) -> Outcome:
        """Return what became of the trial that it ran."""
        if self.death:
            return Outcome(trial, self.death, 0.0, lost=True)
        error, seconds, result = pickle.loads(self.content)
        return Outcome(trial, error, seconds, result)


class Word(NamedTuple):
    """The last word of a trial's process."""

    outcome: bytes
    """Error, seconds and result of the trial, pickled."""
    warmth: Warmth
    """Modules and kernels that it had loaded at the end."""


def call_for(
    run_trial: RunTrial, trial: Trial
) -> tuple[Callable[..., Outcome | Answer], *tuple[object, ...]]:
    """Return a function and its arguments by which a worker runs a trial.

    A trial that runs Python files or modules of users has a process of its own. It is pickled here,
    so that the worker itself runs none of them.
    """
    if trial.sources.runs_foreign_code and sys.platform != "win32":  # which forks no processes
        return run_apart, pickle.dumps((run_trial, trial)), trial.seed
    return attempt, run_trial, trial


def run_apart(task: bytes, seed: int) -> Answer:
    """Run a trial in a process of its own, and wait for it.

    Parameters
    ----------
    task
        A function and the trial to give it, pickled: a worker need not run the files of users.
    seed
        Of the global random number generators that the trial finds.
    """
    _, nursery = _begin(os.getpid())
    try:
        nursery.send((task, seed))
        content, death = nursery.recv()
    except (EOFError, OSError):
        _begin.cache_clear()
        return Answer(b"", "the process that begins trials has died")
    return Answer(content, death)


@cache
def _begin(parent: int) -> tuple[subprocess.Popen[bytes], Connection]:
    """Start the nursery of the process `parent`, this one; it ends with the connection to it."""
    ours, theirs = Pipe()
    command = python_command(f"from {__name__} import serve; serve({theirs.fileno()})")
    # Sets of text are in the same order in every trial.
    environment = {**os.environ, "PYTHONHASHSEED": "0"}
    process = subprocess.Popen(command, env=environment, pass_fds=[theirs.fileno()])
    theirs.close()
    return process, ours


def serve(descriptor: int) -> None:
    """Fork a process for each requested trial, until the connection closes."""
    worker = Connection(descriptor)
    restore_child_signal()
    importlib.import_module("nested_agents.studies.trials.session")
    warmth = Warmth((), ())
    while True:
        try:
            task, seed = worker.recv()
        except (EOFError, OSError):
            return
        word, death = _fork(worker, task, seed)
        worker.send((b"" if word is None else word.outcome, death))
        if word is not None and word.warmth != warmth:
            warm_up(word.warmth, warmth)
            warmth = word.warmth
            gc.collect()
            gc.freeze()  # what is not touched is shared


def _fork(worker: Connection, task: bytes, seed: int) -> tuple[Word | None, str]:
    """Run a trial in a new process; return its last word, or how it died."""
    ours, theirs = Pipe(duplex=False)
    nursery = os.getpid()
    child = os.fork()
    if not child:
        try:
            ours.close()
            worker.close()
            begin(nursery)
            theirs.send(_run(task, seed))
            theirs.close()
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
        finally:
            os._exit(0)
    theirs.close()
    with ours:
        return _listen(worker, ours, child)


def _listen(worker: Connection, ours: Connection, child: int) -> tuple[Word | None, str]:
    """Return the answer of a process or the cause of its death; end it if the connection closes."""
    status = None
    while True:
        ready = wait([ours, worker], LOOK)
        if ours in ready:
            try:
                word = ours.recv()
            except EOFError:
                word = None
            break
        if worker in ready:  # which says nothing meanwhile: it is gone
            os.kill(child, signal.SIGKILL)
            os._exit(1)
        if status is not None:
            word = None
            break
        done, code = os.waitpid(child, os.WNOHANG)
        if done:
            status = code
    if status is None:
        _, status = os.waitpid(child, 0)
    if word is not None:
        return word, ""
    return None, describe_exit(os.waitstatus_to_exitcode(status))


def describe_exit(code: int) -> str:
    """Return in words how a process ended.

    Examples
    --------
    >>> describe_exit(3), describe_exit(-11)
    ('exit code 3', 'killed by SIGSEGV')
    >>> describe_exit(-9)
    'killed by SIGKILL, as when memory is short'
    """
    if code >= 0:
        return f"exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"killed by {name}" + (", as when memory is short" if name == "SIGKILL" else "")


def _run(task: bytes, seed: int) -> Word:
    """Run a trial in this process, which does nothing else."""
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002 - of what users' files may use
    try:
        _, error, seconds, result, _ = attempt(*pickle.loads(task))
        outcome = pickle.dumps((error, seconds, result))
    except BaseException:  # its settings or its result cannot be pickled
        outcome = pickle.dumps((storable(traceback.format_exc()), 0.0, None))
    return Word(outcome, measure_warmth())
