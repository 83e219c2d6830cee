"""Fork server: a new process for each trial that runs user files.

User files may change their process: module state, patched libraries, working directory, environment
variables. With a process for each trial, no trial can affect another one, in any order. Global
random number generators are seeded with the seed of the trial. Each worker has a fork server, which
has one thread, never runs a user file, and preloads the modules and kernels that trials load, so a
process starts in milliseconds.
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
from contextlib import suppress
from functools import cache
from multiprocessing.connection import Connection, Pipe, wait
from typing import TYPE_CHECKING

import numpy as np

from ...core.isolation import python_command, restore_child_signal
from .preloading import LoadedCode, loaded_code, preload
from .runner import Outcome, RunTrial, attempt, end_with_parent, storable

if TYPE_CHECKING:
    from ..trials.trial import Trial

POLL_S = 0.2
"""Polling interval for processes that died without an answer [s]."""


Answer = tuple[bytes, str]
"""Pickled error, seconds and result of a trial, and the cause of death of its process; one of the
two is empty."""
TrialMessage = tuple[bytes, LoadedCode]
"""Message of a trial's process to the fork server: pickled error, seconds and result, and what the
process had loaded at the end."""


def outcome_of(answer: Outcome | Answer, trial: Trial) -> Outcome:
    """Return the outcome of a trial from the answer of a worker."""
    if isinstance(answer, Outcome):
        return answer
    content, death = answer
    if death:
        return Outcome(trial, death, 0.0, lost=True)
    error, seconds, result = pickle.loads(content)
    return Outcome(trial, error, seconds, result)


def call_for(
    run_trial: RunTrial, trial: Trial
) -> tuple[Callable[..., Outcome | Answer], *tuple[object, ...]]:
    """Return the function, and its arguments, with which a worker runs a trial.

    A trial that runs user code has its own process. It is pickled here, so the worker itself runs
    no user code.
    """
    if trial.sources.runs_foreign_code and sys.platform != "win32":  # Windows cannot fork
        return run_in_own_process, pickle.dumps((run_trial, trial)), trial.seed
    return attempt, run_trial, trial


def run_in_own_process(task: bytes, seed: int) -> Answer:
    """Run a trial in a new process and wait for it.

    Parameters
    ----------
    task
        Pickled function and trial.
    seed
        Seed of the global random number generators in the process.
    """
    _, server = _start_server(os.getpid())
    try:
        server.send((task, seed))
        answer: Answer = server.recv()
    except (EOFError, OSError):
        _start_server.cache_clear()
        return b"", "the process that starts trials has died"
    return answer


@cache
def _start_server(parent: int) -> tuple[subprocess.Popen[bytes], Connection]:
    """Start the fork server of this process, `parent`. It ends when its connection closes."""
    ours, theirs = Pipe()
    command = python_command(f"from {__name__} import serve; serve({theirs.fileno()})")
    # With a fixed hash seed, sets of strings have the same order in every trial.
    environment = {**os.environ, "PYTHONHASHSEED": "0"}
    process = subprocess.Popen(command, env=environment, pass_fds=[theirs.fileno()])
    theirs.close()
    return process, ours


def serve(descriptor: int) -> None:
    """Fork a process for each requested trial, until the connection closes."""
    worker = Connection(descriptor)
    restore_child_signal()
    importlib.import_module("nested_agents.studies.trials.session")
    known: LoadedCode = (), ()
    while True:
        try:
            task, seed = worker.recv()
        except (EOFError, OSError):
            return
        message, death = _fork(worker, task, seed)
        outcome, loaded = message or (b"", known)
        worker.send((outcome, death))
        if loaded != known:
            preload(loaded, known)
            known = loaded
            gc.collect()
            gc.freeze()  # children share memory that is not changed


def _fork(worker: Connection, task: bytes, seed: int) -> tuple[TrialMessage | None, str]:
    """Run a trial in a new process and return its message, or None and the cause of its death."""
    ours, theirs = Pipe(duplex=False)
    server = os.getpid()
    child = os.fork()
    if not child:
        try:
            ours.close()
            worker.close()
            end_with_parent(server)
            theirs.send(_run(task, seed))
            theirs.close()
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
        finally:
            os._exit(0)
    theirs.close()
    with ours:
        return _listen(worker, ours, child)


def _listen(worker: Connection, ours: Connection, child: int) -> tuple[TrialMessage | None, str]:
    """Wait for the message of a process or its death. Kill it if the worker's connection closes."""
    message: TrialMessage | None = None
    status = None
    while True:
        ready = wait([ours, worker], POLL_S)
        if ours in ready:
            with suppress(EOFError):
                message = ours.recv()
            break
        if worker in ready:  # the worker sends nothing now, so it has ended
            os.kill(child, signal.SIGKILL)
            os._exit(1)
        if status is not None:
            break
        done, code = os.waitpid(child, os.WNOHANG)
        if done:
            status = code
    if status is None:
        _, status = os.waitpid(child, 0)
    if message is not None:
        return message, ""
    return None, describe_exit(os.waitstatus_to_exitcode(status))


def describe_exit(code: int) -> str:
    """Return how a process ended, as text.

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


def _run(task: bytes, seed: int) -> TrialMessage:
    """Run a trial in this process, which runs nothing else."""
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002 - user files may use it
    try:
        _, error, seconds, result, _ = attempt(*pickle.loads(task))
        outcome = pickle.dumps((error, seconds, result))
    except BaseException:  # its settings or its result cannot be pickled
        outcome = pickle.dumps((storable(traceback.format_exc()), 0.0, None))
    return outcome, loaded_code()
