"""Rerun one condition of every published table and compare the estimates.

``python -m research.check`` reruns one condition of each published table: the first of which
enough seeds took at most `MAX_MINUTES` of processor time. It prints the estimate of the published
trials of these seeds, the new estimate, and whether they agree: each must lie in the other's
interval. The runs are kept in ``out/check``, so that the same command continues an interrupted
check. A table that is not rerun, because too few seeds fit into the time, is named.
"""

import argparse
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import nested_agents as na
from nested_agents.analysis import (
    Estimate,
    Results,
    column_value,
    estimate_of,
    evaluated,
    format_estimate,
)
from nested_agents.terminal import print_lines, run_to_status

from . import RESULTS, load

MAX_MINUTES = 1.0
"""Processor time that the published trials of a checked condition took at most [min]."""
MIN_SEEDS = 3
"""Fewest seeds for which an interval says anything."""
ENOUGH_SEEDS = 10
"""Seeds of which no more are needed to prefer a condition to those listed before it."""
LAST_DIGIT = 0.01
"""Last digit that is printed, to which bounds are rounded outward."""
HEADER = (
    "| table | condition | seeds | measure | published | new | |",
    "|---|---|---|---|---|---|---|",
)
Spec = Mapping[str, Any]


@dataclass(frozen=True)
class PublishedCondition:
    """A condition of a published table that can be rerun."""

    name: str
    condition: str
    seeds: tuple[int, ...]
    """The first published seeds that fit into the time."""
    spec: Spec
    """The spec of that condition with these seeds."""


def find_condition(name: str, max_minutes: float) -> PublishedCondition | None:
    """Return the first condition of which enough seeds fit, or None without `MIN_SEEDS`."""
    published = json.loads((RESULTS / f"{name}.json").read_text())
    seconds = {
        condition: np.cumsum(usage["total"])
        for condition, usage in published["usage"].items()
        if "total" in usage
    }
    fitting = {
        condition: int(np.searchsorted(times, 60.0 * max_minutes, side="right"))
        for condition, times in seconds.items()
    }
    condition = max(fitting, key=lambda own: min(fitting[own], ENOUGH_SEEDS), default="")
    n_seeds = fitting.get(condition, 0)
    if n_seeds < MIN_SEEDS:
        return None
    seeds = published["seeds"][condition]  # a number, or a list
    seeds = tuple(range(seeds) if isinstance(seeds, int) else seeds)[:n_seeds]
    return PublishedCondition(
        name,
        condition,
        seeds,
        select_condition(published["spec"], published["columns"][condition]) | {"seeds": seeds},
    )


def select_condition(spec: Spec, column: Spec) -> dict[str, Any]:
    """Return the spec of one condition: its override and one value for each swept key.

    Files are named relative to the published table, and in the returned spec by their full path.
    """
    matching = [
        narrow_sweep(override, column)
        for override in spec.get("overrides", [])
        if override["name"] == column["name"]
        and all(
            column[key] in map(column_value, values)
            for key, values in override.get("sweep", {}).items()
        )
    ]
    selected = narrow_sweep(spec, column) | {"overrides": matching}
    if selected.get("study") == "hierarchies":  # refuses a single one; scaling measures the same
        selected["study"] = "scaling"
    return with_full_paths({key: v for key, v in selected.items() if v not in ({}, [])})


def with_full_paths(spec: Spec) -> dict[str, Any]:
    """Return a published spec with the full paths of the files that it names."""
    files = re.compile(r'(?<=")\.\./[^"]*(?=\.py:)')
    table: dict[str, Any] = json.loads(
        files.sub(lambda path: str((RESULTS / path[0]).resolve()), json.dumps(spec))
    )
    return table


def narrow_sweep(table: Spec, column: Spec) -> dict[str, Any]:
    """Return a table whose swept keys have the one value of a condition."""
    narrowed = {
        key: [value for value in values if column_value(value) == column[key]] or [column[key]]
        for key, values in table.get("sweep", {}).items()
    }
    return dict(table, sweep=narrowed)


def estimates(results: Results, condition: str) -> dict[str, Estimate]:
    """Return the estimates of a condition by title, after training where it was evaluated."""
    return evaluated(results, condition) or {
        f"training {results.main.title}": estimate_of(results, condition, "training", results.main)
    }


def agree(published: Estimate, new: Estimate) -> bool:
    """Return whether each of two estimates lies in the interval of the other, as printed."""
    pairs = ((published, new), (new, published))
    return all(other.low - LAST_DIGIT < own.value < other.high + LAST_DIGIT for own, other in pairs)


def lines(rerun: PublishedCondition, out: Path, jobs: int | None) -> Iterator[str]:
    """Rerun a condition, and yield a row of the table for each of its estimates."""
    study = na.run(rerun.spec, out / rerun.name, jobs=jobs, progress=False)
    (condition,) = study.results.conditions
    chosen = " or ".join(f"seed == {seed}" for seed in rerun.seeds)
    published = estimates(load(rerun.name).where(chosen).results, rerun.condition)
    for title, new in estimates(study.results, condition).items():
        if title not in published:  # a measure that is younger than the table
            continue
        old = published[title]
        verdict = "agree" if agree(old, new) else "**disagree**"
        yield (
            f"| {rerun.name} | {rerun.condition} | {len(rerun.seeds)} | {title} "
            f"| {format_estimate(old)} | {format_estimate(new)} | {verdict} |"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Rerun the tables named, by default all, and return 1 if any estimate disagrees."""
    parser = argparse.ArgumentParser(prog="python -m research.check", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="published tables; default all")
    parser.add_argument("--out", type=Path, default=Path("out/check"), help="folder of the runs")
    parser.add_argument("--jobs", type=int, help="number of worker processes")
    parser.add_argument("--minutes", type=float, default=MAX_MINUTES, help="limit of a condition")
    options = parser.parse_args(arguments)
    names = options.names or sorted(path.stem for path in RESULTS.glob("*.json"))
    print_lines(HEADER)
    disagrees = False
    for name in names:
        rerun = find_condition(name, options.minutes)
        if rerun is None:
            print_lines([f"| {name} | | | | | | not run |"])
            continue
        try:
            for line in lines(rerun, options.out, options.jobs):
                print_lines([line])
                disagrees |= "disagree" in line
        except na.SpecError as error:  # a plug-in that is not installed
            print_lines([f"| {name} | {rerun.condition} | | | | | not run: {error} |"])
    return int(disagrees)


if __name__ == "__main__":
    raise SystemExit(run_to_status("research.check", main))
