"""The page: what a study's directory holds, in figures and sentences, put into the template."""

import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import jinja2
import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from ...core.plugins.words import show
from ..catalogue.study import analyse_as, draw_figures, load_study, notes_of
from ..errors import SpecError
from ..presentation.growth import growth_figures
from ..presentation.headlines import below_random, headlines
from ..presentation.progress import count
from ..presentation.tables import SummaryTable, tabulate
from ..results.analysis import Analysis, identity_lines
from ..results.comparison import compare_conditions, missing_reference
from ..results.notation import format_estimate, whole
from ..results.results import read
from ..results.statistics import LEVEL
from ..spec.controls import control_lines
from ..spec.outline import StudyOutline, sources_of
from ..spec.tables import dumps
from ..store.database import RESULTS_VERSION
from ..store.store import Store
from ..workers.runner import installed
from .pictures import hierarchy_pictures, pictures
from .replays import Replays, replays

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
        outline = StudyOutline.kept(store)
        results = read(store)
        counts = store.counts()
        failed = [
            (condition, seed, hide_places(error.rstrip()))
            for condition, seed, error in store.failed()
        ]
        trials = store.planned()
        packed = replays(store, results, trials)
        sources = sources_of(store)
        settings = store.settings()
        drawn = hierarchy_pictures(store)
    with sources.active():
        analysis = analyse_as(outline.study, results)
        figures = dict(draw_figures(load_study(outline.study), analysis))
    if outline.study == "scaling":
        figures |= growth_figures(results)
    notes = notes_of(analysis)
    if len(results.conditions) > 1 and [*notes] == identity_lines(results.identical):
        notes = compare_conditions(
            results, results.main.name
        ).notes  # what `compare` says of it, this included
    notes = (*missing_reference(results), *notes)
    there = {label: own for label, own in settings.items() if label in results.conditions}
    table = tabulate(analysis.table)
    rate = rate_of(table)
    return _template("page").render(
        study=outline.study,
        extent=extent(outline),
        compared=", ".join(next(iter(outline.columns.values()))),
        standing=standing(len(trials), counts["done"], counts["failed"]),
        complete=counts["done"] == len(trials),
        significant=significant(analysis),
        leads=headlines(results, there) or extremes(table, rate),
        rate=rate,
        notes=unfolded((*notes, *control_lines(there), *below_random(results, there))),
        table=table,
        pictures=pictures(figures),
        replays=packed,
        topologies=topologies(outline),
        hierarchies=drawn,
        failed=failed,
        seeds=runs(outline.seeds),
        spec=dumps(outline.table),
        versions=versions(),
        results_version=RESULTS_VERSION,
        css=_read_own("page.css"),
        js=_read_own("page.js"),
        replay_js=Markup(packed.script),
    )


def comparison_page(
    title: str,
    sources: str,
    notes: Sequence[str],
    table: SummaryTable,
    figures: Mapping[str, Figure],
) -> str:
    """Return a comparison as one self-contained page of HTML.

    Parameters
    ----------
    title
        What is compared.
    sources
        Where the results are from.
    notes
        What is said of them, in lines.
    table, figures
        What is shown.
    """
    return _template("comparison").render(
        title=title,
        sources=sources,
        notes=unfolded(notes),
        table=table,
        pictures=pictures(figures),
        versions=versions(),
        css=_read_own("page.css"),
        js=_read_own("page.js"),
    )


def player_page(packed: Replays) -> str:
    """Return a page of packed episodes alone, which a notebook shows in a frame; empty of none."""
    if not packed.episodes:
        return ""
    script = Markup(packed.script)
    css = _read_own("page.css")
    return _template("alone").render(replays=packed, css=css, replay_js=script)


def check_path(file: Path) -> None:
    """Refuse to write a page to where no HTML file can be.

    Raises
    ------
    SpecError
        If it is a directory, has another suffix, or is in no directory.
    """
    if file.is_dir() or not file.name:
        raise SpecError(f"--out {file}: is a directory")
    if file.suffix not in (".html", ".htm"):
        raise SpecError(f"--out {file}: suffix must be .html or .htm")
    if not file.parent.is_dir():
        raise SpecError(f"--out {file}: there is no directory {file.parent}")


def _template(name: str) -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["count"] = count
    environment.filters["whole"] = whole
    return environment.get_template(f"{name}.html.jinja")


def rate_of(table: SummaryTable) -> str:
    """Return the heading of the success that a summary tells, in evaluation if it is there.

    Where nothing is one, that of the return.
    """
    titles = [title for title in table.titles if "difference" not in title]
    rates = [t for t in titles if "success" in t] or [t for t in titles if "return" in t]
    return next((title for title in rates if "evaluation" in title), rates[0] if rates else "")


def extremes(table: SummaryTable, title: str) -> tuple[str, ...]:
    """Return the lowest and the highest of a column as a sentence; none of fewer than two lines."""
    lines = [line for line in table.lines if title in line.estimates]
    lines.sort(key=lambda line: float(line.estimates[title].value))
    if len(lines) < 2:
        return ()
    ends = (lines[0], lines[-1])
    low, high = (f"{format_estimate(line.estimates[title])} ({line.condition})" for line in ends)
    return (f"{title.capitalize()}: from {low} to {high}.",)


def significant(analysis: Analysis) -> str:
    """Return how many differences are significant, in words; empty if nothing was compared."""
    compared = [d.p < LEVEL for group in analysis.differences.values() for d in group]
    return (
        f"{sum(compared)} of {count(len(compared), 'difference')} significant" if compared else ""
    )


class Note(NamedTuple):
    """A line of what a study says, in one piece."""

    indent: int
    text: str


def unfolded(lines: Iterable[str]) -> list[Note]:
    """Return lines whose continuations, indented by two, are joined to what they continue."""
    notes: list[Note] = []
    for line in lines:
        indent = len(line) - len(line.lstrip())
        is_further = notes and indent == notes[-1].indent + 2 and not notes[-1].text.endswith(":")
        if is_further:
            indent, text = notes.pop()
            line = f"{text} {line.lstrip()}"
        notes.append(Note(indent, line.strip()))
    return notes


def _read_own(name: str) -> Markup:
    """Return a file of this package, which is HTML already."""
    return Markup((FOLDER / name).read_text(encoding="utf-8"))


PACKAGES = (
    "nested-agents",
    "Box2D",
    "joblib",
    "matplotlib",
    "networkx",
    "numba",
    "numpy",
    "pydantic",
    "scipy",
    "shapely",
)
"""The packages that results and figures come from."""


def runs(values: Iterable[int]) -> str:
    """Return whole numbers in order, runs of three or more by their ends.

    >>> runs([0, 1, 2, 3, 7, 9, 8, 20]), runs([1, 0])
    ('0 to 3, 7 to 9, 20', '0, 1')
    """
    ordered = np.array(sorted(values), dtype=np.int64)
    blocks = np.split(ordered, np.flatnonzero(np.diff(ordered) != 1) + 1)
    parts = [
        f"{block[0]} to {block[-1]}" if len(block) > 2 else ", ".join(map(str, block))
        for block in blocks
    ]
    return ", ".join(parts)


def extent(outline: StudyOutline) -> str:
    """Return what a study consists of."""
    after = ""
    if outline.evaluation:
        longest = outline.table.get("evaluation_steps")
        after = f", {count(outline.evaluation, 'evaluation episode')} after them"
        after += f" of up to {count(longest, 'step')}" if longest else ""
        others = len(outline.table.get("evaluations", ()))
        each = "another scenario" if others == 1 else f"each of {others} other scenarios"
        after += f" and as many in {each}" if others else ""
    return (
        f"{count(len(outline.columns), 'condition')} × {count(len(outline.seeds), 'seed')}, each "
        f"{outline.lengths.replace('episode', 'training episode')} of up to "
        f"{count(outline.steps, 'step')}{after}"
    )


def topologies(outline: StudyOutline) -> dict[str, str]:
    """Return the topologies that a spec names, as it writes them, failures included, by where."""
    own = {o["name"]: o for o in outline.table.get("overrides", ())}
    tables = {"every condition": outline.table} | own | dict(outline.table.get("evaluations", {}))
    return {
        name: show(t["topology"], width=None) for name, t in tables.items() if t.get("topology")
    }


def standing(total: int, done: int, failed: int) -> str:
    """Return how far a study is."""
    if done == total:
        return f"All {count(total, 'trial')} are done." if total > 1 else "Its one trial is done."
    left = total - done - failed
    parts = [f"{done} of {count(total, 'trial')} {'is' if done == 1 else 'are'} done"]
    parts += [f"{failed} failed"] * bool(failed) + [f"{left} left"] * bool(left)
    what = "What follows is of those done." if done else "There is nothing to show yet."
    return f"{'Unfinished' if left else 'With failures'}: {', '.join(parts)}. {what}"


def versions() -> list[tuple[str, str]]:
    """Return name and version of the software that is running, and the platform in words."""
    machine = f"{platform.system()} on {platform.machine()}"
    python = platform.python_implementation(), platform.python_version()
    return [python, *((name, installed(name)) for name in PACKAGES), ("platform", machine)]


def hide_places(text: str) -> str:
    """Return text in which absolute paths keep their last two parts only.

    >>> hide_places('File "/home/me/lib/core/team.py", line 3')
    'File "…/core/team.py", line 3'
    """
    return re.sub(r"(?<![\w.…/:])/(?:[^\s\"':/]+/)+(?=[^\s\"':/]+/[^\s\"':/]+)", "…/", text)
