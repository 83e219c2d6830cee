"""Run the benchmarks of speed: ``python -m benchmarks [--full]``.

Decisions of teams, start-up of commands and the overhead of the runner, then the speed of this
machine on three fixed loads, by which figures of two machines compare. Every part is a program of
its own with further options, ``python -m benchmarks.NAME``.
"""

from __future__ import annotations

import argparse
import runpy
import sys

from .machine import machine

QUICK = {
    "decisions": ["--robots", "2", "8", "64", "--number", "10", "--joints", "16"],
    "startup": ["--rounds", "3"],
    "runner": ["--trials", "4", "--rounds", "1"],
}
"""Arguments of a run of about a minute, by program."""
FULL: dict[str, list[str]] = {"decisions": [], "startup": [], "runner": [], "memory": []}
"""Arguments of a run of all sizes, by program."""


def main() -> None:
    """Run the programs in this process, one after the other."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--full", action="store_true", help="all sizes, and memory")
    options = parser.parse_args()
    for name, arguments in (FULL if options.full else QUICK).items():
        sys.argv = [name, *arguments]
        runpy.run_module(f"benchmarks.{name}", run_name="__main__")
    print(
        "this machine: bytecode {bytecode_mhz:.1f} MHz, arithmetic {arithmetic_gflops:.1f} GFLOPS, "
        "memory {memory_gb_s:.1f} GB/s".format(**machine()["speed"]),
    )


if __name__ == "__main__":
    main()
