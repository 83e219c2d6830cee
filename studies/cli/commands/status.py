"""``nested-agents status``: how far a study is."""

from __future__ import annotations

from pathlib import Path

import click

from ..arguments import Command
from . import options


@click.command(cls=Command)
@options.directory
def command(directory: Path) -> int:
    """Tell how many trials are done, running, failed (with the reason) and left, and for how long.

    DIR is where the study is kept.
    """
    from ...presentation.words import count, duration
    from ...store.store import Store
    from ...workers.progress import progress

    with Store.open(directory) as store:
        outline, now, failed = store.outline(), progress(store), store.failed()
        versions = store.versions_of_code()
    extent = f"{count(len(outline.columns), 'condition')} x {count(len(outline.seeds), 'seed')}"
    print(f"study    {outline.study}: {extent}")
    print(f"done     {now.done} of {now.total} trials")
    print(f"running  {len(now.running)}")
    for condition, seed, seconds in now.running:
        print(f"         {condition}, seed {seed}, for {duration(seconds)}")
    print(f"failed   {now.failed}")
    print(f"left     {now.left}")
    if now.seconds:
        processes = count(now.processes, "process", "es")
        print(f"time     about {duration(now.seconds)} with {processes}")
    if versions > 1:
        print(f"code     finished trials are of {versions} versions of the installed code")
    if now.refusal:
        print(f"\nnothing can be added: {now.refusal}")
    for line in now.damaged:
        print(f"\n{line}")
    for condition, seed, error in failed:
        print(f"\n{condition}, seed {seed} failed:\n{error.rstrip()}")
    if failed:
        print(f"\nto run them again: nested-agents retry {directory}")
    return 1 if failed else 0
