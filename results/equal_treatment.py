"""Edges with equal treatment: plans for the unseen, whichever relations agents have.

``python -m nested_agents.results.equal_treatment`` prints the tables of docs/edges.md from the rows
of `FILES` that are there: success with plans, and how success and decisions compare with the chain,
in each setting and over all of them. Measures and margins were named in ``edges/again.toml``.
"""

from collections.abc import Iterator, Mapping

from ..studies.api.loading import load
from ..studies.catalogue.edges import TRAINED, analyse
from ..studies.catalogue.hierarchies.pooled import Effect, effects
from ..studies.cli.display import print_text
from ..studies.results.analysis import EVALUATED
from ..studies.results.notation import bracketed, two_decimals
from ..studies.results.results import Results
from . import ROWS

FILES = {
    "2 robots, own": "edges-again",
    "2 robots, team": "edges-again-team",
    "4 robots, own": "edges-again-4",
    "4 robots, team": "edges-again-4-team",
    "8 robots, own": "edges-again-8",
}
"""Names of rows by setting."""
HOW = ("told, own plans", "told only, plans", "neither, plans")
"""Evaluations of these rows, in the order of columns."""


def settings() -> dict[str, Results]:
    """Return the rows of every setting that has been run."""
    paths = {setting: ROWS / f"{name}.json" for setting, name in FILES.items()}
    return {s: load(path).results for s, path in paths.items() if path.is_file()}


def lines() -> list[str]:
    """Return the two tables of the page."""
    every = settings()
    table = [
        f"| team | seeds | {TRAINED} | {' | '.join(HOW)} |",
        "|---|---|---|---|---|---|",
    ]
    beside = ["| beside the chain | success | | decisions to the goal | |", "|---|---|---|---|---|"]
    for setting, results in every.items():
        cases = {case.hierarchy: case for case in analyse(results).cases}
        cells = [bracketed(cases[name].values[EVALUATED]) for name in (TRAINED, *HOW)]
        n_seeds = len(results.seeds(cases[TRAINED].condition))
        table.append(f"| {setting} | {n_seeds} | {' | '.join(cells)} |")
        beside += _compared(setting, effects(results, list(cases.values()), TRAINED))
    whole = load(*(ROWS / f"{FILES[setting]}.json" for setting in every)).results
    if len(every) > 1:
        over_all = effects(whole, analyse(whole).cases, TRAINED)
        beside += _compared(f"all {len(every)} settings", over_all)
    return [*table, "", *beside]


def _compared(setting: str, of: Mapping[str, tuple[Effect, Effect]]) -> Iterator[str]:
    """Yield a line of the second table for every evaluation."""
    for name in HOW:
        success, decisions = of[name]
        yield (
            f"| {setting}: {name} | {bracketed(success.estimate)} | {success.verdict} "
            f"| {bracketed(decisions.estimate, two_decimals)} times | {decisions.verdict} |"
        )


if __name__ == "__main__":
    print_text(*lines())
