"""``nested-agents claims``: what the paper claims, and what was found of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .. import options

if TYPE_CHECKING:
    from ...claims.table import Format
    from ...results.published import Published


@click.command()
@click.option(
    "--out",
    type=options.path,
    metavar="DIR",
    help="Run the studies that the claims rest on, each in a directory of its own below this one; "
    "what has been run before is read.",
)
@click.option(
    "--quick",
    is_flag=True,
    help="Small versions of the studies: six minutes on two cores, and wide intervals.",
)
@options.jobs
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json", "markdown", "latex"]),
    default="table",
    help="How to print the table.",
)
@click.option(
    "--publish",
    type=options.path,
    metavar="DIR",
    help="Also write the results that it rests on, as one small JSON file a study.",
)
def command(
    out: Path | None, quick: bool, jobs: int | None, form: Format, publish: Path | None
) -> int:
    """Print one table: each claim of the paper, its measure, the result, the verdict.

    Without --out the table is made from the results that are committed in the repository.
    """
    from ...claims import claims
    from ...claims.table import print_claims
    from ...presentation.progress import say
    from ...results import published
    from ...spec.errors import SpecError

    if out is None:
        for option, given in (("--quick", quick), ("--publish", publish), ("--jobs", jobs)):
            if given is not None and given is not False:
                raise SpecError(f"{option}: needs --out, the directory of the studies")
        if not claims.PUBLISHED.is_dir():
            raise SpecError(
                "claims: the committed results are in the repository, in studies/claims/published, "
                "not in the installed package; with --out DIR the studies are run"
            )
        found = published.read(claims.PUBLISHED, claims.STUDIES_OF_CLAIMS)
    else:
        found = _run(out, quick=quick, jobs=jobs)
    for study, of_study in found.items():
        if of_study.note:
            say(f"{study}: {of_study.note}")
    if publish is not None:
        publish.mkdir(parents=True, exist_ok=True)
        for study, (outline, results, _) in found.items():
            published.write(publish / f"{study}.json", outline, results)
    print_claims(claims.judge({study: p.results for study, p in found.items()}), form)
    return 0


def _run(out: Path, *, quick: bool, jobs: int | None) -> dict[str, Published]:
    """Run the studies of the claims, or what is left of them; return what they found."""
    from ...api.run_study import run_study
    from ...claims import claims
    from ...presentation.progress import Terminal
    from ...results import published
    from ...results.results import read
    from ...spec.errors import SpecError
    from ...spec.spec import Spec

    found = {}
    for study in claims.STUDIES_OF_CLAIMS:
        name = study.replace("-", "_")
        folder = claims.QUICK if quick else claims.SPECS / name
        spec = Spec.load(folder / f"{name}.toml")
        with run_study(spec, out / study, jobs=jobs, observer=Terminal()) as store:
            if failed := store.failed():
                raise SpecError(
                    f"{out / study}: {len(failed)} trials failed: nested-agents status "
                    f"{out / study}"
                )
            found[study] = published.loads(published.dumps(store.outline(), read(store)))
    return found
