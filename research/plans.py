"""Does ``plan`` give a range that holds?  ``python -m research.plans``.

Small studies that differ in presets, robots, arms, games, worlds of others, numbers of seeds,
processes and lengths are planned in a fresh process each, and run at once by the command line in
another. What a study takes is the time of the whole process, from its start to its end. A range is
as wide as its end divided by its beginning.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from statistics import median
from typing import Any

from tomli_w import dumps

from nested_agents import Spec

from . import FOLDER

GAMES = f"{FOLDER}/studies/games.py:GamesStudy"

PENDULUM = {
    "kind": "gymnasium", "id": "Pendulum-v1", "hold": 2, "horizon": 2, "predictor": "copy",
    "angles": {"angle": {"cos": 0, "sin": 1}},
    "success": {"angle": [-0.2, 0.2], "o2": [-1.0, 1.0]},
}  # fmt: skip
LEARNED = {key: value for key, value in PENDULUM.items() if key not in ("predictor", "horizon")} | {
    "variables": {"speed": 2},
    "success": {"angle": [-0.2, 0.2], "speed": [-1.0, 1.0]},
}
CONTROLS = ["default", "frozen", "random", "planner"]

STUDIES: dict[str, tuple[int, Mapping[str, Any]]] = {
    "demo, short": (1, {"seeds": 2, "episodes": 6, "steps": 200, "sweep": {"preset": CONTROLS}}),
    "demo, two processes": (
        2, {"seeds": 3, "episodes": 6, "steps": 200, "sweep": {"preset": CONTROLS}},
    ),
    "one trial": (1, {"seeds": 1, "episodes": 2, "steps": 50, "evaluation": 1}),
    "one long trial": (1, {"seeds": 1, "episodes": 40}),
    "many short trials": (2, {"seeds": 16, "episodes": 2, "steps": 60, "evaluation": 1}),
    "no evaluation": (1, {"seeds": 2, "episodes": 12, "evaluation": 0}),
    "paper": (2, {"seeds": 2, "episodes": 5, "steps": 200, "preset": "paper"}),
    "own values, robots": (
        2, {"seeds": 2, "episodes": 6, "preset": "own-value", "steps": 200,
            "sweep": {"scenario.robots": [2, 4]}},
    ),
    "presets of one robot": (
        1, {"seeds": 2, "episodes": 6, "preset": "fitted-q",
            "sweep": {"preset": ["fitted-q", "pose"]}},
    ),
    "sixteen robots": (
        1, {"seeds": 1, "episodes": 2, "steps": 200, "evaluation": 1, "scenario": {"robots": 16}},
    ),
    "three wheels, hard starts": (
        1, {"seeds": 2, "episodes": 3, "steps": 100, "evaluation": 2,
            "scenario": {"robot": "three-wheel", "start": "hard"}},
    ),
    "boxes, trees, failures": (
        2, {"study": "wheel-failure", "seeds": 2, "episodes": 10, "topology": "tree",
            "scenario": {"failures": [{"kind": "stuck", "episode": 5, "wheels": ["robot1.left"]}]}},
    ),
    "kept teams": (
        1, {"seeds": 3, "episodes": 6, "steps": 200, "keep_teams": True,
            "sweep": {"topology": ["chain", "star"]}},
    ),
    "other evaluations": (
        1, {"seeds": 2, "episodes": 6, "steps": 200, "evaluation": 5,
            "learner": {"weights": "role"},
            "evaluations": {"four": {"robots": 4}, "eight": {"robots": 8}}},
    ),
    "curriculum": (
        1, {"seeds": 2, "episodes": 4, "steps": 200, "learner": {"weights": "role"},
            "scenario": {"robots": 4},
            "curriculum": [{"name": "two", "episodes": 5, "scenario": {"robots": 2}}]},
    ),
    "arms": (
        1, {"seeds": 3, "episodes": 10, "steps": 150,
            "scenario": {"kind": "kinematic-chain"}, "sweep": {"scenario.joints": [2, 4, 8]}},
    ),
    "a long arm": (
        2, {"seeds": 2, "episodes": 6, "steps": 150,
            "scenario": {"kind": "kinematic-chain", "joints": 32}},
    ),
    "games": (
        1, {"study": GAMES, "seeds": 10, "episodes": 100, "steps": 10, "preset": "fitted-q",
            "scenario": {"kind": "matrix-game", "game": "climbing"}},
    ),
    "a pendulum, copied": (
        1, {"seeds": 2, "episodes": 8, "steps": 100, "preset": "own-value", "scenario": PENDULUM},
    ),
    "a pendulum, learned": (
        1, {"seeds": 2, "episodes": 10, "steps": 100, "preset": "own-value", "scenario": LEARNED,
            "learner": {"predictor": {"kind": "learned"}}},
    ),
}  # fmt: skip
PLAN = (
    "import sys; import nested_agents as na; "
    "print(*na.plan(sys.argv[1], jobs=int(sys.argv[2])).seconds)"
)


def measure(spec: Path, jobs: int) -> tuple[float, float, float, float, float]:
    """Return from and to, how long planning and the study took, the latter's processor time [s]."""
    begin = time.monotonic()
    run = subprocess.run(
        [sys.executable, "-c", PLAN, spec, str(jobs)], check=True, capture_output=True, text=True
    )
    planned = time.monotonic()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "nested_agents", "run", spec, "--jobs", str(jobs)]
    subprocess.run([*command, "--out", spec.with_suffix("")], check=True, capture_output=True)
    took, now = time.monotonic() - planned, resource.getrusage(resource.RUSAGE_CHILDREN)
    begun, end = map(float, run.stdout.split())
    processor = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
    return begun, end, planned - begin, took, processor


def main() -> int:
    """Plan and run; print a row a study; 1 if fewer than 19 of 20 ranges held."""
    parser = argparse.ArgumentParser(prog="python -m research.plans", description=__doc__)
    parser.add_argument("--only", metavar="TEXT", default="", help="studies whose name has it")
    options = parser.parse_args()
    chosen = {name: study for name, study in STUDIES.items() if options.only in name}
    held, widths = 0, []
    columns = ("study", "processes", "from to [s]", "took [s]", "processor [s]", "held")
    columns += ("planning [s]", "load")
    print(f"| {' | '.join(columns)} |\n{'|---' * len(columns)}|")
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, (jobs, table)) in enumerate(chosen.items()):
            spec = Path(folder) / f"{number}.toml"
            spec.write_text(dumps(Spec.of(table).table()))
            begun, end, planning, took, processor = measure(spec, jobs)
            held += begun <= took <= end
            widths.append(end / begun)
            print(
                f"| {name} | {jobs} | {begun:.1f} {end:.1f} | {took:.1f} | {processor:.1f} | "
                f"{'yes' if begun <= took <= end else '**no**'} | {planning:.1f} | "
                f"{os.getloadavg()[0]:.1f} |",
                flush=True,
            )
    print(f"\n{held} of {len(chosen)} held; the median range is {median(widths):.1f} times wide")
    return 0 if held >= 0.95 * len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main())
