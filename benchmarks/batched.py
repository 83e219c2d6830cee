"""What a step costs where many worlds are stepped in one call: ``python -m benchmarks.batched``.

k worlds of box pushing with two robots take random actions: by our vector environment with two
processes and with one, and by Gymnasium's around `BoxPushingEnv`, AsyncVectorEnv with its shared
memory. All run in turns, after one round that is not timed, and the best of the rounds counts.

*Processor time* is that of all processes, per step of a world: other jobs do not count. *Steps per
second* are by the clock on the wall, since that is what processes are for, and say little on a
crowded machine. ``--action-repeat`` says how many control periods a step has.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv, VectorEnv
from rich.console import Console

from nested_agents.scenarios.box_pushing.batched.environments import VecBoxPushingEnv
from nested_agents.scenarios.box_pushing.environments import BoxPushingEnv

from .tables import Row, show

PROCESSORS = {
    "worlds": "worlds", "ours_us": "ours\n\\[us]", "one_us": "one process\n\\[us]",
    "sync_us": "Gymnasium sync\n\\[us]", "async_us": "Gymnasium async\n\\[us]",
}  # fmt: skip
WALL = {
    "worlds": "worlds", "ours_hz": "ours\n\\[steps/s]", "one_hz": "one process",
    "sync_hz": "Gymnasium sync", "async_hz": "Gymnasium async", "gain": "ours/\none world",
}  # fmt: skip
TICK = os.sysconf("SC_CLK_TCK")


def compare(worlds: int, settings: dict[str, Any], steps: int, rounds: int) -> Row:
    """Time each way to step some worlds.

    Parameters
    ----------
    worlds
        How many.
    settings
        Of each.
    steps
        Number of steps of worlds in a round.
    rounds
        Number of rounds.

    Returns
    -------
    dict
        By way, the least processor time per step of a world, ``_us``, and the most steps per
        second, ``_hz``.
    """
    one = partial(BoxPushingEnv, settings)
    makers: dict[str, Callable[[], VectorEnv]] = {
        "ours": lambda: VecBoxPushingEnv(worlds, settings, processes=min(2, worlds)),
        "one": lambda: VecBoxPushingEnv(worlds, settings, processes=1),
        "sync": lambda: SyncVectorEnv([one] * worlds),
        "async": lambda: AsyncVectorEnv([one] * worlds, shared_memory=True),
    }
    envs, workers = {}, {}
    for name, make in makers.items():
        known = {process.pid for process in multiprocessing.active_children()}
        envs[name] = make()
        workers[name] = {process.pid for process in multiprocessing.active_children()} - known
    calls = max(1, steps // worlds)
    actions = np.random.default_rng(0).integers(4, size=(calls, *envs["ours"].action_space.shape))
    row: Row = {"worlds": worlds}
    for round_ in range(rounds + 1):
        for name, env in envs.items():
            env.reset(seed=round_)
            begin, used = perf_counter(), process_time() + sum(map(_used, workers[name]))
            for action in actions:
                env.step(action)
            used = process_time() + sum(map(_used, workers[name])) - used
            passed = perf_counter() - begin
            if round_ > 0:
                cost, rate = f"{name}_us", f"{name}_hz"
                row[cost] = min(row.get(cost, np.inf), 1e6 * used / (calls * worlds))
                row[rate] = max(row.get(rate, 0), int(calls * worlds / passed))
    for env in envs.values():
        env.close()
    return row


def _used(pid: int) -> float:
    """Return the processor time [s] of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.batched", description=__doc__)
    parser.add_argument("--worlds", type=int, nargs="+", default=[1, 2, 4, 8, 16, 32, 64])
    parser.add_argument("--action-repeat", type=int, default=8, metavar="N")
    parser.add_argument("--steps", type=int, default=1500, metavar="N", help="of worlds, a round")
    parser.add_argument("--rounds", type=int, default=5, metavar="N")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write everything here")
    options = parser.parse_args()
    console, before = Console(width=80), os.getloadavg()[0]
    settings = {"action_repeat": options.action_repeat}
    found = [compare(k, settings, options.steps, options.rounds) for k in options.worlds]
    rows = [row | {"gain": row["ours_hz"] / found[0]["one_hz"]} for row in found]
    show(console, "Processor time of a step of a world", PROCESSORS, rows)
    show(console, "Steps of worlds per second", WALL, rows)
    loads = before, os.getloadavg()[0]
    console.print(f"load {loads[0]:.1f} before, {loads[1]:.1f} after, on {os.cpu_count()} cores")
    if options.json:
        text = json.dumps({"loads": loads, "settings": settings, "rows": rows}, indent=1)
        options.json.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
