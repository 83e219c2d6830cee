"""Run the command line: ``nested-agents``, or ``python -m nested_agents``."""

from __future__ import annotations

import sys

if __name__ == "__main__" and not sys.flags.safe_path:
    sys.path.pop(0)  # the current folder, which -m puts there

import gc
import os
import signal
from functools import partial
from types import FrameType

from .core.isolation import drop_empty_entries, open_standard_streams, restore_child_signal

NEW_OBJECTS = 50_000
"""Number of new objects after which garbage is collected."""


def main() -> int:
    """Run the command line and return its exit status; Ctrl-C ends even the imports in silence."""
    gc.set_threshold(NEW_OBJECTS)  # the usual 700 take a twentieth of the time of a small study
    # As in workers: arrays are small, and threads wait for each other.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    pressed: list[int] = []
    is_ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    try:
        if is_ours:
            signal.signal(signal.SIGINT, partial(_interrupt, pressed))
        open_standard_streams()
        drop_empty_entries()
        restore_child_signal()
        from .studies.cli.main import main as run

        return run()
    except KeyboardInterrupt:
        return 130
    except Exception:
        if pressed:  # compiled code, as pydantic's, raises an exception of its own in its place
            return 130
        raise
    finally:
        if is_ours:  # what is done cannot be interrupted
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _interrupt(pressed: list[int], number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, but end at once in an import: some imports swallow exceptions."""
    pressed.append(number)
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib."):
            os._exit(130)
        frame = frame.f_back
    raise KeyboardInterrupt


if __name__ == "__main__":
    raise SystemExit(main())
