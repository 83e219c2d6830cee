"""Progress of a running study: a bar on a terminal, otherwise lines.

The module also formats counts and durations.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING

from ...core.plugins.printing import printable
from ..errors import exception_line
from ..spec.outline import StudyOutline
from ..workers.runner import Observer, Outcome

if TYPE_CHECKING:
    from ..spec.spec import Spec


def count(number: int, what: str, plural: str = "s") -> str:
    """Return a number of things.

    >>> count(1, "seed"), count(2, "process", "es")
    ('1 seed', '2 processes')
    """
    return f"{number} {what}{'' if number == 1 else plural}"


def duration(seconds: float) -> str:
    """Return a time in its two largest units.

    Examples
    --------
    >>> duration(8.4), duration(600), duration(8000), duration(200_000)
    ('8 s', '10 min', '2 h 13 min', '2 d 7 h')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    if hours < 24:
        return f"{hours} h {minutes} min" if hours else f"{minutes} min"
    return f"{hours // 24} d {hours % 24} h"


PLAIN_SECONDS = 10.0
"""Interval between lines of progress without a terminal [s]."""


def say(line: str) -> None:
    """Print a line on standard error."""
    print(printable(line), file=sys.stderr, flush=True)


class Terminal(Observer):
    """Shows the progress of a study on standard error; repeated notes are printed once.

    `react` is called with every outcome, while other trials run.
    """

    def __init__(self, react: Callable[[Outcome], None] = lambda outcome: None) -> None:
        self._react = react
        self._noted: set[str] = set()

    def announce(self, spec: Spec, directory: Path, processes: int) -> None:
        """Print the size of the study before it runs."""
        conditions = len(spec.conditions())
        seeds = len(spec.seeds)
        self.note(
            f"{spec.study}: {count(conditions, 'condition')} x {count(seeds, 'seed')}, "
            f"{StudyOutline.of(spec).lengths} of up to {count(spec.steps, 'step')}, "
            f"{count(processes, 'process', 'es')}, kept in {directory}"
        )

    def note(self, line: str) -> None:
        """Print a note once."""
        if line not in self._noted:
            self._noted.add(line)
            lines = wrap(
                line,
                get_terminal_size().columns,
                subsequent_indent="  ",
                break_long_words=False,
                break_on_hyphens=False,
            )
            say("\n".join(lines))

    def follow(self, outcomes: Iterable[Outcome], total: int, done: int) -> None:
        """Show progress, failures and remaining time."""
        if done:
            say(f"{done} of {total} trials were run before")
        if done < total:
            show = _follow_bar if sys.stderr.isatty() else _follow_lines
            show(map(self._reacted, outcomes), total, done)

    def _reacted(self, outcome: Outcome) -> Outcome:
        self._react(outcome)
        return outcome


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
                progress.console.print(printable(_failure(outcome)), markup=False, highlight=False)


def _follow_lines(outcomes: Iterable[Outcome], total: int, done: int) -> None:
    begin = last = time.monotonic()
    for here, outcome in enumerate(outcomes, 1):
        now = time.monotonic()
        finished = done + here
        if outcome.error is not None:
            say(_failure(outcome))
        if now - last >= PLAIN_SECONDS or finished == total:
            last = now
            left = duration((now - begin) / here * (total - finished))
            say(f"{finished} of {total} trials, {duration(now - begin)}, about {left} left")


def _failure(outcome: Outcome) -> str:
    reason = exception_line(outcome.error or "")
    return f"failed: {outcome.trial.condition}, seed {outcome.trial.seed}: {reason}"
