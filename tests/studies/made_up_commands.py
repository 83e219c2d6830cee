"""Commands with made-up results, in this process or in one of their own."""

import atexit
import io
import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, redirect_stderr, redirect_stdout, suppress
from functools import cache
from pathlib import Path

import made_up
import pytest

from nested_agents.studies.api import running as studies_run
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main

PROGRAM = Path(made_up.__file__).with_name("made_up_cli.py")


def run_here(measure, *arguments):
    """Run a command in this process with made-up results; return status, output and errors."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(learning_curve, "measure", measure)
        patch.setattr(studies_run, "check_conditions", lambda spec, **_: made_up.MEASURES)
        patch.setenv("COLUMNS", "80")
        status = main([str(argument) for argument in arguments])
    return status, out.getvalue(), err.getvalue()


class Command:
    """A command in a process of its own, with made-up results; used as a `subprocess.Popen`.

    Parameters
    ----------
    measure
        Name of what gives the results; "": nothing is made up.
    arguments
        Of the command line.
    start_new_session
        Whether it leads a process group of its own.
    encoding
        Of its output.
    buffered
        Whether it writes output when there is much of it, as usual, or at once.
    out
        Descriptor of where it writes output; None: into `stdout`.
    """

    def __init__(
        self, measure, *arguments,
        start_new_session=False, encoding="utf-8", buffered=True, out=None,
    ):  # fmt: skip
        process = {"environment": dict(os.environ), "folder": os.getcwd(),
                   "group": start_new_session, "encoding": encoding,
                   "buffered": buffered}  # fmt: skip
        self.arguments, self.returncode = [*map(str, arguments)], None
        task = {"measure": measure, "arguments": self.arguments, "process": process}
        (self.stdout, to_out), (self.stderr, to_err) = os.pipe(), os.pipe()
        self.pid = ask(task, to_out if out is None else out, to_err)
        os.close(to_out)
        os.close(to_err)
        self.encodings = encoding, "utf-8"

    def poll(self):
        if self.returncode is None:
            self.returncode = ask(self.pid)
        return self.returncode

    def wait(self, timeout):
        until = time.monotonic() + timeout
        while self.poll() is None:
            if time.monotonic() > until:
                raise subprocess.TimeoutExpired(self.arguments, timeout)
            time.sleep(0.01)

    def communicate(self, timeout=60):
        with ThreadPoolExecutor(2) as pool:
            out, err = pool.map(_read, (self.stdout, self.stderr), self.encodings)
        self.wait(timeout)
        return out, err

    def send_signal(self, number):
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self):
        self.send_signal(signal.SIGKILL)


def _read(pipe, encoding):
    with open(pipe, encoding=encoding) as stream:
        return stream.read()


@cache
def _beginner():
    """Return the way to the process that begins commands; it ends with this one."""
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with there:
        process = subprocess.Popen(
            [sys.executable, PROGRAM, str(there.fileno())], pass_fds=[there.fileno()],
            start_new_session=True, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    atexit.register(process.wait)
    atexit.register(here.close)
    return here


def ask(message, *pipes):
    """Return what the process that begins commands answers."""
    socket.send_fds(_beginner(), [json.dumps(message).encode()], pipes)
    return json.loads(_beginner().recv(100))


def heeding_interrupts() -> None:
    """Undo what a shell does to the commands that it begins in the background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _finished(database):
    """Return how many trials are kept as done."""
    with (
        suppress(sqlite3.OperationalError),  # being made
        closing(sqlite3.connect(f"{database.as_uri()}?mode=ro", uri=True)) as connection,
    ):
        return connection.execute("SELECT count(*) FROM trials WHERE state = 'done'").fetchone()[0]
    return 0


def finish(process):
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err


def wait_for_results(directory, process):
    """Wait until something has finished and is kept."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        if (directory / "recordings").is_dir() and _finished(directory / "results.sqlite"):
            return
        time.sleep(0.02)
    pytest.fail(f"nothing finished: {process.communicate()}")
