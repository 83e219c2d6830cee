"""``nested-agents results``: what a study measured, for reading and for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from .. import options


@click.command()
@options.directory
@options.formats(
    "table",
    "csv",
    text="How to print the rows; CSV holds every digit, and a column for every swept key.",
)
@click.option(
    "--phase",
    metavar="PHASE",
    default="training",
    help="The episodes of training, those of the greedy evaluation after it (evaluation), of a "
    "stage before it (training:NAME) or of another evaluation (evaluation:NAME).",
)
def command(directory: Path, form: str, phase: str) -> int:
    """Print one row per trial and episode, as a table or CSV.

    DIR is where the study is kept.
    """
    import sys
    from shutil import get_terminal_size

    from ....core.plugins.messages import closest
    from ...errors import SpecError
    from ...presentation.csv_text import write_frame
    from ...results.results import read
    from ..loading import opened

    with opened(directory) as store:
        store.verify()
        results = read(store)
    if results.phases and phase not in results.phases:
        raise SpecError(f"--phase {phase!r}: {closest(phase, results.phases)}")
    episodes = results.episodes
    frame = episodes[episodes["phase"] == phase]
    if form == "csv":
        write_frame(sys.stdout, frame)
        return 0
    headings = {
        "steps": "steps",
        **{m.name: m.heading for m in results.measures},
        "return": "return",
    }
    shown = [name for name in frame.columns if name in headings]
    for condition, rows in frame.groupby("condition", sort=False):
        table = rows.set_index(["seed", "episode"])[shown].rename(columns=headings).to_string(
            sparsify=False, line_width=get_terminal_size().columns, na_rep="–",
            float_format="{:.4g}".format,
        )  # fmt: skip
        print(f"\n{condition}, {phase}", table, sep="\n")
    return 0
