"""Run the command line: ``nested-agents``, or ``python -m nested_agents``."""

from __future__ import annotations

import atexit
import os
import signal


def main() -> int:
    """Run the command line and return its exit status; Ctrl-C ends even the imports in silence."""
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        # Until a command begins there is nothing to tidy up. Some imports swallow exceptions.
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
        # What is done cannot be interrupted; other handlers Python puts away before it has ended.
        atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    from .studies.cli.main import main as run

    if is_usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return run()


if __name__ == "__main__":
    raise SystemExit(main())
