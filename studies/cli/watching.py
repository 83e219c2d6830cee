"""A study as it is watched: trials, learning curves as they grow, time left, failures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ..presentation.words import count, duration
from ..results.results import Results, from_arrays, read
from ..store.store import Store
from ..workers.progress import Progress, progress

BLOCKS = "▁▂▃▄▅▆▇█"
CURVE = 24
"""Characters of a curve at most."""
MOST_FAILURES = 5
"""Failures that are told one by one."""
MOST_CONDITIONS = 30
"""Conditions that are told one by one."""


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
    """Return what there is to see of a study now, and whether anything is still to come."""
    with Store.open(directory) as store:
        outline, now, failed = store.outline(), progress(store), store.failed()
        results = read(store) if store.other_version() is None else from_arrays({})
        planned = store.planned()
    planned_of: dict[str, int] = {}
    for trial in planned:
        planned_of[trial.condition] = planned_of.get(trial.condition, 0) + 1
    title = Text(f"{outline.study}: {directory}", style="bold")
    bar = Table.grid(padding=(0, 1), expand=True)
    bar.add_column(ratio=1)
    bar.add_column(justify="right")
    bar.add_row(ProgressBar(total=max(now.total, 1), completed=now.done), _standing(now))
    parts: list[RenderableType] = [title, bar, Text("")]
    parts.append(_conditions(results, planned_of, now))
    for condition, seed, error in failed[-MOST_FAILURES:]:
        last = error.strip().splitlines()[-1] if error.strip() else "failed"
        parts.append(Text(f"failed: {condition}, seed {seed}: {last}", style="red"))
    if len(failed) > MOST_FAILURES:
        parts.append(Text(f"and {len(failed) - MOST_FAILURES} more", style="red"))
    if now.refusal:
        parts.append(Text(f"nothing can be added: {now.refusal}", style="yellow"))
    return Group(*parts), bool(now.refusal is None and (now.left or now.running))


def _standing(now: Progress) -> Text:
    said = f"{now.done} of {count(now.total, 'trial')}"
    if now.running:
        said += f", {len(now.running)} running"
    if now.failed:
        said += f", {now.failed} failed"
    if now.seconds:
        said += f", about {duration(now.seconds)} left"
    return Text(said)


def _conditions(results: Results, planned: dict[str, int], now: Progress) -> Table:
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
