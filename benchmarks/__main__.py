"""Run the benchmarks: ``python -m benchmarks [--full] [--json FILE]``."""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from rich.console import Console

from . import measures, tables
from .machine import machine

FOLDER = Path("out", "benchmarks")
"""Where runs are kept, one file each."""


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="under a minute; the default")
    size.add_argument("--full", action="store_true", help="all sizes, longer rounds")
    size.add_argument("--smoke", action="store_true", help="one tiny case, to see that it runs")
    parser.add_argument(
        "--json", type=Path, metavar="FILE",
        help=f"where everything is written; {FOLDER}/DATE.json unless said otherwise",
    )  # fmt: skip
    options = parser.parse_args()
    exact = {"dense": (2, 4, 6), "dense32": (4,), "compact": (2, 4, 6), "order 1": (4,)}
    beyond, budget = {"order 1": (16, 64, 128)}, 1.0
    if options.full:
        exact = {name: (2, 4, 6, 8, 10) for name in ("dense", "compact", "order 1")}
        exact["dense32"] = (4,)
        beyond = {"order 1": (8, 16, 32, 64, 128), "compact": (128,)}
        budget = 5.0
    if options.smoke:
        exact, beyond, budget = {"compact": (2,), "order 1": (2,)}, {"order 1": (16,)}, 0.0
    console = Console(width=80)
    began = os.getloadavg()[0]
    steps = [measures.steps(kind, n, budget) for kind, ns in exact.items() for n in ns]
    tables.show(console, "Decision + TD update, exact enumeration", tables.STEPS, steps)
    large = [measures.large(kind, n, budget) for kind, ns in beyond.items() for n in ns]
    tables.show(console, "A control step beyond enumeration", tables.LARGE, large)
    imports = measures.import_seconds(1 if options.smoke else 3)
    for name, seconds in imports.items():
        console.print(f"{name:>14} {seconds:5.2f} s to start and import")
    trial = measures.trial_seconds(1 if options.smoke else 20, compiled=options.smoke)
    console.print(
        "a trial by default: {compile_s:.1f} s to compile, then {trial_s:.2f} s, "
        "{decision_us:.0f} us per decision".format(**trial)
    )
    ended = os.getloadavg()[0]
    console.print(
        f"load {began:.1f} before, {ended:.1f} after, on {os.cpu_count()} cores; ja: joint action"
    )
    ran_on = machine()
    console.print(
        "this machine: bytecode {bytecode_mhz:.1f} MHz, arithmetic {arithmetic_gflops:.1f} GFLOPS, "
        "memory {memory_gb_s:.1f} GB/s".format(**ran_on["speed"]),
    )
    ran_on |= {"load_at_start": began, "load_at_end": ended}
    result = {
        "machine": ran_on, "exact": steps, "beyond": large, "trial": trial,
        "import_seconds": imports,
    }  # fmt: skip
    path = options.json or FOLDER / f"{ran_on['date'].replace(':', '-')}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    console.print(f"kept in {path}", soft_wrap=True)


if __name__ == "__main__":
    main()
