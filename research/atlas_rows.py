"""The atlas: tasks, hierarchies, learners, faults, sizes; and what small teams tell of large ones.

Each spec in ``specs/atlas`` is a task. Its conditions are called *hierarchy, learner* or
*hierarchy, learner, fault*. Of every trial a row is kept, in a file of Parquet for each task; the
file ``published`` has trials of studies that have been published already, see `PUBLISHED`. From
these rows all numbers and figures are made again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from nested_agents import SpecError, load, run
from nested_agents.analysis import Results, label_but, samples
from nested_agents.terminal import closest

from . import RESULTS, SPECS

COMMITTED = RESULTS / "atlas"
"""Where the rows are that have been published."""
NO_FAULT = "none"

MEASURES = {
    "success": "success",
    "right": "share right",
    "share_of_best": "share of the best",
    "steps": "decisions of an episode",
    "final_distance_m": "final distance",
    "final_spread_m": "spread at the end",
    "loss": "loss",
    "messages": "messages",
    "decision_median": "time of a decision",
    "team_bytes": "memory",
}
"""What laws are fitted to, and what it is called. Loss is the return with the sign turned."""
RATES = ("success", "right")
"""Those that are a share of an episode's plays or of episodes."""
COSTS = ("messages", "decision_median", "team_bytes")
"""Those that are not of what a team achieves."""
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
CONTROLS = ("frozen", "written", "random")
ALREADY = "published"
"""The task whose rows are those."""
SEEN = (ALREADY, "signals")
"""Tasks on whose rows the way of predicting was chosen."""
UNSEEN = ("permutation", "small_boxes", "votes")
"""Tasks that were opened after the rule of the best hierarchy was committed."""
QUALITIES = {
    "signals": "right",
    "signals_learned": "right",
    "games": "share_of_best",
    "rings": "share_of_best",
}
"""By what hierarchies of a task are ranked; of other tasks by success."""


class TeamKind(NamedTuple):
    """A team of any size."""

    task: str
    hierarchy: str
    learner: str
    fault: str = NO_FAULT


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
        rows.to_parquet(folder / f"{task}.parquet", index=False)
    return folder


def _run(task: str, spec: Path, out: Path, jobs: int | None) -> pd.DataFrame:
    study = run(spec, out, jobs=jobs)
    if study.failed:
        raise SpecError(f"{out}: {len(study.failed)} trials failed: nested-agents status {out}")
    names = {c: str(own["name"]).split(", ") for c, own in study.results.columns.items()}
    teams = {c: TeamKind(task, *parts) for c, parts in names.items()}
    return trial_rows(study.results, teams)


def published_rows() -> pd.DataFrame:
    """Return the rows of `PUBLISHED`: a condition's name stands where that has none."""
    frames = []
    for name, (task, hierarchy, learner) in PUBLISHED.items():
        results = load(RESULTS / f"{name}.json").results
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
    """Return the rows of all tasks in a folder, with the file as their source.

    Raises
    ------
    SpecError
        If there are none, or pyarrow is not installed.
    """
    files = sorted(folder.glob("*.parquet"))
    if not files:
        raise SpecError(f"{folder}: holds no rows of the atlas, TASK.parquet")
    frames = [pd.read_parquet(path).assign(source=path.stem) for path in files]
    rows = pd.concat(frames, ignore_index=True)
    return rows.assign(loss=-rows["return"]) if "return" in rows else rows


def sample_of(rows: pd.DataFrame, measure: str) -> samples.Sample | None:
    """Return what one team's rows have of a measure; None if no law can be of it.

    Those are values that are not positive.
    """
    if measure not in rows:
        return None
    values = rows.pivot(index="seed", columns="size", values=measure).dropna(axis=1, how="all")
    values = values.dropna()
    array = values.to_numpy(dtype=float)
    if not array.size:
        return None
    sizes = values.columns.to_numpy(dtype=float)
    if measure in RATES:
        episodes = int(rows["episodes"].iloc[0])
        return samples.of_rates(sizes, array, episodes)
    return samples.of_numbers(sizes, array) if (array > 0.0).all() else None


def quality(task: str) -> str:
    """Return by which measure, the more the better, hierarchies of a task are ranked."""
    return QUALITIES.get(task, "success")
