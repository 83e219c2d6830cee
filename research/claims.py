"""The claims of papers, each with what is measured and the criterion that decides it.

No verdict is given by hand: claims, measures and criteria stand in ``claims.toml``, and what a
measure computes in `measures`. A criterion looks at the interval of the estimate. A claim *holds*
if all of it meets the criterion, *does not hold* if none of it does, and is *not decided* in
between, or by fewer than `LEAST_SEEDS`.
"""

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from rich.console import Console
from rich.table import Table

from ..studies.cli.display import print_text, print_wrapped
from ..studies.results.notation import format_estimate, format_number, format_p
from ..studies.results.results import NOTHING, Results
from ..studies.results.statistics import LEVEL
from .measures import MEASURES, Measured

Verdict = Literal["holds", "does not hold", "not decided", "helps", "harms", "equal"]

LEAST_SEEDS = 5
"""Seeds below which no interval is trusted with a verdict."""


@dataclass(frozen=True)
class Criterion:
    """An estimate meets it between two bounds, if no test finds a difference.

    Examples
    --------
    >>> at_least(0.8).text, within(0.15).text
    ('at least 0.8', 'within 0.15 of 0, no p < 0.05')
    """

    text: str
    """The criterion in words."""
    low: float = -inf
    """The lower bound, included."""
    high: float = inf
    """The upper bound, included."""
    legend: ClassVar = (
        "A claim holds if the whole interval meets the criterion, does not if none of it does, "
        "and is not decided in between or by under 5 seeds."
    )

    def decide(self, measured: Measured) -> Verdict:
        """Compare the whole interval with the bounds, and p with 0.05."""
        e = measured.estimate
        if (
            e.high < self.low
            or e.low > self.high
            or (measured.p is not None and measured.p < LEVEL)
        ):
            return "does not hold"
        return "holds" if e.low >= self.low and e.high <= self.high else "not decided"


@dataclass(frozen=True)
class Benefit:
    """A difference helps or harms if p < 0.05, and is none if it lies within a margin.

    Examples
    --------
    >>> Benefit(0.1).text
    'p < 0.05, or equal within 0.10'
    """

    margin: float
    """Within which a difference is none that matters, named before the runs."""
    legend: ClassVar = (
        "It helps or harms by p < 0.05, adjusted over all comparisons of a study (Holm), is equal "
        "if the whole interval lies within the margin, which its spec named before the runs, and "
        "is not decided otherwise."
    )

    @property
    def text(self) -> str:
        """The criterion in words."""
        return f"p < 0.05, or equal within {format_number(self.margin)}"

    def decide(self, measured: Measured) -> Verdict:
        """Compare p with 0.05, and the whole interval with the margin."""
        value, low, high = map(float, measured.estimate)
        if measured.p is not None and measured.p < LEVEL:
            return "helps" if value > 0.0 else "harms"
        return "equal" if -self.margin <= low and high <= self.margin else "not decided"


def at_least(threshold: float) -> Criterion:
    """Return the criterion that a value reaches a threshold."""
    return Criterion(f"at least {threshold:g}", low=threshold)


def at_most(threshold: float) -> Criterion:
    """Return the criterion that a value does not pass a threshold."""
    return Criterion(f"at most {threshold:g}", high=threshold)


def within(margin: float) -> Criterion:
    """Return the criterion that a value is zero but for a margin."""
    return Criterion(f"within {margin:g} of 0, no p < 0.05", -margin, margin)


@dataclass(frozen=True)
class Claim:
    """A claim, by what it is decided."""

    name: str
    """For programs."""
    text: str
    """What is claimed."""
    place: str
    """Where; empty: in no paper."""
    study: str
    """The study that measures it."""
    measure: str
    """What is measured."""
    criterion: Criterion | Benefit
    """What the measure must be."""


@dataclass(frozen=True)
class PaperClaim(Claim):
    """A claim of a paper, as it stands in ``claims.toml``."""

    compute: Callable[[Results], Measured | None]
    """Measures it; none of the study's results: it cannot be decided."""

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> "PaperClaim":
        """Return the claim of a table: its measure is one of `MEASURES`, with arguments."""
        (name,) = CRITERIA.keys() & table.keys()
        return cls(
            table["name"],
            table["text"],
            table["place"],
            table["study"],
            table["measure"],
            CRITERIA[name](table[name]),
            partial(MEASURES[table["compute"]], **table.get("of", {})),
        )


CRITERIA = {"at_least": at_least, "at_most": at_most, "within": within}
_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
PAPERS = {paper: tuple(map(PaperClaim.of, tables)) for paper, tables in _TABLE.items()}
"""Every claim that is decided, by the paper that makes it."""
OWN = "nested-agents"
"""The paper that all this is of."""


def studies_of(paper: str = OWN) -> tuple[str, ...]:
    """Return the studies that have to be run for a paper's claims; costs are computed."""
    return tuple(dict.fromkeys(claim.study for claim in PAPERS[paper] if claim.study != "cost"))


@dataclass(frozen=True)
class Finding:
    """The verdict on a claim; `measured` is None if its study has no results."""

    claim: Claim
    measured: Measured | None

    @property
    def verdict(self) -> Verdict:
        """Whether the measure meets the criterion; not decided by too few seeds."""
        if self.measured is None or 0 < self.measured.seeds < LEAST_SEEDS:
            return "not decided"
        return self.claim.criterion.decide(self.measured)

    @property
    def result(self) -> str:
        """The value with its interval and number of seeds, as text."""
        if self.measured is None:
            return "no results"
        value = float(self.measured.estimate.value)
        text = f"{format_number(value)}, computed"
        if self.measured.seeds:
            text = f"{format_estimate(self.measured.estimate)}, {self.measured.seeds} seeds"
        if self.measured.p is not None:
            text += f", p {format_p(self.measured.p)}"
        return text + (f", {self.measured.note}" if self.measured.note else "")


def judge(results: Mapping[str, Results], paper: str = OWN) -> tuple[Finding, ...]:
    """Decide every claim of a paper by the results of its study, by name."""
    findings = []
    for claim in PAPERS[paper]:
        measured = None
        with suppress(KeyError):  # there are no such episodes
            measured = claim.compute(results.get(claim.study, NOTHING()))
        is_known = measured is not None and np.isfinite(measured.estimate.value)
        findings.append(Finding(claim, measured if is_known else None))
    return tuple(findings)


Format = Literal["table", "json", "markdown"]

COLOURS = {"not decided": "yellow"} | dict.fromkeys(("holds", "helps"), "green")
COLOURS |= dict.fromkeys(("does not hold", "harms"), "red") | {"equal": "blue"}


def print_claims(findings: Sequence[Finding], form: Format) -> None:
    """Print the findings."""
    if form == "json":
        print(json.dumps([_record(finding) for finding in findings], indent=1, allow_nan=False))
        return
    if form == "markdown":
        print(markdown(findings))
        return
    table = Table(box=None, padding=(0, 1, 1, 0), pad_edge=False, header_style="bold")
    for title, width in (("claim", 4), ("measure, criterion", 5), ("result", 3), ("verdict", 2)):
        table.add_column(title, ratio=width)
    for finding in findings:
        claim = finding.claim
        colour = COLOURS[finding.verdict]
        table.add_row(
            claim.text + (f" [dim]({claim.place})[/]" if claim.place else ""),
            f"{claim.measure}: [dim]{claim.criterion.text}[/]",
            finding.result,
            f"[{colour}]{finding.verdict}[/]",
        )
    Console().print(table)
    print_text("")
    print_wrapped(f"With 95% intervals. {findings[0].claim.criterion.legend}", indent=0)


def markdown(findings: Sequence[Finding]) -> str:
    """Return the table as Markdown."""
    lines = ["| claim | in the paper | study | measure | criterion | result | verdict |"]
    lines.append("|---" * 7 + "|")
    for finding in findings:
        claim = finding.claim
        cells = (
            claim.text,
            claim.place,
            claim.study,
            claim.measure,
            claim.criterion.text,
            finding.result,
            f"**{finding.verdict}**",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _record(finding: Finding) -> dict[str, object]:
    claim = finding.claim
    measured = finding.measured
    record: dict[str, object] = {
        "name": claim.name,
        "claim": claim.text,
        "place": claim.place,
        "study": claim.study,
        "measure": claim.measure,
        "criterion": claim.criterion.text,
        "verdict": finding.verdict,
    }
    if measured is not None:
        value, low, high = (v if np.isfinite(v) else None for v in map(float, measured.estimate))
        record |= {"value": value, "low": low, "high": high, "seeds": measured.seeds}
        record |= {"p": measured.p, "note": measured.note}
    return record
