"""What a worker process does before its first trial. Light to import: it must be up early."""

from __future__ import annotations

import os
import signal
import threading
import time

POLL = 0.5
"""How often a worker looks whether its parent is still there [s]."""


def begin(parent: int) -> None:
    """Leave Ctrl-C to the parent process, and do not outlive it when it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(POLL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
