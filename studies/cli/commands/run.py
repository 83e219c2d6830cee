"""``nested-agents run``: run the study of a spec."""

from pathlib import Path
from typing import Any

import click

from .. import options


@click.command()
@click.argument("spec", type=options.PATH, metavar="SPEC.toml")
@options.out(
    "Where to keep the study; made if it does not exist. Every trial is kept the moment it "
    "finishes, so interrupting costs only those that are running.",
    required=True,
)
@options.running
@options.trust
@options.figures
@options.changes
def command(
    spec: Path,
    out: Path,
    trust: bool,
    figures: tuple[str, ...],
    changes: tuple[str, ...],
    **running: Any,
) -> int:
    """Run the study of a spec; the same command again continues it.

    SPEC.toml says what to run; `nested-agents demo --print-spec` prints an example.
    """
    from ...api.study import run
    from ...errors import SpecError
    from ...presentation.progress import Terminal
    from ...spec.spec import Spec
    from ...store.database import DATABASE, SPEC_FILE
    from ..display import show_results
    from ..loading import trust_files

    for directory in {out.resolve(), spec.resolve().parent} if trust else ():
        if (directory / DATABASE).exists():
            trust_files(directory)
    try:
        given = Spec.load(spec, changes, study=out)
    except SpecError as error:
        if not (out / DATABASE).exists() or spec.resolve() != (out / SPEC_FILE).resolve():
            raise
        raise SpecError(
            f"{error}; if you did not edit {spec}, it is damaged: nested-agents retry {out} goes "
            "on by the database"
        ) from None
    return show_results(run(given, out, observer=Terminal(), **running), figures)
