"""Predictions of large teams by small ones, over tasks, hierarchies, learners and faults.

``python -m research.atlas`` prints them from the committed results: laws are fitted to teams of at
most 16 agents, and of at most 8, and predict the larger ones. ``--out DIR`` runs the tasks first,
``--figures DIR`` draws the figures of research/notebooks/atlas.md.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from nested_agents import SpecError
from nested_agents.figures import apply_style, write
from nested_agents.terminal import print_lines, print_text, run_to_status

from .atlas_choices import choices, shares_right
from .atlas_faults import fault_costs, thresholds
from .atlas_figures import FIGURES
from .atlas_predictions import SMALL, checks, coverage
from .atlas_rows import ALREADY, COMMITTED, SEEN, UNSEEN, pd, read_rows, run_tasks

TEAM_AND_SIZE = ["source", "task", "hierarchy", "learner", "fault", "size"]


def print_predictions(frame: pd.DataFrame) -> None:
    """Print how often larger teams lie in the intervals predicted by smaller ones."""
    print_text(f"{len(frame):,} trials of {frame.groupby(TEAM_AND_SIZE).ngroups} conditions")
    seen = frame["source"].isin(SEEN)
    groups = {
        "Tasks looked at after the rule": (frame[~seen], SMALL),
        "Signals, on which it was chosen": (frame[seen & (frame["source"] != ALREADY)], SMALL),
        "Published studies, on which it was chosen": (frame[frame["source"] == ALREADY], SMALL),
        "Published studies, of half the size": (frame[frame["source"] == ALREADY], SMALL // 2),
    }
    for title, (own, most) in groups.items():
        if own.empty:
            continue
        print_text("", f"{title}: teams larger than {most} in 90% intervals")
        print_lines(coverage(checks(own, most)))


def print_hierarchies(of_tasks: pd.DataFrame) -> None:
    """Print the best hierarchy of the largest teams, and the cost of faults."""
    chosen = choices(of_tasks)
    for title, is_unseen in {"not seen before": True, "seen": False}.items():
        cases = [choice for choice in chosen if (choice.case[0] in UNSEEN) == is_unseen]
        print_text("", f"Best hierarchy of the largest teams, tasks {title}")
        print_lines([*shares_right(cases), *map(str, cases)])
    print_text("", "Best hierarchy of the largest teams, all tasks")
    print_lines(shares_right(chosen))
    costs = fault_costs(of_tasks)
    if costs:
        print_text("", "What faults cost")
        print_lines([*map(str, costs), *thresholds(costs)])


def draw_figures(frame: pd.DataFrame, folder: Path) -> None:
    """Draw the figures into a folder."""
    before = frame["source"] == ALREADY  # a task of both has two sets of seeds
    frame["task"] = frame["task"].mask(before, frame["task"] + ", published")
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        with apply_style():
            write(draw(frame), folder / f"{name}.png")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the atlas and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m research.atlas", description=__doc__)
    parser.add_argument("--out", type=Path, metavar="DIR", help="run the tasks below it")
    parser.add_argument(
        "--task", nargs="+", default=[], metavar="NAME",
        help="tasks to run; needs --out",
    )  # fmt: skip
    parser.add_argument("--rows", type=Path, metavar="DIR", help="other than the committed rows")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw the figures into it")
    parser.add_argument("--jobs", type=int, metavar="N", help="worker processes; needs --out")
    options = parser.parse_args(arguments)
    if options.out is None and (options.task or options.jobs is not None):
        name = "--task" if options.task else "--jobs"
        raise SpecError(f"{name}: needs --out, where to run the tasks")
    folder = options.rows or COMMITTED
    if options.out is not None:
        folder = run_tasks(options.out, options.jobs, options.task)
    frame = read_rows(folder)
    print_predictions(frame)
    print_hierarchies(frame[frame["source"] != ALREADY])
    if options.figures is not None:
        draw_figures(frame, options.figures)
    return 0


if __name__ == "__main__":
    raise SystemExit(run_to_status("research.atlas", main))
