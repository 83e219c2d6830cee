"""``nested-agents export``: what a study holds, as files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .. import options

if TYPE_CHECKING:
    from ...api.export import Form


@click.command()
@options.directory
@options.formats(
    "csv",
    "json",
    "marl-eval",
    text="Of the files; distances and returns are left out of json.",
)
@click.option(
    "--out",
    type=options.PATH,
    metavar="PATH",
    help="Folder of the files; by default export in the study's own.",
)
@click.option("--overwrite", is_flag=True, help="Replace files that are there.")
def command(directory: Path, form: Form, out: Path | None, overwrite: bool) -> int:
    """Write one file with a row for every episode, and one with a row for every trial.

    DIR is where the study is kept. JSON is one small file of spec, seeds and rounded measures, fit
    to be published with a paper; `nested-agents table` reads it.
    """
    from ...api.export import export
    from ..loading import opened

    with opened(directory) as store:
        folder = directory / "export" if out is None else out
        for path in export(store, folder, form, overwrite=overwrite):
            print(path)
    return 0
