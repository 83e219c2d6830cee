"""How fast releases are beside each other: ``python -m benchmarks.releases``.

Of every release a folder has the file of one run of ``./dev bench``, all of one machine and one
hour. The table is Markdown; brackets have the ratio to the first release.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "releases"
"""Where the files of releases are, each by its version."""


def _step(rule_base: str) -> Callable[[dict[str, Any]], float]:
    def of(run: dict[str, Any]) -> float:
        rows = [r for r in run["exact"] if (r["rule_base"], r["agents"]) == (rule_base, 4)]
        return float(rows[0]["ours_us"])

    return of


def _crowd(run: dict[str, Any]) -> float:
    return float(next(row["total_ms"] for row in run["beyond"] if row["agents"] == 64))


FIGURES: dict[str, Callable[[dict[str, Any]], float]] = {
    "decision and update, 5^7 sigmoid rules [us]": _step("dense"),
    "decision and update, 5^7 triangular rules [us]": _step("compact"),
    "decision and update, order 1 [us]": _step("order 1"),
    "control step of 64 agents [ms]": _crowd,
    "trial by default, per decision [us]": lambda run: float(run["trial"]["decision_us"]),
    "kernels of that trial, compiled [s]": lambda run: float(run["trial"]["compile_s"]),
    "import of `core.team` [s]": lambda run: float(run["import_seconds"]["core.team"]),
    "import of the command line [s]": lambda run: float(run["import_seconds"]["studies.cli"]),
}
"""What is shown, and where a run tells it; four agents where nothing else is said."""


def markdown(folder: Path) -> str:
    """Return the table of all releases in a folder, in the order of their names."""
    runs = {
        path.stem: json.loads(path.read_text(encoding="utf-8"))
        for path in sorted(folder.glob("*.json"))
    }
    lines = [f"| | {' | '.join(runs)} |", f"|---{'|---' * len(runs)}|"]
    for label, figure in FIGURES.items():
        first, *later = [figure(run) for run in runs.values()]
        cells = [_text(first), *(f"{_text(value)} ({value / first:.2f})" for value in later)]
        lines.append(f"| {label} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _text(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.releases", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER, metavar="FOLDER")
    print(markdown(parser.parse_args().folder))


if __name__ == "__main__":
    main()
