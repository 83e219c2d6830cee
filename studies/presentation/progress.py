"""How a study goes, shown while it runs: a bar on a terminal or in a notebook, else lines."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ..spec.outline import StudyOutline
from ..workers.runner import Observer
from ..workers.worker import Outcome
from .words import count, duration

if TYPE_CHECKING:
    from ..spec.spec import Spec

PLAIN_SECONDS = 10.0
"""How often a line tells of the progress when there is no terminal."""


def say(line: str) -> None:
    """Print a line on standard error."""
    print(line, file=sys.stderr, flush=True)


class Terminal(Observer):
    """Shows how a study goes.

    On standard error; in a notebook as a bar below the cell.
    """

    def announce(self, spec: Spec, directory: Path, processes: int) -> None:
        """Say what is about to be run."""
        conditions, seeds = len(spec.conditions()), len(spec.seeds)
        say(
            f"{spec.study}: {count(conditions, 'condition')} x {count(seeds, 'seed')}, "
            f"{StudyOutline.of(spec).lengths} of up to {count(spec.steps, 'step')}, "
            f"{count(processes, 'process', 'es')}, kept in {directory}"
        )

    def note(self, line: str) -> None:
        """Say it."""
        say(line)

    def follow(self, outcomes: Iterable[Outcome], total: int, done: int) -> None:
        """Show how many of `total` trials are done, which have failed, and how long is left."""
        if done:
            say(f"{done} of {total} trials were run before")
        if done == total:
            return
        from rich.console import Console

        if sys.stderr.isatty():
            _follow_bar(outcomes, total, done)
        elif Console().is_jupyter:
            _follow_notebook(outcomes, total, done)
        else:
            _follow_lines(outcomes, total, done)


def _follow_bar(outcomes: Iterable[Outcome], total: int, done: int) -> None:
    from rich import progress as bars
    from rich.console import Console

    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(bar_width=None),
        bars.MofNCompleteColumn(),
        bars.TextColumn("trials"),
        bars.TimeElapsedColumn(),
        bars.TextColumn("left"),
        bars.TimeRemainingColumn(compact=True),
    )
    console = Console(stderr=True)
    with bars.Progress(*columns, console=console, speed_estimate_period=600.0) as progress:
        task = progress.add_task("running", total=total, completed=done)
        for outcome in outcomes:
            progress.advance(task)
            if outcome.error is not None:
                progress.console.print(_failure(outcome), markup=False, highlight=False)


def _follow_lines(outcomes: Iterable[Outcome], total: int, done: int) -> None:
    last = time.monotonic()
    for finished, line, outcome in _counted(outcomes, total, done):
        if outcome.error is not None:
            say(_failure(outcome))
        if time.monotonic() - last >= PLAIN_SECONDS or finished == total:
            last = time.monotonic()
            say(line)


def _follow_notebook(outcomes: Iterable[Outcome], total: int, done: int) -> None:
    from IPython.display import HTML, display

    bar = "<progress value='{}' max='{}'></progress> {}"
    shown = display(HTML(bar.format(done, total, f"{done} of {total} trials")), display_id=True)
    failures = ""
    for finished, line, outcome in _counted(outcomes, total, done):
        if outcome.error is not None:
            failures += f"<br>{escape(_failure(outcome))}"
        shown.update(HTML(bar.format(finished, total, line) + failures))


def _counted(
    outcomes: Iterable[Outcome], total: int, done: int
) -> Iterator[tuple[int, str, Outcome]]:
    """Yield how many trials are done, how long that took and what is left, and what has arrived."""
    begin = time.monotonic()
    for here, outcome in enumerate(outcomes, 1):
        spent, finished = time.monotonic() - begin, done + here
        left = duration(spent / here * (total - finished))
        line = f"{finished} of {total} trials, {duration(spent)}, about {left} left"
        yield finished, line, outcome


def _failure(outcome: Outcome) -> str:
    last = (outcome.error or "").strip().splitlines()[-1]
    return f"failed: {outcome.trial.condition}, seed {outcome.trial.seed}: {last}"
