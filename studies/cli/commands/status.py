"""``nested-agents status``: how far a study is."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .. import options

if TYPE_CHECKING:
    from ...store.store import Store


@click.command()
@options.directory
def command(directory: Path) -> int:
    """Tell how many trials are done, running, failed (with the reason) and left, and for how long.

    DIR is where the study is kept.
    """
    from ...store.store import Store

    with Store.open(directory) as store:
        print(*_lines(store), sep="\n")
        failed = store.failed()
    for condition, seed, error in failed:
        print(f"\n{condition}, seed {seed} failed:\n{error.rstrip()}")
    if failed:
        print(f"\nto run them again: nested-agents retry {directory}")
    return 1 if failed else 0


def _lines(store: Store) -> Iterator[str]:
    """Yield how far a study is, why nothing can be added to it, and what is damaged."""
    from ...presentation.words import count, duration
    from ...spec.outline import StudyOutline, other_spec
    from ...workers.progress import progress

    now, outline = progress(store), StudyOutline.kept(store)
    extent = f"{count(len(outline.columns), 'condition')} x {count(len(outline.seeds), 'seed')}"
    yield f"study    {outline.study}: {extent}"
    yield f"done     {now.done} of {now.total} trials"
    yield f"running  {len(now.running)}"
    for condition, seed, seconds in now.running:
        yield f"         {condition}, seed {seed}, for {duration(seconds)}"
    yield f"failed   {now.failed}"
    yield f"left     {now.left}"
    if now.seconds:
        yield f"time     about {duration(now.seconds)} with {count(now.processes, 'process', 'es')}"
    if (remark := other_spec(store)) is not None:
        yield f"spec     {remark}"
    if (versions := store.versions_of_code()) > 1:
        yield f"code     finished trials are of {versions} versions of the installed code"
    if now.refusal:
        yield f"\nnothing can be added: {now.refusal}"
    yield from (f"\n{line}" for line in now.damaged)
