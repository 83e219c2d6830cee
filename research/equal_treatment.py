"""Edges with equal treatment: plans for the unseen, whichever relations agents have.

``python -m research.equal_treatment`` prints the tables of research/notebooks/edges.md from rows
of `BOXES` and `OTHERS` that are there: success with plans, and how success and decisions compare
with the chain, in each setting and over all boxes. Measures and margins were named in
``edges-again.toml``.
"""

from collections.abc import Iterator, Mapping

from nested_agents import load
from nested_agents.analysis import EVALUATED, Results, SizedCase, format_estimate
from nested_agents.terminal import print_text

from . import RESULTS
from .studies.edges import TRAINED, Effect, analyse, effects

BOXES = {
    "2 robots, own": "edges-again",
    "2 robots, team": "edges-again-team",
    "4 robots, own": "edges-again-4",
    "4 robots, team": "edges-again-4-team",
    "8 robots, own": "edges-again-8",
}
"""Names of rows by setting."""
OTHERS = {"4 joints, ": "edges-arms-again", "": "edges-games-again"}
"""Names of rows of several settings each, by what begins the names of these."""
HOW = ("told, own plans", "told only, plans", "neither, plans")
"""Evaluations of these rows, in the order of columns."""
Cases = list[SizedCase]


def settings() -> Iterator[tuple[str, Results, Cases]]:
    """Yield every setting that has been run: its name, its rows and what is compared in it."""
    for setting, name in (BOXES | OTHERS).items():
        path = RESULTS / f"{name}.json"
        if path.is_file():
            results = load(path).results
            cases = analyse(results).cases
            for own in dict.fromkeys(case.setting for case in cases):
                shown = setting if setting in BOXES else setting + own
                yield shown, results, [case for case in cases if case.setting == own]


def lines() -> list[str]:
    """Return the two tables of the page."""
    table = [
        f"| team | seeds | {TRAINED} | {' | '.join(HOW)} |",
        "|---|---|---|---|---|---|",
    ]
    beside = [
        "| compared with the chain | success | | decisions to the goal | |",
        "|---|---|---|---|---|",
    ]
    for setting, results, cases in settings():
        values = {case.name: format_estimate(case.values[EVALUATED]) for case in cases}
        n_seeds = len(results.seeds(cases[0].condition))
        cells = " | ".join(values[name] for name in (TRAINED, *HOW))
        table.append(f"| {setting} | {n_seeds} | {cells} |")
        if setting in BOXES:
            beside += _compared(setting, effects(results, cases, TRAINED))
    paths = [RESULTS / f"{name}.json" for name in BOXES.values()]
    boxes = load(*(path for path in paths if path.is_file())).results
    if len(boxes.conditions) > 1:
        over_all = effects(boxes, analyse(boxes).cases, TRAINED)
        beside += _compared(f"all {len(boxes.conditions)} settings", over_all)
    return [*table, "", *beside]


def _compared(setting: str, of: Mapping[str, tuple[Effect, Effect]]) -> Iterator[str]:
    """Yield a line of the second table for every evaluation."""
    for name in HOW:
        success, decisions = of[name]
        yield (
            f"| {setting}: {name} | {format_estimate(success.estimate)} | {success.verdict} "
            f"| {format_estimate(decisions.estimate)} times | {decisions.verdict} |"
        )


if __name__ == "__main__":
    print_text(*lines())
