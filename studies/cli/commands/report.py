"""``nested-agents report``: a study as one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from .options import Directory


def command(
    directory: Directory,
    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE.html", help_behavior_hint="")] = None,
) -> int:
    """Write a study as one self-contained HTML file: verdict, table, figures, replays, spec.

    Parameters
    ----------
    directory
        Where the study is kept; it may be unfinished.
    out
        Where to write; report.html in the study's directory unless said otherwise.
    """
    from ...report.page import page
    from ...spec.errors import SpecError
    from ...store import durable

    path = directory / "report.html" if out is None else out
    if path.is_dir() or not path.name:
        raise SpecError(f"--out {path}: is a directory")
    if path.suffix not in (".html", ".htm"):
        raise SpecError(f"--out {path}: suffix must be .html or .htm")
    content = page(directory).encode()
    if not path.parent.is_dir():
        raise SpecError(f"--out {path}: there is no directory {path.parent}")
    durable.write(path, content)
    print(f"{path}: {len(content) / 1e6:.1f} MB, nothing outside it is needed")
    return 0
