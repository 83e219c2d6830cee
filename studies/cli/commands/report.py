"""``nested-agents report``: a study as one HTML file."""

from __future__ import annotations

from pathlib import Path

import click

from ..arguments import Command, File
from . import options


@click.command(cls=Command)
@options.directory
@click.option(
    "--out",
    type=File(),
    metavar="FILE.html",
    help="Where to write; report.html in the study's directory unless said otherwise.",
)
@options.trust
def command(directory: Path, out: Path | None, trust: bool) -> int:
    """Write a study as one self-contained HTML file: verdict, table, figures, replays, spec.

    DIR is where the study is kept; it may be unfinished.
    """
    from ...report.page import page
    from ...spec.errors import SpecError
    from ...store import durable
    from ..trusting import trust_files

    path = directory / "report.html" if out is None else out
    if path.is_dir() or not path.name:
        raise SpecError(f"--out {path}: is a directory")
    if path.suffix not in (".html", ".htm"):
        raise SpecError(f"--out {path}: suffix must be .html or .htm")
    if trust:
        trust_files(directory)
    content = page(directory).encode()
    if not path.parent.is_dir():
        raise SpecError(f"--out {path}: there is no directory {path.parent}")
    durable.write(path, content)
    print(f"{path}: {len(content) / 1e6:.1f} MB, nothing outside it is needed")
    return 0
