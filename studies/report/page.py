"""Report pages: results of a study rendered into an HTML template."""

import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

from ..catalogue.study import analyse_as, draw_figures, load_study, notes_of
from ..errors import SpecError
from ..laws.size_axis import key_beside_size
from ..presentation.headlines import below_random, headlines
from ..presentation.progress import count
from ..presentation.tables import SummaryTable, tabulate
from ..results.analysis import Analysis, identity_lines
from ..results.comparison import compare_conditions, missing_reference
from ..results.notation import whole
from ..results.results import Results, read
from ..scalability.report import ScalabilityReport, analyze
from ..spec.conditions import ConditionSettings
from ..spec.controls import control_lines
from ..spec.outline import StudyOutline, older_results, sources_of
from ..spec.tables import SpecTable, dumps
from ..store.store import Store
from ..workers.runner import installed
from .pictures import hierarchy_pictures, pictures
from .replays import replays
from .sentences import condition_sentences, main_title, methods, significant, verdict

FOLDER = Path(__file__).parent
CITATION = (
    "nested-agents contributors (2026). nested-agents, version {version}. Its architecture is that "
    "of Karigiannis, J. N., Rekatsinas, T. I. and Tzafestas, C. S. (2010). Fuzzy Rule Based "
    "Neuro-Dynamic Programming for Mobile Robot Skill Acquisition on the basis of a Nested "
    "Multi-Agent Architecture."
)
"""References for a publication that uses the results, see CITATION.cff."""


def page(directory: Path) -> str:
    """Return the report of the study in a directory as HTML.

    Raises
    ------
    SpecError
        If the directory has no readable study, or its results are damaged.
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
        files = [hide_places(name) for name in store.sources()]
        settings = store.settings()
        drawn = hierarchy_pictures(store)
        older = older_results(store)
        results_version = store.version
    with sources.active():
        analyzed = analyse_as(outline.study, results)
        figures = dict(draw_figures(load_study(outline.study), analyzed))
        scalability = _scalability(results, settings)
    analysis = _judged(results, analyzed)
    notes = analysis.notes if older is None else (older, *analysis.notes)
    there = {label: own for label, own in settings.items() if label in results.conditions}
    table = tabulate(analysis.table)
    rate = main_title(table)
    differences = analysis.differences.values()
    return _template("page").render(
        study=outline.study,
        title=outline.table.get("title") or outline.study,
        citation=CITATION.format(version=installed("nested-agents")),
        extent=extent(outline),
        compared=", ".join(next(iter(outline.columns.values()))),
        standing=standing(len(trials), counts["done"], counts["failed"]),
        complete=counts["done"] == len(trials),
        significant=significant(analysis),
        leads=(*verdict(table, rate, analysis), *headlines(results, there)),
        sentences=condition_sentences(table, rate, analysis),
        methods=methods(settings, extent(outline), table, is_compared=any(differences)),
        notes=unfolded((*notes, *control_lines(there), *below_random(results, there))),
        table=table,
        pictures=pictures(dict(sorted(figures.items(), key=is_secondary))),
        scalability=scalability,
        panels=pictures({"scalability": scalability.figure()}, "panels") if scalability else [],
        replays=packed,
        hierarchies=drawn,
        failed=failed,
        spec=dumps(outline.table),
        files=files,
        versions=versions(),
        results_version=results_version,
        css=_read_own("page.css"),
        js=_read_own("page.js"),
        replay_js=Markup(packed["script"]),
    )


def _judged(results: Results, analysis: Any) -> Analysis:
    """Return the analysis of a study, with a comparison of its conditions if it has no notes."""
    if not isinstance(analysis, Analysis):
        analysis = Analysis(tuple(analysis.table), notes_of(analysis))
    if len(results.conditions) > 1 and [*analysis.notes] == identity_lines(results.identical):
        compared = compare_conditions(results, results.main.name, by=key_beside_size(results))
        differences = {compared.title: compared.differences}
        analysis = replace(analysis, notes=compared.notes, differences=differences)
    return replace(analysis, notes=(*missing_reference(results), *analysis.notes))


def _scalability(results: Results, settings: Mapping[str, SpecTable]) -> ScalabilityReport | None:
    """Return the scalability report, or None if the study does not compare team sizes."""
    validated = {}
    with suppress(ValueError, KeyError, ImportError):  # the scaling is unknown then
        for condition, own in settings.items():
            validated[condition] = ConditionSettings.model_validate(own)
    try:
        return analyze(results, validated, None, None, None, None, "")
    except SpecError:  # no size, one size, or two conditions of a size
        return None


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
        Title of the comparison.
    sources
        Origin of the results.
    notes
        Remarks, in lines.
    table, figures
        Table and figures of the comparison.
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


def check_path(file: Path) -> None:
    """Check that an HTML file can be written to a path.

    Raises
    ------
    SpecError
        If the path is a directory, has another suffix, or its directory does not exist.
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


def is_secondary(figure: tuple[str, object]) -> bool:
    """Return whether a figure shows something else than success; such figures come last."""
    return "success" not in figure[0] and "learning" not in figure[0]


def unfolded(lines: Iterable[str]) -> list[tuple[int, str]]:
    """Return the indent and the text of remarks: lines indented by two continue the one before."""
    notes: list[tuple[int, str]] = []
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if notes and indent == notes[-1][0] + 2 and not notes[-1][1].endswith(":"):
            indent, text = notes.pop()
            line = f"{text} {line.lstrip()}"
        notes.append((indent, line.strip()))
    return notes


def _read_own(name: str) -> Markup:
    """Return a file of this package as safe HTML."""
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
"""Packages that compute results and figures."""


def extent(outline: StudyOutline) -> str:
    """Return the number of conditions, seeds, episodes and steps of a study in words."""
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


def standing(total: int, done: int, failed: int) -> str:
    """Return the progress of a study in a sentence."""
    if done == total:
        return f"All {count(total, 'trial')} are done." if total > 1 else "Its one trial is done."
    left = total - done - failed
    parts = [f"{done} of {count(total, 'trial')} {'is' if done == 1 else 'are'} done"]
    parts += [f"{failed} failed"] * bool(failed) + [f"{left} left"] * bool(left)
    what = "What follows is of those done." if done else "There is nothing to show yet."
    return f"{'Unfinished' if left else 'With failures'}: {', '.join(parts)}. {what}"


def versions() -> list[tuple[str, str]]:
    """Return names and versions of the installed software, and the platform."""
    machine = f"{platform.system()} on {platform.machine()}"
    python = platform.python_implementation(), platform.python_version()
    return [python, *((name, installed(name)) for name in PACKAGES), ("platform", machine)]


def hide_places(text: str) -> str:
    """Shorten absolute paths in a text to their last two parts.

    >>> hide_places('File "/home/me/lib/core/team.py", line 3')
    'File "…/core/team.py", line 3'
    """
    return re.sub(r"(?<![\w.…/:])/(?:[^\s\"':/]+/)+(?=[^\s\"':/]+/[^\s\"':/]+)", "…/", text)
