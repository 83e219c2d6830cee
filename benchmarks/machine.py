"""What a run of the benchmarks ran on, and how fast that is: figures of two machines compare.

The speed is that of three fixed loads which are no code of ours and compile nothing: bytecode,
arithmetic in the cache, and memory. A figure of one machine times the ratio of their speeds is what
another would show, as far as it is made of the same.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

import numpy as np

SIDE = 192
"""Of the square matrices that are multiplied: three of them fit a second-level cache of 1 MB."""

LONG = 4_000_000
"""Numbers of the array that is copied [float64]: 32 MB, beyond most caches."""

LOOPS = 200_000
"""Turns of the loop of bytecode."""


def machine(rounds: int = 7) -> dict[str, Any]:
    """Return processor, packages, date and speed.

    Parameters
    ----------
    rounds
        How often each load is run; the fastest counts, since others can only slow it down.
    """
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "processor": platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "packages": {name: version(name) for name in ("nested-agents", "numpy", "numba", "scipy")},
        "speed": speed(rounds),
    }


def speed(rounds: int) -> dict[str, float]:
    """Return the speeds of the fixed loads.

    Returns
    -------
    dict
        ``bytecode_mhz``: turns of a loop that adds squares [10^6/s]. ``arithmetic_gflops``: of a
        product of matrices on one thread [10^9/s]. ``memory_gb_s``: bytes read and written by a
        copy [10^9/s].
    """
    matrix, out = np.full((SIDE, SIDE), 0.5), np.empty((SIDE, SIDE))
    source, target = np.ones(LONG), np.zeros(LONG)

    def multiply() -> None:
        for _ in range(20):
            np.matmul(matrix, matrix, out=out)

    return {
        "bytecode_mhz": 1e-6 * LOOPS / _least(loop, rounds),
        "arithmetic_gflops": 1e-9 * 20 * 2 * SIDE**3 / _least(multiply, rounds),
        "memory_gb_s": 1e-9 * 16 * LONG / _least(lambda: np.copyto(target, source), rounds),
    }


def loop() -> int:
    """Run the loop of bytecode."""
    total = 0
    for i in range(LOOPS):
        total += i * i
    return total


def _least(load: Callable[[], object], rounds: int) -> float:
    """Return the least time [s] of this thread that a load takes, after one that is not timed."""
    load()
    taken = []
    for _ in range(rounds):
        begin = time.thread_time()
        load()
        taken.append(time.thread_time() - begin)
    return min(taken)
