"""What a control step of a world costs, and elsewhere: ``python -m benchmarks.worlds``.

A control step is one control period of 64 ms: 4 physics substeps, contacts, and 8 infrared rays per
robot. Robots push a square from a medium start, at wheel speeds drawn anew every step. *Naive* is
the same world driven through the Python classes of pybox2d, held against ours before it is timed.
Multiwalker and BipedalWalker, too, are Box2D worlds, stepped with random actions; their resets fall
into few rounds, which medians leave out. *WheelsEnv* is our own PettingZoo interface with states,
rewards and infos, one control period a step as theirs, or eight as is the default. Times are the
processor's: all run in one thread, and other jobs on the machine would only be in the way.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Iterator
from itertools import cycle
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np
from rich.console import Console

from nested_agents.scenarios.box_pushing.environments import WheelsEnv
from nested_agents.scenarios.box_pushing.world.boxes import box_for
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
from nested_agents.scenarios.box_pushing.world.starts import place
from nested_agents.scenarios.box_pushing.world.world import World

from .naive_world import NaiveWorld
from .tables import Row, show
from .timing import paired

COMPARED, TOLERANCE = 60, 1e-5
"""Control steps over which naive and ours are compared, and what poses [m, rad] may differ by."""
READING_TOLERANCE = 1e-3
"""Of readings, which change by 1/15 per millimetre; not of sensors that touch, where Box2D's rays
begin inside and see nothing."""
SPEEDS = (0.05, 0.13)
"""Least and greatest wheel speed [m/s]."""
RUN = 300
"""Control steps after which a world is put back to its start."""

SIZES = {
    "robots": "robots", "rays": "rays", "ours_us": "step\n\\[us]", "best_us": "best\n\\[us]",
    "steps_per_s": "steps/s", "us_per_robot": "robot\n\\[us]",
    "naive_us": "naive\n\\[us]", "naive_ratio": "naive/\nours",
}  # fmt: skip
OTHERS = {
    "world": "world", "us": "step\n\\[us]", "best_us": "best\n\\[us]",
    "steps_per_s": "steps/s", "ratio": "this/\nours",
}  # fmt: skip


class Run:
    """A world that is stepped on and on.

    Parameters
    ----------
    kind
        `World` or `NaiveWorld`.
    robots
        Number of e-Pucks.
    """

    def __init__(self, kind: type[World], robots: int) -> None:
        team, box = [ROBOTS["e-puck"]] * robots, box_for("square", robots)
        self.start = place("medium", np.random.default_rng(0), team, box)[:2]
        self.world = kind(team, box)
        self.speeds = np.random.default_rng(1).uniform(*SPEEDS, (RUN, self.world.n_wheels))
        self.count = 0

    def __call__(self) -> None:
        """Make one control step."""
        if self.count % RUN == 0:
            self.world.place(*self.start)
        self.world.advance(self.speeds[self.count % RUN], 1)
        self.readings = self.world.infrared().max(axis=0)
        self.count += 1


def sizes(robots: int, budget: float, *, naive: bool) -> Row:
    """Time a control step of some robots.

    Raises
    ------
    ArithmeticError
        If naive and ours go different ways.
    """
    candidates = {"ours": Run(World, robots)}
    if naive:
        _compare(robots)
        candidates["naive"] = Run(NaiveWorld, robots)
    times = paired(candidates, budget=budget, clock=thread_time)
    ours = times.median("ours")
    return {
        "robots": robots,
        "rays": candidates["ours"].readings.size,
        "ours_us": 1e6 * ours,
        "best_us": 1e6 * min(times.seconds["ours"]),
        "steps_per_s": int(1 / ours),
        "us_per_robot": 1e6 * ours / robots,
        "naive_us": 1e6 * times.median("naive") if naive else None,
        "naive_ratio": times.ratio("naive", "ours") if naive else None,
        "rounds": len(times.seconds["ours"]),
    }


def _compare(robots: int) -> None:
    ours, naive = Run(World, robots), Run(NaiveWorld, robots)
    for step in range(COMPARED):
        ours()
        naive()
        one, other = (
            np.vstack([run.world.box_pose, run.world.robot_poses]) for run in (ours, naive)
        )
        off = float(np.abs(one - other).max())
        clear = ours.readings < 1
        blind = float(np.abs(ours.readings - naive.readings)[clear].max(initial=0.0))
        if off > TOLERANCE or blind > READING_TOLERANCE:
            raise ArithmeticError(
                f"step {step}: poses of naive and ours differ by {off}, readings by {blind}"
            )


def others(budget: float) -> tuple[list[Row], list[str]]:
    """Time ours with two robots and other worlds in turns; return rows, and what is missing."""
    candidates: dict[str, Callable[[], Any]] = {
        "toolkit, 2 robots, 16 rays": Run(World, 2),
        "naive pybox2d, the same": Run(NaiveWorld, 2),
        "toolkit by WheelsEnv, hold = 1": _wheels(1),
        "toolkit by WheelsEnv, hold = 8": _wheels(8),
    }
    _compare(2)
    missing = []
    for name, make in {
        "PettingZoo multiwalker_v9": _multiwalker,
        "Gymnasium BipedalWalker-v3": _bipedal,
    }.items():
        try:
            candidates[name] = make()
        except ImportError as error:
            missing.append(f"{name} is not timed: {error}; see the extra [human]")
    times = paired(candidates, budget=budget, most_rounds=2000, clock=thread_time)
    first = next(iter(candidates))
    rows = [
        {
            "world": name,
            "us": 1e6 * times.median(name),
            "best_us": 1e6 * min(times.seconds[name]),
            "steps_per_s": int(1 / times.median(name)),
            "ratio": times.ratio(name, first),
            "rounds": len(times.seconds[name]),
        }
        for name in candidates
    ]
    return rows, missing


def _stepping(env: Any, drawn: Iterator[Any]) -> Callable[[], None]:
    """Return what steps a parallel environment, and begins anew when its episode is over."""

    def step() -> None:
        if not env.agents:
            env.reset()
        env.step(next(drawn))

    return step


def _wheels(hold: int) -> Callable[[], None]:
    env = WheelsEnv({"action_repeat": hold}, steps=RUN)
    env.reset(seed=0)
    rng = np.random.default_rng(1)
    drawn = cycle([{agent: int(rng.integers(4)) for agent in env.agents} for _ in range(100)])

    return _stepping(env, drawn)


def _multiwalker() -> Callable[[], None]:
    from pettingzoo.sisl import multiwalker_v9

    env = multiwalker_v9.parallel_env()
    env.reset(seed=0)
    drawn = cycle([{a: env.action_space(a).sample() for a in env.agents} for _ in range(100)])

    return _stepping(env, drawn)


def _bipedal() -> Callable[[], None]:
    import gymnasium

    try:
        env = gymnasium.make("BipedalWalker-v3")
    except gymnasium.error.DependencyNotInstalled as error:
        raise ImportError(str(error)) from None
    env.reset(seed=0)
    drawn = cycle([env.action_space.sample() for _ in range(100)])

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(drawn))
        if terminated or truncated:
            env.reset()

    return step


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.worlds", description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="one small case, to see that it runs")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write everything here")
    options = parser.parse_args()
    counts, budget = ((2,), 0.0) if options.smoke else ((1, 2, 4, 8, 16, 32, 64), 4.0)
    console, before = Console(width=80), os.getloadavg()[0]
    by_size = [sizes(robots, budget, naive=robots <= 32) for robots in counts]
    show(console, "A control step, by number of robots", SIZES, by_size)
    compared, missing = others(5 * budget)
    show(console, "In one process, in turns", OTHERS, compared)
    for line in missing:
        console.print(line, soft_wrap=True)
    loads = before, os.getloadavg()[0]
    console.print(f"load {loads[0]:.1f} before, {loads[1]:.1f} after, on {os.cpu_count()} cores")
    if options.json:
        result = {"loads": loads, "by_size": by_size, "others": compared, "missing": missing}
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
