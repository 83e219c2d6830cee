"""``nested-agents watch``: a study while it runs."""

from pathlib import Path

import click

from .. import options


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
def command(directory: Path, every: float, once: bool) -> int:
    """Watch trials, learning curves as they grow, failures and the time left, until all is done.

    DIR is where the study is kept, whoever runs it and wherever; looking at it disturbs nothing.
    Ctrl-C stops the watching only.
    """
    import time

    from rich.console import Console
    from rich.live import Live

    from ..watching import frame

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
