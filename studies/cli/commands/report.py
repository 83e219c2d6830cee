"""``nested-agents report``: a study as one HTML file."""

from pathlib import Path

import click

from .. import options


@click.command()
@options.directory
@options.out("Where to write; by default report.html in the study's directory.", "FILE.html")
@options.trust
def command(directory: Path, out: Path | None, trust: bool) -> int:
    """Write a study as one self-contained HTML file: verdict, table, figures, replays, spec.

    DIR is where the study is kept; it may be unfinished.
    """
    from ..loading import load_results

    path = load_results([directory], trust=trust).report(out)
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB, nothing outside it is needed")
    return 0
