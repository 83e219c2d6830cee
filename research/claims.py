"""The claims of papers: measures, criteria and verdicts.

``python -m research.claims`` prints a table of each claim of the paper with its measure, the
result and the verdict, from the committed results. ``--out DIR`` runs the studies instead, in a
directory of their own each, and reads what has been run before.

No verdict is given by hand: claims, measures and criteria stand in ``claims.toml``, and what a
measure computes in `measures`. A criterion looks at the interval of the estimate. A claim *holds*
if all of it meets the criterion, *does not hold* if none of it does, and is *not decided* in
between, or by fewer than `LEAST_SEEDS`.
"""

import argparse
import json
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from rich.console import Console
from rich.table import Table

import nested_agents as na
from nested_agents.analysis import (
    LEVEL,
    NOTHING,
    Results,
    format_estimate,
    format_number,
    format_p,
)
from nested_agents.terminal import closest, print_text, print_wrapped, run_to_status

from . import FOLDER, QUICK, RESULTS, SPECS
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

COLORS = {"not decided": "yellow"} | dict.fromkeys(("holds", "helps"), "green")
COLORS |= dict.fromkeys(("does not hold", "harms"), "red") | {"equal": "blue"}


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
        color = COLORS[finding.verdict]
        table.add_row(
            claim.text + (f" [dim]({claim.place})[/]" if claim.place else ""),
            f"{claim.measure}: [dim]{claim.criterion.text}[/]",
            finding.result,
            f"[{color}]{finding.verdict}[/]",
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


CATALOG = FOLDER.parent / "studies" / "catalogue"
"""Specs of the installed studies, one folder for each."""
NETWORKS = "networks"
"""Name of the claims that the tables of research/notebooks/ppo.md decide."""


def spec_of_study(study: str) -> Path:
    """Return the spec of a study, of this folder or of the catalog."""
    name = study.replace("-", "_")
    own = SPECS / f"{study}.toml"
    return own if own.exists() else CATALOG / name / f"{name}.toml"


def committed(paper: str) -> dict[str, Results]:
    """Return the committed results of the studies of a paper's claims, by study."""
    paths = {study: RESULTS / f"{study}.json" for study in studies_of(paper)}
    results = {}
    for study, path in paths.items():
        if path.exists():
            loaded = na.load(path)
            results[study] = loaded.results
            for remark in loaded.remarks:
                print(remark, file=sys.stderr)
    return results


def run_studies(out: Path, paper: str, *, quick: bool, jobs: int | None) -> dict[str, Results]:
    """Run what is left of the studies of a paper's claims; return the results by study."""
    results = {}
    for study in studies_of(paper):
        path = QUICK / f"{study.replace('-', '_')}.toml" if quick else spec_of_study(study)
        results[study] = run_study(path, out / study, jobs).results
    return results


def run_study(spec: Path, folder: Path, jobs: int | None) -> na.StudyResults:
    """Run what is left of a study.

    Raises
    ------
    SpecError
        If a trial has failed.
    """
    ran = na.run(spec, folder, jobs=jobs)
    if ran.failed:
        raise na.SpecError(
            f"{folder}: {len(ran.failed)} trials failed: nested-agents status {folder}"
        )
    return ran


def _of_networks(out: Path | None, jobs: int | None) -> list[Finding]:
    """Decide whether edges help networks, by committed results or by studies run for it."""
    from .experience import TASKS, edge, edges, read, rows_of, spec_of

    if out is None:
        return [worth.finding for worth in edges()]
    findings = []
    for name, task in TASKS.items():
        ran = run_study(spec_of(name), out / f"{name}-experience", jobs)
        rows = rows_of(ran.results, task.shown[-1], read(name).columns[-1])
        findings.append(edge(name, rows).finding)
    return findings


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the claims and return the exit status."""
    papers = (*PAPERS, NETWORKS)
    parser = argparse.ArgumentParser(
        prog="python -m research.claims", description="Print the verdict on each claim of a paper."
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="run the studies below this directory"
    )
    parser.add_argument(
        "--quick", action="store_true", help="small versions of 5 or 6 seeds; needs --out"
    )
    parser.add_argument("--of", default=OWN, metavar="PAPER", help=f"one of {', '.join(papers)}")
    parser.add_argument("--jobs", type=int, metavar="N", help="worker processes; needs --out")
    parser.add_argument("--format", default="table", choices=get_args(Format))
    options = parser.parse_args(arguments)
    out, of = options.out, options.of
    if of not in papers:
        raise na.SpecError(f"--of = {of!r}: {closest(of, papers)}")
    if out is None and (options.quick or options.jobs is not None):
        name = "--quick" if options.quick else "--jobs"
        raise na.SpecError(f"{name}: needs --out, where to run the studies")
    if of == NETWORKS and options.quick:
        raise na.SpecError(f"--quick: --of {NETWORKS} has no small versions")
    if of == NETWORKS:
        print_claims(_of_networks(out, options.jobs), options.format)
        return 0
    results = (
        committed(of)
        if out is None
        else run_studies(out, of, quick=options.quick, jobs=options.jobs)
    )
    print_claims(judge(results, of), options.format)
    return 0


if __name__ == "__main__":
    raise SystemExit(run_to_status("research.claims", main))
