"""Memory of a worker process: ``python -m benchmarks.memory``.

The program prints the resident and the private memory of a process after each of its imports, up to
a trial of two steps. Kernels are compiled beforehand.
"""

from __future__ import annotations

import argparse
import subprocess
import sys

from rich.console import Console

from .tables import Row, show

STAGES = {
    "Python": "",
    "numpy": "import numpy",
    "pydantic": "import pydantic",
    "session of a trial": "import nested_agents.studies.trials.session",
    "Box2D": "import Box2D",
    "scenario": "import nested_agents.scenarios.box_pushing.scenario",
    "numba": "import numba",
    "scipy.linalg": "import scipy.linalg",
    "a trial of two steps": (
        "from nested_agents.studies.spec.spec import Spec\n"
        "from nested_agents.studies.trials.session import run_trial\n"
        "from nested_agents.studies.trials.trial import trials_of\n"
        "spec = Spec.of({'seeds': 1, 'episodes': 1, 'steps': 2, 'evaluation': 1})\n"
        "run_trial(trials_of(spec)[0])"
    ),
}
"""Statements that a worker executes, in this order."""
RESIDENT = """
import sys
for stage in sys.argv[1:]:
    exec(stage)
    lines = open("/proc/self/smaps_rollup").read().splitlines()[1:]
    kilobytes = {name: int(rest.split()[0]) for name, rest in (l.split(":", 1) for l in lines)}
    private = kilobytes["Private_Clean"] + kilobytes["Private_Dirty"]
    print(kilobytes["Rss"] / 1024, private / 1024)
"""
COLUMNS = {"after": "after", "resident": "resident\n\\[MB]", "private": "private\n\\[MB]"}


def measure() -> list[Row]:
    """Return the memory of a process after each stage; a first process compiles the kernels."""
    line = [sys.executable, "-c", RESIDENT, *STAGES.values()]
    outputs = [subprocess.run(line, capture_output=True, text=True, check=True) for _ in range(2)]
    sizes = [map(float, line.split()) for line in outputs[1].stdout.splitlines()]
    return [
        {"after": name, "resident": round(resident), "private": round(private)}
        for name, (resident, private) in zip(STAGES, sizes, strict=True)
    ]


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(prog="python -m benchmarks.memory", description=__doc__).parse_args()
    show(Console(width=80), "A worker", COLUMNS, measure())


if __name__ == "__main__":
    main()
