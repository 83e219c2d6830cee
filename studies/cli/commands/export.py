"""``nested-agents export``: what a study holds, as files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro

from .options import Directory


def command(
    directory: Directory,
    format: Literal["csv", "parquet", "json"] = "csv",
    out: Annotated[Path | None, tyro.conf.arg(metavar="PATH", help_behavior_hint="")] = None,
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Write one file with a row for every episode, and one with a row for every trial.

    JSON is one small file of spec, seeds and rounded measures, fit to be published with a paper;
    `nested-agents table` reads it.

    Parameters
    ----------
    directory
        Where the study is kept.
    format
        Of the files; parquet needs the extra nested-agents[parquet]. Distances and returns are
        left out of json.
    out
        Folder of the files; export in the study's own unless said otherwise.
    overwrite
        Replace files that are there.
    """
    from ...presentation.export import export
    from ...store.store import Store

    with Store.open(directory) as store:
        folder = directory / "export" if out is None else out
        for path in export(store, folder, format, overwrite=overwrite):
            print(path)
    return 0
