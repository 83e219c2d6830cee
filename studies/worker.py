"""What happens in a worker process. Light to import: a worker must be up early."""

from __future__ import annotations

import os
import threading
import time
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .trial import Trial, TrialResult

POLL = 0.5
"""How often a worker looks whether its parent is still there [s]."""

Measure = Callable[["Trial"], "TrialResult"]
Arrival = tuple["Trial", "TrialResult | None", str | None, float]
"""A trial with its result or else its traceback, and the seconds that it took."""


def begin(parent: int) -> None:
    """Do not outlive the process `parent`, even if it is killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(POLL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def attempt(measure: Measure, trial: Trial) -> Arrival:
    """Run one trial; what goes wrong is returned as text."""
    begin = time.perf_counter()
    try:
        result = measure(trial)
    except Exception:
        return trial, None, traceback.format_exc(), time.perf_counter() - begin
    return trial, result, None, time.perf_counter() - begin
