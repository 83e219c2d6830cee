"""``nested-agents tune``: look for better settings of a spec."""

from pathlib import Path
from typing import Any

import click

from .. import options


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.out(
    "Where to keep the study of all configurations, best.toml and configurations.csv.",
    required=True,
)
@options.number("--trials", "N", 20, "Configurations to try, the spec's own among them.")
@options.number("--seeds", "N", 16, "On which the last ones are compared.")
@options.number("--first-seed", "N", 10_000, "Of these seeds; at least 10000.")
@options.number("--draw", "N", 0, "Seed of the draw.")
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
