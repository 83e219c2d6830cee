"""The claims of papers, each with what is measured and the criterion that decides it.

No verdict is given by hand: measures and criteria stand in ``claims.toml``. A criterion looks at an
estimate with its 95 % interval. A claim *holds* if the whole interval meets the criterion, *does
not hold* if none of it does, and is *not decided* in between, or by fewer than `LEAST_SEEDS`.
"""

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rich.console import Console
from rich.table import Table

from ..presentation.tables import ends
from ..results.results import NOTHING, Results
from . import measures
from .measures import Measured

Verdict = Literal["holds", "does not hold", "not decided"]

LEAST_SEEDS = 5
"""Seeds below which no interval is trusted with a verdict."""


@dataclass(frozen=True)
class Criterion:
    """An estimate meets it between two bounds, if no test finds a difference.

    Examples
    --------
    >>> at_least(0.8).text, within(0.01).text
    ('at least 0.8', 'within 0.01 of 0, no p < .05')
    """

    text: str
    """The criterion in words."""
    low: float = -inf
    """The lower bound, included."""
    high: float = inf
    """The upper bound, included."""

    def decide(self, measured: Measured) -> Verdict:
        """Compare the whole interval with the bounds, and p with .05."""
        e = measured.estimate
        if e.high < self.low or e.low > self.high or (measured.p is not None and measured.p < 0.05):
            return "does not hold"
        return "holds" if e.low >= self.low and e.high <= self.high else "not decided"


def at_least(threshold: float) -> Criterion:
    """Return the criterion that a value reaches a threshold."""
    return Criterion(f"at least {threshold:g}", low=threshold)


def at_most(threshold: float) -> Criterion:
    """Return the criterion that a value does not pass a threshold."""
    return Criterion(f"at most {threshold:g}", high=threshold)


def within(margin: float) -> Criterion:
    """Return the criterion that a value is zero but for a margin."""
    return Criterion(f"within {margin:g} of 0, no p < .05", -margin, margin)


@dataclass(frozen=True)
class Claim:
    """A claim of a paper, as it stands in ``claims.toml``."""

    name: str
    """For programs."""
    text: str
    """What is claimed."""
    place: str
    """Where."""
    study: str
    """The study that measures it."""
    measure: str
    """What is measured."""
    compute: Callable[[Results], Measured | None]
    """Measures it; none of the study's results: it cannot be decided."""
    criterion: Criterion
    """What the measure must be."""


def _claim(*, compute: str, of: Mapping[str, Any] | None = None, **table: Any) -> Claim:
    """Return the claim of a table: its measure is a function of `measures`, with arguments."""
    criterion = next(make(table.pop(name)) for name, make in CRITERIA.items() if name in table)
    return Claim(
        compute=partial(getattr(measures, compute), **(of or {})), criterion=criterion, **table
    )


CRITERIA = {"at_least": at_least, "at_most": at_most, "within": within}
_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
PAPERS = {paper: tuple(_claim(**table) for table in tables) for paper, tables in _TABLE.items()}
"""Every claim that is decided, by the paper that makes it."""
OWN = "nested-agents"
"""The paper that all this is of."""


def studies_of(paper: str = OWN) -> tuple[str, ...]:
    """Return the studies that have to be run for a paper's claims; costs are computed."""
    return tuple(dict.fromkeys(claim.study for claim in PAPERS[paper] if claim.study != "cost"))


SPECS = Path(__file__).parents[1] / "catalogue"
"""Where their specs are: one folder for each study."""
PUBLISHED = Path(__file__).parent / "published"
"""Where the committed results are."""
QUICK = Path(__file__).parent / "quick"
"""Where the small versions are."""


@dataclass(frozen=True)
class Finding:
    """The verdict on a claim; `measured` is None if its study has no results."""

    claim: Claim
    measured: Measured | None
    verdict: Verdict

    @property
    def result(self) -> str:
        """The value with its interval and number of seeds, as text."""
        if self.measured is None:
            return "no results"
        value, low, high = ends(self.measured.estimate)
        text = f"{value:.2f}" if self.measured.seeds else f"{value:.2g}"
        if self.measured.seeds:
            text += f" ({low:.2f} to {high:.2f}), {self.measured.seeds} seeds"
        else:
            text += ", computed"
        if self.measured.p is not None:
            text += f", p = {self.measured.p:.2g}"
        return text + (f", {self.measured.note}" if self.measured.note else "")


def judge(results: Mapping[str, Results], paper: str = OWN) -> tuple[Finding, ...]:
    """Decide every claim of a paper by the results of its study, by name."""
    findings = []
    for claim in PAPERS[paper]:
        measurement = claim.compute(results.get(claim.study, NOTHING()))
        if measurement is None or not np.isfinite(measurement.estimate.value):
            findings.append(Finding(claim, None, "not decided"))
            continue
        enough = measurement.seeds == 0 or measurement.seeds >= LEAST_SEEDS
        verdict = claim.criterion.decide(measurement) if enough else "not decided"
        findings.append(Finding(claim, measurement, verdict))
    return tuple(findings)


Format = Literal["table", "json", "markdown"]

COLOURS = {"holds": "green", "does not hold": "red", "not decided": "yellow"}


def print_claims(findings: Sequence[Finding], form: Format) -> None:
    """Print the findings."""
    if form == "json":
        print(json.dumps([_record(finding) for finding in findings], indent=1, allow_nan=False))
    elif form == "markdown":
        print(markdown(findings))
    else:
        _print_table(findings)


def _print_table(findings: Sequence[Finding]) -> None:
    table = Table(box=None, padding=(0, 1, 1, 0), pad_edge=False, header_style="bold")
    for title, ratio in (("claim", 4), ("measure, criterion", 5), ("result", 3), ("verdict", 2)):
        table.add_column(title, ratio=ratio)
    for finding in findings:
        claim, colour = finding.claim, COLOURS[finding.verdict]
        table.add_row(
            f"{claim.text} [dim]({claim.place})[/]",
            f"{claim.measure}: [dim]{claim.criterion.text}[/]",
            finding.result,
            f"[{colour}]{finding.verdict}[/]",
        )
    Console().print(table)
    print("With 95 % intervals. A claim holds if the whole interval meets the criterion,")
    print("does not if none of it does, and is not decided in between or by under 5 seeds.")


def markdown(findings: Sequence[Finding]) -> str:
    """Return the table as Markdown."""
    lines = ["| claim | in the paper | study | measure | criterion | result | verdict |"]
    lines.append("|---" * 7 + "|")
    for finding in findings:
        c = finding.claim
        cells = (
            c.text, c.place, c.study, c.measure, c.criterion.text, finding.result,
            f"**{finding.verdict}**",
        )  # fmt: skip
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    return "\n".join(lines)


def _record(finding: Finding) -> dict[str, Any]:
    claim, measured = finding.claim, finding.measured
    record: dict[str, Any] = {
        "name": claim.name,
        "claim": claim.text,
        "place": claim.place,
        "study": claim.study,
        "measure": claim.measure,
        "criterion": claim.criterion.text,
        "verdict": finding.verdict,
    }
    if measured is not None:
        value, low, high = (v if np.isfinite(v) else None for v in ends(measured.estimate))
        record |= {"value": value, "low": low, "high": high, "seeds": measured.seeds}
        record |= {"p": measured.p, "note": measured.note}
    return record
