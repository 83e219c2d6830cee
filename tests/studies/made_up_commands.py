"""Commands with made-up results, in this process or in one of their own."""

import io
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, redirect_stderr, redirect_stdout, suppress
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
        patch.setattr(studies_run, "check", lambda spec, **_: made_up.MEASURES)
        patch.setenv("COLUMNS", "80")
        status = main([str(argument) for argument in arguments])
    return status, out.getvalue(), err.getvalue()


def start(measure, *arguments, **options):
    command = [sys.executable, str(PROGRAM), measure, *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=heeding_interrupts, **options,
    )  # fmt: skip


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
