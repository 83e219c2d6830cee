"""``nested-agents plan``: what a study will take and what it can find."""

from pathlib import Path
from typing import Any

import click

from .. import options


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.jobs
@options.number("--deviation", "SD", 0.25, "Supposed standard deviation of differences of seeds.")
@options.number("--smallest", "D", 0.2, "The smallest difference of success rates of interest.")
@click.option("--timed/--no-timed", default=True, help="Try episodes of every condition.")
@options.changes
def command(spec: Path, changes: tuple[str, ...], **supposed: Any) -> int:
    """Tell trials, time, memory and the differences that a study can find, before it is run.

    SPEC.toml says what to run. Episodes of every condition are tried out for a second.
    """
    from ...api.planning import plan
    from ...spec.spec import Spec

    print(plan(Spec.load(spec, changes), **supposed))
    return 0
