"""``nested-agents watch``: a study while it runs: how far it is, curves as they grow, failures."""

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import click
import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ...results.results import NOTHING, Results, read
from ...store.store import Store
from .. import options
from ..loading import Progress, describe, progress

BLOCKS = "▁▂▃▄▅▆▇█"
CURVE = 24
"""Characters of a curve at most."""
MOST_FAILURES = 5
"""Failures that are shown one by one."""
MOST_CONDITIONS = 30
"""Conditions that are shown one by one."""


def curve(rates: Sequence[float], width: int = CURVE) -> str:
    """Return success rates from episode to episode as a line of blocks.

    Examples
    --------
    >>> curve([0.0, 0.25, 0.5, 1.0]), curve([0, 0, 1, 1], width=2)
    ('▁▃▅█', '▁█')
    """
    values = np.asarray(rates, dtype=float)
    means = [part.mean() for part in np.array_split(values, min(width, len(values)))]
    return "".join(BLOCKS[round(mean * (len(BLOCKS) - 1) + 1e-9)] for mean in means)


def frame(directory: Path) -> tuple[Group, bool]:
    """Return what there is to see of a study now, and whether anything is still to come.

    Rows that are damaged are not drawn. Of a damaged study nothing is to come unless somebody runs
    it.
    """
    with Store.open(directory) as store:
        now = progress(store)
        lines = Text("\n".join(describe(store, now)))
        results = NOTHING() if now.damaged else read(store)
        failed = store.failed()
        planned = Counter(trial.condition for trial in store.planned())
    shown = [f"failed: {c}, seed {s}: {(e.strip() or '-').splitlines()[-1]}" for c, s, e in failed]
    more = len(shown) - MOST_FAILURES
    parts = [*shown[-MOST_FAILURES:], *([f"and {more} more"] if more > 0 else [])]
    bar = ProgressBar(total=max(now.total, 1), completed=now.done)
    curves = _conditions(results, planned, now)
    group = Group(lines, bar, Text(""), curves, Text("\n".join(parts), style="red"))
    is_possible = now.refusal is None and not now.damaged
    return group, bool(now.running or (now.left and is_possible))


def _conditions(results: Results, planned: Mapping[str, int], now: Progress) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="bold")
    table.add_column("condition", overflow="fold")
    for heading in ("trials", "running", "last 5"):
        table.add_column(heading, justify="right")
    table.add_column("success, episode by episode", no_wrap=True)
    for condition, total in list(planned.items())[:MOST_CONDITIONS]:
        done = len(results.seeds(condition))
        running = sum(c == condition for c, _, _ in now.running)
        shown, last = "", ""
        if results.has(condition, "training"):
            rates = results.success(condition).mean(axis=0)
            shown, last = curve(rates), f"{rates[-5:].mean():.2f}"
        table.add_row(escape(condition), f"{done} of {total}", str(running or ""), last, shown)
    if len(planned) > MOST_CONDITIONS:
        table.add_row(f"and {len(planned) - MOST_CONDITIONS} more")
    return table


@click.command()
@options.directory
@click.option(
    "--every",
    type=click.FloatRange(0.2, 3600.0),
    metavar="SECONDS",
    default=2.0,
    help="How often to look again.",
)
@click.option("--once", is_flag=True, help="Show what there is now, and stop.")
def watch(directory: Path, every: float, once: bool) -> int:
    """Watch trials, learning curves as they grow, failures and the time left, until all is done.

    DIR is where the study is kept, whoever runs it and wherever; looking at it disturbs nothing.
    Ctrl-C stops the watching only.
    """
    console = Console()
    shown, is_going_on = frame(directory)
    if once or not console.is_terminal:
        console.print(shown)
        return 0
    with Live(shown, console=console, auto_refresh=False) as live:
        while is_going_on:
            time.sleep(every)
            shown, is_going_on = frame(directory)
            live.update(shown, refresh=True)
    return 0
