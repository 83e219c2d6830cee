"""``nested-agents claims``: what the paper claims, and the verdict on each."""

from pathlib import Path
from typing import Any

import click

from ....core.plugins.settings import closest
from ...api.study import run
from ...claims.claims import PAPERS, PUBLISHED, QUICK, SPECS, judge, print_claims, studies_of
from ...errors import SpecError
from ...presentation.progress import Terminal, say
from ...results import published
from .. import options


@click.command()
@options.out(
    "Run the studies that the claims rest on, each in a directory of its own below this one; "
    "what has been run before is read."
)
@options.flag(
    "--quick", "Small versions of the studies: six minutes on two cores, and wide intervals."
)
@click.option(
    "--of",
    default="nested-agents",
    metavar="PAPER",
    help="Whose claims: this paper's, or those of action-dependency-graphs (arXiv 2506.00797).",
)
@options.jobs
@options.formats("table", "json", "markdown")
def claims(out: Path | None, quick: bool, of: str, jobs: int | None, form: Any) -> int:
    """Print one table: each claim of a paper, its measure, the result, the verdict.

    Without --out the table is made from the results that are committed in the repository.
    """
    if of not in PAPERS:
        raise SpecError(f"--of = {of!r}: {closest(of, PAPERS)}")
    if out is not None:
        results = _run(out, of, quick=quick, jobs=jobs)
    elif quick or jobs is not None:
        raise SpecError(
            f"{'--quick' if quick else '--jobs'}: needs --out, where to run the studies"
        )
    elif PUBLISHED.is_dir():
        results = published.read(PUBLISHED, studies_of(of))
    else:
        raise SpecError(
            "claims: the committed results are in the repository, in studies/claims/published, "
            "not in the installed package; with --out DIR the studies are run"
        )
    for study, of_study in results.items():
        if of_study.note:
            say(f"{study}: {of_study.note}")
    print_claims(judge({study: p.results for study, p in results.items()}, of), form)
    return 0


def _run(out: Path, of: str, *, quick: bool, jobs: int | None) -> dict[str, published.Published]:
    """Run the studies of the claims, or what is left of them; return the results by study."""
    results = {}
    for study in studies_of(of):
        name = study.replace("-", "_")
        folder = QUICK if quick else SPECS / name
        ran = run(folder / f"{name}.toml", out / study, jobs=jobs, observer=Terminal())
        if ran.failed:
            raise SpecError(
                f"{out / study}: {len(ran.failed)} trials failed: nested-agents status "
                f"{out / study}"
            )
        results[study] = published.loads(published.dumps(ran.outline, ran.results))
    return results
