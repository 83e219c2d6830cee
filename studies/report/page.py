"""The page: what a study's directory holds, in figures and sentences, put into the template."""

import base64
import io
import platform
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import jinja2
import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from ..catalogue.study import analysed, drawn, load_study
from ..errors import show
from ..presentation.figures import styled
from ..presentation.tables import tabulate
from ..presentation.words import count
from ..results.analysis import identity_lines
from ..results.contrasts import contrasts
from ..results.results import read
from ..spec.outline import StudyOutline, sources_of
from ..spec.overlay import dumps
from ..store.schema import RESULTS_VERSION
from ..store.store import Store
from ..workers.worker import installed
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
            (condition, seed, without_places(error.rstrip()))
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
        extent=extent(outline),
        compared=", ".join(next(iter(outline.columns.values()))),
        standing=standing(len(trials), counts["done"], counts["failed"]),
        complete=counts["done"] == len(trials),
        notes=notes,
        table=tabulate(analysis.table),
        pictures=pictures(figures),
        replays=packed,
        topologies=topologies(outline),
        failed=failed,
        seeds=runs(outline.seeds),
        spec=dumps(outline.table),
        versions=versions(),
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


@dataclass(frozen=True)
class Picture:
    """A figure."""

    name: str
    """Its file's, without suffix."""
    svg: Markup
    """An element that can stand in a page beside others."""
    pdf: str
    """The same figure, in base64."""

    @property
    def title(self) -> str:
        """The name in words."""
        return self.name.replace("-", " ").replace("_", " ")


def pictures(figures: Mapping[str, Figure]) -> list[Picture]:
    """Return a study's figures, by name, as they stand in a page and are taken away from it."""
    drawn = []
    with styled():
        for number, (name, figure) in enumerate(figures.items(), 1):
            svg = io.StringIO()
            figure.savefig(svg, format="svg", metadata={"Date": None})
            text = embedded(svg.getvalue(), f"figure{number}-")
            pdf = io.BytesIO()
            figure.savefig(pdf, format="pdf", metadata={"CreationDate": None})
            encoded = base64.b64encode(pdf.getvalue()).decode("ascii")
            drawn.append(Picture(name, Markup(text), encoded))
    return drawn


def embedded(svg: str, prefix: str) -> str:
    """Return an SVG file's root element, its ids and its style kept from those of other ones.

    Examples
    --------
    >>> embedded('<?xml version="1.0"?><svg><style>*{a: b}</style><g id="x"/></svg>', "f-")
    '<svg id="f-"><style>#f- *{a: b}</style><g id="f-x"/></svg>'
    """
    svg = svg[svg.index("<svg") :].strip()
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#{prefix}", svg)
    svg = re.sub(r"(<style[^>]*>)\s*\*", rf"\1#{prefix} *", svg)
    return svg.replace("<svg", f'<svg id="{prefix}"', 1)


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


def without_places(text: str) -> str:
    """Return text in which absolute paths keep their last two parts only.

    >>> without_places('File "/home/me/lib/core/team.py", line 3')
    'File "…/core/team.py", line 3'
    """
    return re.sub(r"(?<![\w.…/:])/(?:[^\s\"':/]+/)+(?=[^\s\"':/]+/[^\s\"':/]+)", "…/", text)
