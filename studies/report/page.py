"""The page: what a study's directory holds, gathered and put into the template."""

from functools import cache
from pathlib import Path

import jinja2
from markupsafe import Markup

from ..catalogue.study import analysed, drawn, load_study
from ..presentation.tables import tabulate
from ..presentation.words import count
from ..results.analysis import identity_lines
from ..results.contrasts import contrasts
from ..results.results import read
from ..spec.outline import StudyOutline, sources_of
from ..spec.toml import dumps
from ..store.schema import RESULTS_VERSION
from ..store.store import Store
from . import words
from .pictures import pictures
from .replays import replays

FOLDER = Path(__file__).parent


def page(directory: Path) -> str:
    """Return the report of the study in a directory as HTML.

    Raises
    ------
    SpecError
        If the directory holds no readable study, or rows that are damaged.
    """
    with Store.open(directory) as store:
        store.verify()
        outline, results, counts = StudyOutline.kept(store), read(store), store.counts()
        failed = [
            (condition, seed, words.without_places(error.rstrip()))
            for condition, seed, error in store.failed()
        ]
        trials = store.planned()
        packed = replays(store, trials)
        sources = sources_of(store)
    with sources.active():
        analysis = analysed(outline.study, results)
        figures = drawn(load_study(outline.study), analysis)
    notes = getattr(analysis, "notes", ())
    if len(results.conditions) > 1 and [*notes] == identity_lines(results.identical):
        notes = contrasts(results).notes  # what `compare` says of it, this included
    return _template().render(
        study=outline.study,
        extent=words.extent(outline),
        compared=", ".join(next(iter(outline.columns.values()))),
        standing=words.standing(len(trials), counts["done"], counts["failed"]),
        complete=counts["done"] == len(trials),
        notes=notes,
        table=tabulate(analysis.table),
        pictures=pictures(figures),
        replays=packed,
        topologies=words.topologies(outline),
        failed=failed,
        seeds=words.runs(outline.seeds),
        spec=dumps(outline.table),
        versions=words.versions(),
        results_version=RESULTS_VERSION,
        css=_own("page.css"),
        js=_own("page.js"),
        replay_js=Markup(packed.script),
    )


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["count"] = count
    return environment.get_template("page.html.jinja")


def _own(name: str) -> Markup:
    """Return a file of this package, which is HTML already."""
    return Markup((FOLDER / name).read_text(encoding="utf-8"))
