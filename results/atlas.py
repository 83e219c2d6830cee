"""The atlas: tasks, hierarchies, learners, faults, sizes; and what small teams tell of large ones.

Each spec in ``specs/atlas`` is a task. Its conditions are called *hierarchy, learner* or
*hierarchy, learner, fault*. Of every trial a row is kept, in a file of Parquet for each task; the
file ``published`` has trials of studies that have been published already, see `PUBLISHED`. From
these rows all numbers and figures are made again.

Laws are fitted to teams of at most `SMALL` agents, and tested on larger ones, which they have not
seen. The best hierarchy is predicted alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core.numerics import pd, stats
from ..core.plugins.words import closest
from ..studies.api.loading import load
from ..studies.api.running import run
from ..studies.errors import SpecError
from ..studies.presentation.progress import Terminal
from ..studies.results import laws
from ..studies.results.analysis import format_p
from ..studies.results.foreign import read_table
from ..studies.results.notation import bracketed, signed, two_figures
from ..studies.results.results import Results
from ..studies.results.statistics import Estimate, bootstrap, holm
from ..studies.spec.controls import LEARN_NOTHING
from ..studies.spec.tables import label_but
from ..studies.store import durable
from . import ROWS, SPECS

COMMITTED = ROWS / "atlas"
"""Where the rows are that have been published."""
SMALL = 16
"""Agents of the largest teams that laws are fitted to."""
NO_FAULT = "none"
LOST = "lost "
"""With what the name of a fault begins that is a probability of losing a message."""

MEASURES = {
    "success": "success",
    "right": "share right",
    "steps": "decisions of an episode",
    "final_distance_m": "final distance",
    "final_spread_m": "spread at the end",
    "loss": "loss",
    "messages": "messages",
    "decision_median": "time of a decision",
    "team_bytes": "memory",
}
"""What laws are fitted to, and what it is called. Loss is the return with the sign turned."""
SIZES = ("scenario.robots", "scenario.joints", "scenario.players", "scenario.carts")
"""Keys that are sizes of teams."""
PUBLISHED = {
    "arms": ("arms", "chain", "batch-td"),
    "long-arms": ("arms", "chain", "batch-td"),
    "fit-arms": ("arms", "", "fitted-q"),
    "scaling": ("boxes", "chain", "batch-td"),
    "controls": ("boxes", "chain", ""),
    "costs": ("boxes", "chain", ""),
    "fit-rings": ("rings", "", "fitted-q"),
    "fit-landmarks": ("landmarks", "", "fitted-q"),
}
"""Published studies whose rows are taken over: task, hierarchy and learner, where the name of a
condition is not one of them."""
CONTROLS = (*LEARN_NOTHING, "random")
ALREADY = "published"
"""The task whose rows are those."""
QUALITIES = {"signals": ("right", 1), "games": ("return", 1)}
"""By what hierarchies of a task are ranked, and its sign; of other tasks by success."""


class TeamKind(NamedTuple):
    """A team of any size."""

    task: str
    hierarchy: str
    learner: str
    fault: str = NO_FAULT


class Check(NamedTuple):
    """A law of small teams, and what a larger one did."""

    team: TeamKind
    measure: str
    size: int
    law: str
    """Which law it is."""
    predicted: Estimate
    """The mean of as many seeds, with its 90 % interval."""
    measured: float

    @property
    def is_inside(self) -> bool:
        """Whether the interval has what was measured."""
        return bool(self.predicted.low <= self.measured <= self.predicted.high)


class HierarchyChoice(NamedTuple):
    """Which hierarchy is best for large teams, as predicted and as measured."""

    task: str
    learner: str
    size: int
    predicted: str
    """The best of the largest small teams."""
    measured: str
    p: float
    """That the best differs from the predicted one, or if it is this, from the second; by seed."""

    def __str__(self) -> str:
        is_right = self.predicted == self.measured
        verdict = "best, less the second" if is_right else f"{self.measured} is better"
        head = f"{self.task}, {self.learner}, {self.size} agents: {self.predicted} was predicted"
        return f"{head}: {verdict} (p {format_p(self.p)})"


class MessageLoss(NamedTuple):
    """What losing messages costs."""

    task: str
    hierarchy: str
    size: int
    probability: float
    """Of losing a message."""
    difference: Estimate
    """Of quality, from losing none, with its 95 % interval over seeds."""
    p: float
    """Adjusted by Holm over a task's comparisons."""

    def __str__(self) -> str:
        head = f"{self.task}, {self.hierarchy}, {self.size} agents, {self.probability:g} lost"
        return f"{head}: {bracketed(self.difference, signed)}, p {format_p(self.p)}"


def run_tasks(out: Path, jobs: int | None, tasks: Sequence[str] = ()) -> Path:
    """Run what is left of tasks below `out`, by default of all; return the folder of rows.

    Raises
    ------
    SpecError
        If there is no such task, or trials failed.
    """
    folder = out / "rows"
    folder.mkdir(parents=True, exist_ok=True)
    specs = {path.stem: path for path in sorted((SPECS / "atlas").glob("*.toml"))}
    for task in tasks or (ALREADY, *specs):
        if task == ALREADY:
            rows = published_rows()
        elif task in specs:
            rows = _run(task, specs[task], out / task, jobs)
        else:
            raise SpecError(f"--task = {task!r}: {closest(task, (ALREADY, *specs))}")
        durable.write(folder / f"{task}.parquet", rows.to_parquet(index=False))
    return folder


def _run(task: str, spec: Path, out: Path, jobs: int | None) -> pd.DataFrame:
    study = run(spec, out, jobs=jobs, observer=Terminal())
    if study.failed:
        raise SpecError(f"{out}: {len(study.failed)} trials failed: nested-agents status {out}")
    names = {c: str(own["name"]).split(", ") for c, own in study.results.columns.items()}
    teams = {c: TeamKind(task, *parts) for c, parts in names.items()}
    return trial_rows(study.results, teams)


def published_rows() -> pd.DataFrame:
    """Return the rows of `PUBLISHED`: a condition's name stands where that has none."""
    frames = []
    for name, (task, hierarchy, learner) in PUBLISHED.items():
        results = load(ROWS / f"{name}.json").results
        teams = {}
        for condition, own in results.columns.items():
            label = label_but(own, SIZES)
            is_control = label in CONTROLS
            teams[condition] = TeamKind(
                task,
                hierarchy or ("none" if is_control else label),
                label if is_control else learner or label,
            )
        frames.append(trial_rows(results, teams))
    return pd.concat(frames, ignore_index=True)


def trial_rows(results: Results, teams: Mapping[str, TeamKind]) -> pd.DataFrame:
    """Return a row for each trial with an evaluation: team, size, seed, and what was measured."""
    names = ["steps", "return", *(m.name for m in results.measures if m.name in MEASURES)]
    frames = []
    for condition in results.of_phase("evaluation"):
        size = next(
            results.columns[condition][key] for key in SIZES if key in results.columns[condition]
        )
        own = {
            name: results.means(condition, "evaluation", name).to_numpy()
            for name in names
            if results.has(condition, "evaluation", name)
        }
        numbers = results.numbers(condition)
        own |= {name: numbers[name] for name in MEASURES if name in numbers}
        episodes = results.values(condition, "success", "evaluation").shape[1]
        where = {"size": size, "seed": results.seeds(condition), "episodes": episodes}
        frames.append(pd.DataFrame({**teams[condition]._asdict(), **where, **own}))
    return pd.concat(frames, ignore_index=True)


def read_rows(folder: Path = COMMITTED) -> pd.DataFrame:
    """Return the rows of all tasks in a folder.

    Raises
    ------
    SpecError
        If there are none, or pyarrow is not installed.
    """
    files = sorted(folder.glob("*.parquet"))
    if not files:
        raise SpecError(f"{folder}: holds no rows of the atlas, TASK.parquet")
    rows = pd.concat([read_table(path) for path in files], ignore_index=True)
    return rows.assign(loss=-rows["return"]) if "return" in rows else rows


def sample_of(rows: pd.DataFrame, measure: str) -> laws.Sample | None:
    """Return what one team's rows have of a measure; None if no law can be of it.

    Those are values that are not positive, or the same everywhere.
    """
    if measure not in rows:
        return None
    values = rows.pivot(index="seed", columns="size", values=measure).dropna(axis=1, how="all")
    values = values.dropna()
    array = values.to_numpy(dtype=float)
    if not array.size or np.ptp(array) == 0.0:
        return None
    sizes = values.columns.to_numpy(dtype=float)
    if measure == "success":
        episodes = int(rows["episodes"].iloc[0])
        return laws.of_rates(sizes, array * episodes, episodes)
    return laws.of_numbers(sizes, array) if (array > 0.0).all() else None


def checks(rows: pd.DataFrame, small: int = SMALL) -> list[Check]:
    """Return every law of teams of at most `small` agents beside what each larger team did."""
    lines = []
    for (team, own), measure in product(rows.groupby(list(TeamKind._fields), sort=False), MEASURES):
        sample = sample_of(own, measure)
        if sample is None:
            continue
        m = int((sample.sizes <= small).sum())
        first = sample.first(m)
        if m < laws.FEWEST or m == len(sample.sizes) or np.ptp(first.values) == 0.0:
            continue
        law = laws.choose(first)
        for k in range(m, len(sample.sizes)):
            size = int(sample.sizes[k])
            measured = float(sample.scale.back(sample.values[:, k].mean()))
            predicted = law.predict(size)
            lines.append(Check(TeamKind(*team), measure, size, law.curve.name, predicted, measured))
    return lines


def choices(rows: pd.DataFrame, small: int = SMALL) -> list[HierarchyChoice]:
    """Return for larger teams the best hierarchy as the largest of at most `small` agents say."""
    whole = rows[rows["fault"] == NO_FAULT]
    chosen = []
    for (task, learner), own in whole.groupby(["task", "learner"], sort=False):
        measure, sign = quality(str(task))
        means = own.pivot_table(index="seed", columns=["size", "hierarchy"], values=measure) * sign
        sizes = sorted(own["size"].unique())
        known = [n for n in sizes if n <= small]
        for size in sizes[len(known) :] if known else []:
            at = means[size].dropna()
            order = at.mean().sort_values()
            if len(order) < 2 or len(at) < 2:
                continue
            best, second = str(order.index[-1]), str(order.index[-2])
            predicted = str(means[known[-1]].mean().idxmax())
            rival = predicted if predicted != best else second
            p = float(stats.ttest_rel(at[best], at[rival]).pvalue)
            chosen.append(HierarchyChoice(str(task), str(learner), int(size), predicted, best, p))
    return chosen


def losses(rows: pd.DataFrame) -> list[MessageLoss]:
    """Return what losing messages costs, by task, size and probability."""
    lines = []
    for task, own in rows.groupby("task", sort=False):
        measure, sign = quality(str(task))
        lines += _holm(list(_losses(str(task), own, measure, sign)))
    return lines


def _losses(task: str, rows: pd.DataFrame, measure: str, sign: int) -> Iterator[MessageLoss]:
    lost = rows[rows["fault"].str.startswith(LOST)]
    whole = rows[rows["fault"] == NO_FAULT]
    for (hierarchy, learner, fault, size), own in lost.groupby(
        [*TeamKind._fields[1:], "size"], sort=False
    ):
        places = (whole["hierarchy"] == hierarchy) & (whole["size"] == size)
        base = whole[places & (whole["learner"] == learner)].set_index("seed")[measure]
        each = ((own.set_index("seed")[measure] - base) * sign).dropna().to_numpy(dtype=float)
        if len(each) < 2:
            continue
        p = float(stats.ttest_1samp(each, 0.0).pvalue) if np.ptp(each) > 0.0 else 1.0
        probability = float(str(fault).removeprefix(LOST))
        yield MessageLoss(task, str(hierarchy), int(size), probability, bootstrap(each), p)


def _holm(lines: Sequence[MessageLoss]) -> list[MessageLoss]:
    if not lines:
        return []
    adjusted = holm([line.p for line in lines])
    return [line._replace(p=float(p)) for line, p in zip(lines, adjusted, strict=True)]


def quality(task: str) -> tuple[str, int]:
    """Return by which measure hierarchies of a task are ranked, and its sign."""
    return QUALITIES.get(task, ("success", 1))


def coverage(checked: Sequence[Check]) -> list[str]:
    """Return by measure, and of all, which share of predictions held, and how wide they were.

    The intervals of shares are over laws, several of whose sizes stand or fall together.
    """
    lines: list[str] = []
    for name in dict.fromkeys(
        [*(["all"] if checked else []), *(check.measure for check in checked)]
    ):
        own = [check for check in checked if name in ("all", check.measure)]
        by_law = dict[tuple[TeamKind, str], list[bool]]()
        for check in own:
            by_law.setdefault((check.team, check.measure), []).append(check.is_inside)
        shares = np.array([np.mean(inside) for inside in by_law.values()])
        inside = sum(check.is_inside for check in own)
        factor = np.median([np.sqrt(c.predicted.high / c.predicted.low) for c in own])
        text = f"{MEASURES.get(name, name)}: {inside} of {len(own)} inside, {len(shares)} laws"
        if len(shares) > 1:
            text += f", share {bracketed(bootstrap(shares, bounds=(0.0, 1.0)))}"
        lines.append(f"{text}; median factor {two_figures(float(factor))}")
    return lines


def exponents(rows: pd.DataFrame, measure: str) -> dict[TeamKind, Estimate]:
    """Return the first exponent of the law of each team, of all its sizes."""
    by_team = {}
    for team, own in rows.groupby(list(TeamKind._fields), sort=False):
        sample = sample_of(own, measure)
        if sample is None or len(sample.sizes) < laws.FEWEST or len(sample.values) < 2:
            continue
        law = laws.fit(sample.scale.curves[0], sample)
        by_team[TeamKind(*team)] = law.exponents()["exponent"]
    return by_team
