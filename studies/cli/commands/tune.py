"""``nested-agents tune``: look for better settings of a spec."""

from pathlib import Path
from typing import Any

import click

from .. import options


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@click.option(
    "--out",
    type=options.PATH,
    metavar="DIR",
    required=True,
    help="Where to keep the study of all configurations, best.toml and configurations.csv.",
)
@click.option(
    "--trials",
    type=int,
    metavar="N",
    default=20,
    help="Configurations to try, the spec's own among them.",
)
@click.option(
    "--seeds", type=int, metavar="N", default=16, help="On which the last ones are compared."
)
@click.option(
    "--first-seed", type=int, metavar="N", default=10_000, help="Of these seeds; at least 10000."
)
@click.option("--draw", type=int, metavar="N", default=0, help="Seed of the draw.")
@options.running
@options.changes
def command(spec: Path, out: Path, changes: tuple[str, ...], **tuned: Any) -> int:
    """Look for better settings of a spec, on seeds that no report uses; again, it continues.

    SPEC.toml has one condition, and may have a table [tune] with lists of values by key. All
    configurations are tried on two seeds, the better half on four, and so on.
    """
    from ...api.tuning import BEST_FILE, TABLE_FILE, tune
    from ...spec.spec import Spec
    from ..display import print_table

    tuning = tune(Spec.load(spec, changes, study=out), out, **tuned)
    print_table(tuning.study.table(tuning.columns))
    print("", *tuning.lines, "", sep="\n")
    print(f"spec    {out / BEST_FILE}")
    print(f"table   {out / TABLE_FILE}")
    return 0
