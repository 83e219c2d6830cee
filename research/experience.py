"""Networks at the field's budgets: tables by decisions, what an edge and foresight are worth.

``python -m research.experience`` prints the tables of research/notebooks/ppo.md from the rows
of `TASKS` that are there; with directories of kept studies ``experience`` it prints their rows, as
they are committed (returns if the last word is ``return``). A comparison is of the condition with
edges, less that without, and is judged as ``python -m research.claims --of networks`` does, see
`research.claims.Benefit`.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from nested_agents import SUCCESS, bootstrap, load, rate
from nested_agents.analysis import RETURN as RETURN_MEASURE
from nested_agents.analysis import (
    Difference,
    Estimate,
    Results,
    differences,
    evaluated_after,
    format_estimate,
    format_number,
    format_p,
)
from nested_agents.terminal import print_text

from . import RESULTS, SPECS, FloatArray
from .claims import Benefit, Claim, Finding
from .measures import Measured

RANDOM = "random"
RETURN = "return"
FUZZY = "fuzzy TD"
FITTED = "fitted-q"
CHAIN = "hierarchy-ppo, chain"
SPAN = 0.1
"""Margin of returns: this share of the way from random to the best at the end."""
HALF = 0.5
"""Evaluation success at which decisions of training are compared."""


class PublishedCourse(NamedTuple):
    """A task whose rows are published."""

    title: str
    """In claims."""
    shown: tuple[int, ...]
    """Decisions of training after which its table has a column."""
    episodes: int
    """Of an evaluation."""
    margin: float | None = 0.1
    """Within which a difference is none that matters; none: `SPAN`."""
    edges: str = CHAIN
    """The condition with edges."""
    without: str = "hierarchy-ppo, no edges"
    """The condition that it is compared with."""


TASKS = {
    "spread": PublishedCourse(
        "simple_spread", (1000, 10_000, 100_000, 300_000, 1_000_000), 100, 1.0
    ),
    "vmas": PublishedCourse("balance of VMAS", (1000, 3000, 10_000, 30_000, 100_000), 4, None),
    "aloha": PublishedCourse(
        "Aloha of MACO",
        (1000, 3000, 10_000, 30_000, 100_000),
        50,
        0.5,
        edges="hierarchy-ppo, neighbors' edges",
    ),
    "landmarks": PublishedCourse("landmarks of five", (1000, 3000, 10_000, 30_000), 100),
    "ring": PublishedCourse(
        "a ring of eight", (1000, 3000, 10_000, 30_000), 1, edges="hierarchy-ppo, own edges"
    ),
    "arm": PublishedCourse("an arm of four", (1000, 10_000, 30_000, 100_000, 400_000), 25, 0.05),
    "arm-16": PublishedCourse("an arm of sixteen", (1000, 3000, 10_000, 30_000, 100_000), 10),
    "box": PublishedCourse("a box, two robots", (1000, 3000, 10_000, 30_000, 100_000), 10),
    "box-again": PublishedCourse(
        "a box, two robots, other seeds", (1000, 3000, 10_000, 30_000, 100_000), 10
    ),
    "four-robots": PublishedCourse("a box, four robots", (1000, 3000, 10_000, 30_000, 100_000), 5),
}
"""By the name of their rows."""


def read(name: str) -> pd.DataFrame:
    """Return the rows of a task: condition, decisions, seed, and success or return."""
    return pd.read_csv(RESULTS / f"{name}-experience.csv").sort_values("seed", kind="stable")


def committed() -> list[str]:
    """Return the tasks whose rows are there."""
    return [name for name in TASKS if (RESULTS / f"{name}-experience.csv").is_file()]


def rows_of(results: Results, budget: int, measure: str = SUCCESS.name) -> pd.DataFrame:
    """Return means of evaluations by condition, decisions and seed, as they are committed.

    The last one counts as after the `budget`, which a whole rollout may exceed. If nobody ever
    succeeds, the return is measured.
    """
    conditions = sorted(results.of_phase("evaluation"))
    if not any(results.success(condition, "evaluation").any() for condition in conditions):
        measure = RETURN
    rows = []
    for condition in conditions:
        stops = evaluated_after(results, condition) | {budget: "evaluation"}
        for decisions, phase in sorted(stops.items()):
            for seed, value in results.means(condition, phase, measure).items():
                rows.append((condition, decisions, seed, round(float(value), 3)))
    return pd.DataFrame(rows, columns=["condition", "decisions", "seed", measure])


def lines(name: str) -> Iterator[str]:
    """Yield the table of a task, a line for every condition."""
    task = TASKS[name]
    yield f"| condition | {' | '.join(f'{n:,}' for n in task.shown)} |"
    yield "|" + " --- |" * (1 + len(task.shown))
    for condition, own in read(name).groupby("condition"):
        cells = []
        for n in task.shown:
            means = own[own["decisions"] == n].iloc[:, -1].to_numpy()
            cells.append(
                format_estimate(_estimate(means, own.columns[-1], task)) if len(means) else ""
            )
        yield f"| {condition} | {' | '.join(cells)} |"


def _estimate(means: FloatArray, measure: str, task: PublishedCourse) -> Estimate:
    """Return the mean of evaluations by seed with its interval."""
    if measure == RETURN:
        return bootstrap(means)
    reached = np.rint(task.episodes * means)[:, None]
    return rate(np.arange(task.episodes) < reached)


def spec_of(name: str) -> Path:
    """Return where the spec of a task's networks is."""
    return SPECS / f"{name}-experience.toml"


class EdgeWorth(NamedTuple):
    """What an edge is worth to networks at the end of training in a task."""

    name: str
    """Of the task, by that of its rows."""
    compared: Difference
    """With edges less without."""
    margin: float
    """Within which it is nothing."""

    @property
    def finding(self) -> Finding:
        """The claim that edges help, and its verdict."""
        task = TASKS[self.name]
        edges = task.edges.partition(", ")[2]
        claim = Claim(
            self.name,
            f"{task.title}: edges help networks",
            "",
            f"{self.name}-experience",
            f"{self.compared.measure} after {task.shown[-1]:,} decisions, {edges} less no edges",
            Benefit(self.margin),
        )
        compared = self.compared
        return Finding(claim, Measured(compared.estimate, compared.seeds, compared.p))


def edge(name: str, rows: pd.DataFrame) -> EdgeWorth:
    """Return what an edge is worth in a task, by its rows."""
    task = TASKS[name]
    measure = rows.columns[-1]
    of_networks = rows[~rows["condition"].str.startswith((FUZZY, FITTED))]
    last = of_networks[of_networks["decisions"] == task.shown[-1]]
    ends = last.pivot_table(index="seed", columns="condition", values=measure)
    pairs = [(c, measure, ends[task.edges], ends[c]) for c in ends if c != task.edges]
    compared = differences({name: pairs}, SUCCESS if measure == SUCCESS.name else RETURN_MEASURE)[
        name
    ]
    (worth,) = [d for d in compared if d.condition == task.without]
    means = ends.mean()
    span = SPAN * float(means.max() - means[RANDOM])
    return EdgeWorth(name, worth, span if task.margin is None else task.margin)


def edges() -> list[EdgeWorth]:
    """Return what an edge is worth in every task, by the committed rows."""
    return [edge(name, read(name)) for name in committed()]


def edge_lines() -> Iterator[str]:
    """Yield a table of what edges are worth, a line for every task."""
    yield "| rows | seeds | decisions | with edges minus without | p | margin | edge |"
    yield "|---|---|---|---|---|---|---|"
    for worth in edges():
        cells = (
            worth.name,
            str(worth.compared.seeds),
            f"{TASKS[worth.name].shown[-1]:,}",
            format_estimate(worth.compared.estimate),
            format_p(worth.compared.p).removeprefix("= "),
            format_number(worth.margin),
            worth.finding.verdict,
        )
        yield f"| {' | '.join(cells)} |"


class RulesWorth(NamedTuple):
    """How many times as many decisions networks need as agents with fuzzy rules."""

    times: Estimate
    """The ratio; geometric mean over seeds."""
    missed: int
    """Seeds of networks that did not get there, counted as if they had at the end."""


def decisions_to(own: pd.DataFrame, criterion: float = HALF) -> tuple[pd.Series, int]:
    """Return after how many decisions seeds succeed so often, and how many seeds never do.

    Between evaluations success is linear in the logarithm of decisions. Whoever is there at the
    first evaluation is counted by it, and who never is by the last one.
    """
    wide = own.pivot_table(index="seed", columns="decisions", values=SUCCESS.name)
    logs = np.log(wide.columns.to_numpy(float))
    reached = []
    missed = 0
    for _, success in wide.iterrows():
        values = success.to_numpy()
        above = np.flatnonzero(values >= criterion)
        if not len(above):
            missed += 1
            reached.append(logs[-1])
        elif above[0] == 0:
            reached.append(logs[0])
        else:
            after = above[0]
            ends = slice(after - 1, after + 1)
            reached.append(np.interp(criterion, values[ends], logs[ends]))
    return pd.Series(np.exp(reached), wide.index), missed


def foresight(name: str, fuzzy: str = FUZZY) -> RulesWorth:
    """Return what fuzzy rules save in a task, with a predictor or, by `FITTED`, without."""
    rows = read(name)
    needed, missed = decisions_to(rows[rows["condition"] == TASKS[name].edges])
    own, _ = decisions_to(rows[rows["condition"] == fuzzy])
    estimate = bootstrap(np.log(needed / own).dropna().to_numpy())
    return RulesWorth(Estimate(*map(np.exp, estimate)), missed)


def foresight_lines() -> Iterator[str]:
    """Yield a table of what fuzzy rules save, a line for every task and kind of predictor."""
    until = f"decisions of networks with edges, until success is {format_number(HALF)}"
    yield f"| rows | condition | {until} |"
    yield "|---|---|---|"
    for name in committed():
        conditions = read(name)["condition"].unique()
        without_predictor = TASKS[name].edges.replace("hierarchy-ppo", FITTED)
        for fuzzy in sorted(c for c in conditions if c.startswith((FUZZY, without_predictor))):
            times, missed = foresight(name, fuzzy)
            never = f", {missed} seeds never" if missed else ""
            yield f"| {name} | {fuzzy} | {format_estimate(times)} times{never} |"


def main(places: list[str]) -> None:
    """Print the rows of kept studies, or the tables of committed ones."""
    if places:
        measure = places.pop() if places[-1] == RETURN else SUCCESS.name
        kept = [load(place) for place in places]
        frames = [rows_of(one.results, one.outline.table["decisions"], measure) for one in kept]
        print_text(pd.concat(frames).to_csv(index=False).strip())
        return
    for name in committed():
        print_text("\n".join((name, "", *lines(name), "")))
    print_text("\n".join((*edge_lines(), "", *foresight_lines())))


if __name__ == "__main__":
    main(sys.argv[1:])
