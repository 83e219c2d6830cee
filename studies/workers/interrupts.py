"""Ctrl-C where it must not strike at once."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def undisturbed() -> Iterator[None]:
    """Put off Ctrl-C until what is being kept is kept."""
    pressed: list[int] = []
    with _handling(lambda number, _: pressed.append(number)):
        yield
    if pressed:
        raise KeyboardInterrupt


@contextmanager
def ignore_interrupts() -> Iterator[None]:
    """Ignore Ctrl-C, as the processes started meanwhile will do for ever: it is for the parent."""
    with _handling(signal.SIG_IGN):
        yield


@contextmanager
def _handling(handler: Any) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # Python tells the main thread only, and lets no other change that
        return
    usual = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
