"""What the user sees of a study on the terminal: progress, table, and where things are."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from ..presentation.tables import SummaryTable
from ..spec.outline import Outline
from ..spec.spec import Spec
from ..workers.runner import Outcome

LABEL = 24
"""What a condition's label may be broken to, if there is no room for all of it [characters]."""
PLAIN_SECONDS = 10.0
"""How often a line tells of the progress when there is no terminal."""


def say(line: str) -> None:
    """Print a line on standard error."""
    print(line, file=sys.stderr, flush=True)


class Terminal:
    """Shows on standard error how a study goes, see `nested_agents.studies.run.Observer`."""

    def announce(self, spec: Spec, directory: Path, processes: int) -> None:
        """Say what is about to be run."""
        conditions, seeds = len(spec.conditions()), len(spec.seeds)
        say(
            f"{spec.study}: {count(conditions, 'condition')} x {count(seeds, 'seed')}, "
            f"{Outline.of(spec).lengths} of up to {count(spec.steps, 'step')}, "
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
        if sys.stderr.isatty():
            _follow_bar(outcomes, total, done)
        else:
            _follow_lines(outcomes, total, done)


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
    minutes = round(seconds / 60)
    if minutes < 60:
        return f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    if hours < 24:
        return f"{hours} h {minutes} min"
    return f"{hours // 24} d {hours % 24} h"


def _follow_bar(outcomes: Iterable[Outcome], total: int, done: int) -> None:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        MofNCompleteColumn(),
        TextColumn("trials"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(compact=True),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, speed_estimate_period=600.0) as progress:
        task = progress.add_task("running", total=total, completed=done)
        for outcome in outcomes:
            progress.advance(task)
            if outcome.error is not None:
                progress.console.print(_failure(outcome), markup=False, highlight=False)


def _follow_lines(outcomes: Iterable[Outcome], total: int, done: int) -> None:
    begin = said = time.monotonic()
    for here, outcome in enumerate(outcomes, 1):
        if outcome.error is not None:
            say(_failure(outcome))
        now = time.monotonic()
        if now - said >= PLAIN_SECONDS or done + here == total:
            said = now
            left = duration((now - begin) / here * (total - done - here))
            say(f"{done + here} of {total} trials, {duration(now - begin)}, about {left} left")


def _failure(outcome: Outcome) -> str:
    last = (outcome.error or "").strip().splitlines()[-1]
    return f"failed: {outcome.trial.condition}, seed {outcome.trial.seed}: {last}"


def print_table(found: SummaryTable) -> None:
    """Print estimates by condition, each over its 95 % interval.

    Columns that do not fit side by side without breaking a word follow below, as a further table.
    """
    if not found.rows:
        print("no trial has finished")
        return
    console = Console()
    for block in _blocks(found, console.width):
        table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="bold")
        table.add_column("", overflow="fold")
        for i, width in block.items():
            table.add_column(escape(found.titles[i]), justify="right", overflow="fold", width=width)
        for condition, seeds, cells in found.rows:
            shown = (cells[i] for i in block)
            table.add_row(
                f"{escape(condition)}\n[dim]{count(seeds, 'seed')}[/]",
                *(f"{c.value}\n[dim]{c.interval or '–'}[/]" if c else "" for c in shown),
            )
        console.print(table)
        print()
    print("Means over seeds, and below them their 95 % intervals.")
    if found.remark:
        print(found.remark)


def _blocks(found: SummaryTable, width: int) -> list[dict[int, int]]:
    """Return which columns stand side by side, and how wide each is: in as few blocks as fit.

    Where titles fit in one line there is one block; elsewhere they are broken between words.
    """
    label = max(max(len(c), len(count(seeds, "seed"))) for c, seeds, _ in found.rows)
    texts = [
        [text for _, _, row in found.rows if (c := row[i]) for text in (c.value, c.interval)]
        for i in range(len(found.titles))
    ]
    pairs = list(zip(found.titles, texts, strict=True))
    whole = [max(map(len, [title, *of_cells])) for title, of_cells in pairs]
    if label + sum(1 + wide for wide in whole) <= width:
        return [dict(enumerate(whole))]
    broken = [max(map(len, [*title.split(), *of_cells])) for title, of_cells in pairs]
    n, label = len(broken), min(label, LABEL)
    for many in range(n, 0, -1):
        blocks = [{i: broken[i] for i in range(k, min(k + many, n))} for k in range(0, n, many)]
        if all(label + sum(1 + wide for wide in block.values()) <= width for block in blocks):
            break
    return blocks


def print_places(directory: Path, figures: Sequence[Path], replays: Sequence[Path]) -> None:
    """Say where pictures and results are."""
    print()
    for what, paths in (("figure", figures), ("replay", replays)):
        for path in paths:
            print(f"{what:<8}{path}")
    print(f"{'rows':<8}nested-agents results {directory} --format csv")
    print(f"{'report':<8}nested-agents report {directory}")
