"""The claims of papers, each with what is measured and the criterion that decides it.

No verdict is given by hand: measures and criteria stand in ``claims.toml``. What a claim computes
is a public function of this module; it returns an estimate with its 95 % interval over seeds. It
returns None, or raises KeyError, where the results have not what it takes. A criterion looks at
that interval. A claim *holds* if all of it meets the criterion, *does not hold* if none of it does,
and is *not decided* in between, or by fewer than `LEAST_SEEDS`.
"""

import json
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rich.console import Console
from rich.table import Table

from ...core.agents.cost import Problem
from ...core.numerics import pd
from ..catalogue.chain_order import order_tests
from ..catalogue.shapes import ratios_of
from ..catalogue.wheel_failure import courses_of
from ..results.analysis import EVALUATED, BySeed, difference, paired_difference, ratio, shared
from ..results.results import NOTHING, Results, Sizes
from ..results.statistics import NOT_NEGATIVE, Estimate, bootstrap, rate
from ..store.database import EVALUATION

CONTACT = "contact_fraction"
VALUE_OF = "learner.decision.value_of"
LAST = slice(-5, None)
FIRST = slice(None, 5)
UNREWARDED = ("frozen", "random")
"""Controls that know no more of the task than a learner does before its first reward."""
LEARNER = "own-value"
"""The preset by which claims are judged: every wheel seeks its own value, as in the paper. A study
without it is judged by its `default`."""
PLANNER = "planner"
"""The control that has the reward function and plans by it."""
PAPER_NESTED, PAPER_SINGLE = 2.45e12, 1.1e27
"""What the paper prints in Section VII."""


@dataclass(frozen=True)
class Measured:
    """An estimate of what a claim is about."""

    estimate: Estimate
    """The value and its interval."""
    seeds: int
    """How many seeds it rests on; 0: it is computed."""
    p: float | None = None
    """Of a test, if there is one."""
    note: str = ""
    """What the value is of, if that is part of the result."""


def learned(results: Results, name: str = "", known: Sequence[str] = UNREWARDED) -> Measured | None:
    """Measure success at the end of training, less that of the better control.

    Of the condition of a `name`; without, of that by which claims are judged.
    """
    controls = [c for c in known if results.has(c, "training")]
    condition = name or learner_of(results)
    if not controls:
        return None
    best = max(controls, key=lambda c: float(results.success(c)[:, LAST].mean()))
    own, base = (results.by_seed(c, "training").iloc[:, LAST] for c in (condition, best))
    return _paired(own, base, difference, f"against {best}")


def learner_of(results: Results) -> str:
    """Return the condition by which claims are judged."""
    return LEARNER if results.has(LEARNER, "training") else "default"


def sooner_than_planned(results: Results) -> Measured | None:
    """Measure the learner's decisions in an evaluation episode over the planner's, by seed."""
    conditions = learner_of(results), PLANNER
    own, base = (results.means(c, "evaluation", "steps") for c in conditions)
    return _paired(own, base, lambda a, b: bootstrap(a / b, bounds=NOT_NEGATIVE))


def success(
    results: Results, first: int, last: int | None = None, name: str = "", note: str = ""
) -> Measured | None:
    """Measure success in training episodes from a first one to before a last one, by index.

    For the `name` see `learned`.
    """
    outcomes = results.success(name or learner_of(results))[:, first:last]
    return Measured(rate(outcomes), len(outcomes), note=note) if outcomes.size else None


def contact_gained(results: Results) -> Measured | None:
    """Measure by how much more the learner's time in contact grows than the planner's.

    That of any agent grows in training, since fewer and fewer actions are random.
    """
    gained = []
    for condition in (learner_of(results), PLANNER):
        contact = results.values(condition, CONTACT)
        more = contact[:, LAST].mean(axis=1) - contact[:, FIRST].mean(axis=1)
        gained.append(pd.Series(more, results.seeds(condition)))
    return _paired(gained[0], gained[1], lambda own, base: bootstrap(own - base))


def cost_error(results: Results) -> Measured:
    """Compute how far the paper's two costs are from its formulas."""
    nested, single = Problem().nested(range(4)), Problem().single_agent(4)
    return _computed(max(nested / PAPER_NESTED - 1.0, single / PAPER_SINGLE - 1.0, key=abs))


def tried_beside_joint_action_learners(results: Results) -> Measured:
    """Compute the joint actions that four nested agents try, over those of joint-action learners.

    A joint-action learner considers what all others may do, a nested agent those below it.
    """
    problem, n = Problem(), 4
    share = problem.decision(range(n)) / problem.decision([n - 1] * n)
    return _computed(share, f"{n} agents")


def _computed(value: float, note: str = "") -> Measured:
    """Return a value that is of no study: its interval is the value itself."""
    return Measured(Estimate(*[np.asarray(value)] * 3), 0, note=note)


def optimal(results: Results, system: str) -> Measured | None:
    """Measure how often a system ends in the optimum of its worst game."""
    games = []
    for condition, columns in results.columns.items():
        if columns.get("name") == system and results.has(condition, "evaluation"):
            success = results.success(condition, "evaluation")
            game = ", ".join(str(value) for key, value in columns.items() if key != "name")
            games.append(Measured(rate(success), len(success), note=game))
    return _worst(games)


def _worst(measured: Iterable[Measured]) -> Measured | None:
    """Return what is of the least value; None if nothing is measured."""
    return min(measured, key=lambda m: float(np.nan_to_num(m.estimate.value)), default=None)


def gained_by_edges(results: Results, edges: str, less: str) -> Measured | None:
    """Measure success with some edges, less that with others, seed by seed, the mean of all games.

    Conditions of the study `fit` are known by the name of their edges and by what else they are.
    """
    by_game: dict[tuple[object, ...], dict[str, str]] = {}
    for condition, columns in results.columns.items():
        if results.has(condition, "evaluation"):
            game = tuple(value for key, value in columns.items() if key != "name")
            by_game.setdefault(game, {})[str(columns.get("name"))] = condition
    pairs = [(of[edges], of[less]) for of in by_game.values() if {edges, less} <= of.keys()]
    if not pairs:
        return None
    success_of = shared([results.means(c, "evaluation") for pair in pairs for c in pair])
    own, other = np.mean(success_of[::2], axis=0), np.mean(success_of[1::2], axis=0)
    return Measured(paired_difference(own, other, of_rates=True), len(own)) if len(own) else None


def order_matters(results: Results) -> Measured | None:
    """Measure the order of the chain that differs most from the first, over all intervals.

    Intervals of the differences are simultaneous (Bonferroni); p is that of Friedman's test.
    """
    tests = [test for test in order_tests(results) if test.title == EVALUATED]
    if not tests:
        return None
    first, *others = (results.success(c, "evaluation") for c in results.of_phase("evaluation"))
    level = 1.0 - 0.05 / len(others)
    shifts = [difference(other, first, level) for other in others]
    most = max(shifts, key=lambda e: abs(float(e.value)))
    low, high = min(float(e.low) for e in shifts), max(float(e.high) for e in shifts)
    widest = Estimate(most.value, np.asarray(low), np.asarray(high))
    return Measured(widest, len(first), tests[0].p, f"{1 + len(others)} orders")


def lost_without(results: Results, evaluation: str) -> Measured | None:
    """Measure evaluation success less that of the same weights under other edges.

    Of the conditions in which every agent seeks its own value, as in the paper, all sizes alike.
    """
    other = EVALUATION + evaluation
    cases = [
        condition
        for condition in results.conditions
        if results.columns[condition].get(VALUE_OF) == "own" and results.has(condition, other)
    ]
    if not cases:
        return None
    whole, part = (
        np.hstack(shared([results.by_seed(c, phase) for c in cases]))
        for phase in ("evaluation", other)
    )
    return Measured(difference(whole, part), len(whole), note=f"{len(cases)} sizes")


def _by_size(results: Results) -> tuple[dict[int, list[str]], Sizes]:
    """Return the conditions by number of bodies, and what these are called."""
    counted = (c for c in results.conditions if "robots" in results.numbers(c))
    sizes, by_size = Sizes.of(results, counted), dict[int, list[str]]()
    for condition, number in sizes.counts.items():
        by_size.setdefault(number, []).append(condition)
    return by_size, sizes


def decision_share(results: Results) -> Measured | None:
    """Measure what share of its period a decision takes with most robots, fastest evaluator."""
    by_size, sizes = _by_size(results)
    if not by_size or any("period_s" not in results.numbers(c) for c in results.conditions):
        return None
    most = max(by_size)
    numbers = [results.numbers(condition) for condition in by_size[most]]
    shares = [of["decision_median"] / of["period_s"] for of in numbers]
    fastest = min(shares, key=lambda share: float(share.mean()))
    return Measured(bootstrap(fastest, bounds=NOT_NEGATIVE), len(fastest), note=sizes.shown(most))


def success_by_size(results: Results) -> Measured | None:
    """Measure the success of most robots relative to fewest, each by its best evaluator."""
    every, sizes = _by_size(results)
    by_size = {n: [c for c in own if results.has(c, "evaluation")] for n, own in every.items()}
    if len(by_size) < 2 or not all(by_size.values()):
        return None
    most, fewest = (
        max(
            (results.by_seed(c, "evaluation") for c in by_size[number]),
            key=lambda success: float(success.to_numpy().mean()),
        )
        for number in (max(by_size), min(by_size))
    )
    return _paired(most, fewest, ratio, f"{max(by_size)} against {sizes.shown(min(by_size))}")


def _paired(
    own: BySeed, base: BySeed, estimate: Callable[[Any, Any], Estimate], note: str = ""
) -> Measured | None:
    """Return an estimate from values and those of a reference; None if they share no seed."""
    values = shared([own, base])
    return Measured(estimate(*values), len(values[0]), note=note) if len(values[0]) else None


FAULTS = ("4 wheels, seized", "4 wheels, reversed")
"""The faults that count: feedback alone absorbs the milder ones, and two wheels leave no remedy."""


def recovered(results: Results, adapts: str) -> Measured | None:
    """Measure success at the end relative to before the failure, worst fault."""
    courses = (c for c in courses_of(results) if c.fault in FAULTS and c.adapts == adapts)
    return _worst(Measured(ratio(c.end, c.before), len(c.success), note=c.fault) for c in courses)


def worst_shape(results: Results, condition: str = "") -> Measured | None:
    """Measure the success with the worst shape relative to that with the box trained.

    Of a condition by its label; without, of that by which claims are judged.
    """
    ratios = ratios_of(results, condition or learner_of(results))
    return _worst(Measured(r.estimate, r.seeds, note=r.condition) for r in ratios)


def without_model(results: Results) -> Measured | None:
    """Measure evaluation success where the box is predicted not to move, over the default's."""
    own, base = (results.by_seed(c, "evaluation") for c in ("static predictor", "default"))
    return _paired(own, base, ratio)


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
    return Claim(compute=partial(globals()[compute], **(of or {})), criterion=criterion, **table)


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
        value, low, high = map(float, self.measured.estimate)
        text = f"{value:.2g}, computed"
        if self.measured.seeds:
            text = f"{value:.2f} ({low:.2f} to {high:.2f}), {self.measured.seeds} seeds"
        if self.measured.p is not None:
            text += f", p = {self.measured.p:.2g}"
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

COLOURS = {"holds": "green", "does not hold": "red", "not decided": "yellow"}


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
        _, claim, place, study, measure, criterion, *_ = _record(finding).values()
        cells = claim, place, study, measure, criterion, finding.result, f"**{finding.verdict}**"
        lines.append(f"| {' | '.join(cells)} |")
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
        value, low, high = (v if np.isfinite(v) else None for v in map(float, measured.estimate))
        record |= {"value": value, "low": low, "high": high, "seeds": measured.seeds}
        record |= {"p": measured.p, "note": measured.note}
    return record
