"""Worlds shared out among processes, of which the calling one is the first.

Box2D holds the interpreter while it steps, so that threads would take turns. A call goes to every
process through a pipe, of which only its name and a few numbers travel; what worlds are told and
tell lies in shared memory. The calling process does its part meanwhile, so that one process needs
no pipe at all.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Callable, Sequence
from itertools import pairwise
from multiprocessing.connection import Connection, wait
from typing import Any

import numpy as np

from .worlds import Worlds

MakeWorlds = Callable[[Any], Worlds]

PATIENCE = 5.0
"""How long a process may take to end when it is asked to [s]."""


class Processes:
    """Worlds by the process that steps them.

    Parameters
    ----------
    make
        What makes the worlds of some rows; to be pickled.
    row
        The type of their rows.
    edges
        Process i has the worlds ``edges[i]`` to ``edges[i + 1]``; process 0 is the calling one.
    context
        How processes are started, as `multiprocessing` calls it; None is its default.

    Attributes
    ----------
    rows
        The rows of all worlds.
    """

    def __init__(
        self, make: MakeWorlds, row: np.dtype[Any], edges: Sequence[int], context: str | None
    ) -> None:
        self._edges = list(edges)
        start: Any = multiprocessing.get_context(context)
        memory = start.RawArray("b", edges[-1] * row.itemsize)
        self.rows: Any = np.frombuffer(memory, dtype=row)
        self._workers: list[tuple[Any, Connection]] = []
        for first, last in pairwise(edges[1:]):
            ours, theirs = start.Pipe()
            process = start.Process(
                target=_work, args=(theirs, make, memory, row, first, last), daemon=True
            )
            process.start()
            theirs.close()
            self._workers.append((process, ours))
        self._own = make(self.rows[: edges[1]])

    def call(self, name: str, *arguments: Any) -> list[Any]:
        """Call a method of all `Worlds`; return what each returns.

        Parameters
        ----------
        name
            Of the method.
        *arguments
            Each is a sequence with one entry for every world.

        Raises
        ------
        RuntimeError
            If a process has died.
        """
        parts = [
            [argument[first:last] for argument in arguments]
            for first, last in pairwise(self._edges)
        ]
        for (process, pipe), part in zip(self._workers, parts[1:], strict=True):
            try:
                pipe.send((name, part))
            except OSError:
                raise _died(process) from None
        found = [_called(self._own, name, parts[0])]
        for process, pipe in self._workers:
            try:
                found.append(pipe.recv())
            except (EOFError, OSError):
                raise _died(process) from None
        for _, error in found:
            if error is not None:
                raise error
        return [answer for answer, _ in found]

    def close(self) -> None:
        """End the processes."""
        for _, pipe in self._workers:
            with contextlib.suppress(OSError):
                pipe.send(None)
        for process, _ in self._workers:
            process.join(PATIENCE)
            if process.is_alive():
                process.terminate()
                process.join()
        self._workers = []


def _died(process: Any) -> RuntimeError:
    process.join(PATIENCE)
    return RuntimeError(
        f"a process that steps worlds has died (exit status {process.exitcode}); "
        "make a new vector environment"
    )


def _called(worlds: Worlds, name: str, arguments: Sequence[Any]) -> tuple[Any, Exception | None]:
    """Return what a method returns, or what it raises."""
    try:
        return getattr(worlds, name)(*arguments), None
    except Exception as error:
        return None, error


def _work(
    pipe: Connection, make: MakeWorlds, memory: Any, row: np.dtype[Any], first: int, last: int
) -> None:
    """Step worlds until told to end, or until the calling process is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the calling process ends this one
    parent = multiprocessing.parent_process()
    assert parent is not None
    worlds = make(np.frombuffer(memory, dtype=row)[first:last])
    with contextlib.suppress(EOFError, OSError):
        while pipe in wait([pipe, parent.sentinel]):
            told = pipe.recv()
            if told is None:
                return
            name, arguments = told
            pipe.send(_called(worlds, name, arguments))
