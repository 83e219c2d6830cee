"""What the claims of papers are decided by: a measure for each.

A measure is a function of a study's results and of the arguments that ``claims.toml`` names. It
returns an estimate with its 95% interval over seeds. It returns None, or raises KeyError, where
the results have not what it takes.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from nested_agents import bootstrap, rate
from nested_agents.analysis import (
    EVALUATED,
    NOT_NEGATIVE,
    SUCCESS,
    Array,
    BySeed,
    Estimate,
    Results,
    Sizes,
    courses_of,
    difference,
    paired_difference,
    ratio,
    select_shared,
)
from nested_agents.parts import Problem

from .studies.chain_order import order_tests
from .studies.shapes import ratios_of

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
PAPER_NESTED = 2.45e12
"""Operations of four nested agents, as the paper prints them in Section VII."""
PAPER_SINGLE = 1.1e27
"""The same of one agent for all."""


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
    own = results.by_seed(condition, "training").iloc[:, LAST]
    base = results.by_seed(best, "training").iloc[:, LAST]
    return _paired(own, base, difference, f"against {best}")


def learner_of(results: Results) -> str:
    """Return the condition by which claims are judged."""
    return LEARNER if results.has(LEARNER, "training") else "default"


def sooner_than_planned(results: Results) -> Measured | None:
    """Measure the learner's decisions in an evaluation episode over the planner's, by seed."""
    own = results.means(learner_of(results), "evaluation", "steps")
    base = results.means(PLANNER, "evaluation", "steps")
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
    return _paired(gained[0], gained[1], lambda own, base: bootstrap(own - base, bounds=(-2, 2)))


def cost_error(results: Results) -> Measured:
    """Compute how far the paper's two costs are from its formulas."""
    problem = Problem()
    nested = problem.nested(range(4)) / PAPER_NESTED - 1.0
    single = problem.single_agent(4) / PAPER_SINGLE - 1.0
    return _computed(max(abs(nested), abs(single)))


def tried_beside_joint_action_learners(results: Results) -> Measured:
    """Compute the joint actions that four nested agents try, over those of joint-action learners.

    A joint-action learner considers what all others may do, a nested agent those below it.
    """
    n = 4
    problem = Problem()
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
    success_of = select_shared([results.means(c, "evaluation") for pair in pairs for c in pair])
    own = np.mean(success_of[::2], axis=0)
    other = np.mean(success_of[1::2], axis=0)
    return Measured(paired_difference(own, other, SUCCESS), len(own)) if len(own) else None


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
    low = min(float(e.low) for e in shifts)
    high = max(float(e.high) for e in shifts)
    widest = Estimate(most.value, np.asarray(low), np.asarray(high))
    return Measured(widest, len(first), tests[0].p, f"{1 + len(others)} orders")


def lost_without(results: Results, evaluation: str) -> Measured | None:
    """Measure evaluation success less that of the same weights under other edges.

    Of the conditions in which every agent seeks its own value, as in the paper, all sizes alike.
    """
    other = f"evaluation:{evaluation}"
    cases = [
        condition
        for condition in results.conditions
        if results.columns[condition].get(VALUE_OF) == "own" and results.has(condition, other)
    ]
    if not cases:
        return None
    whole, part = (
        np.hstack(select_shared([results.by_seed(c, phase) for c in cases]))
        for phase in ("evaluation", other)
    )
    return Measured(difference(whole, part), len(whole), note=f"{len(cases)} sizes")


def _by_size(results: Results) -> tuple[dict[int, list[str]], Sizes]:
    """Return the conditions by number of bodies, and what these are called."""
    counted = (c for c in results.conditions if "robots" in results.numbers(c))
    sizes = Sizes.of(results, counted)
    by_size: dict[int, list[str]] = {}
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
    most = max(by_size)
    fewest = min(by_size)
    own = _most_successful(results, by_size[most])
    base = _most_successful(results, by_size[fewest])
    return _paired(own, base, ratio, f"{most} against {sizes.shown(fewest)}")


def _most_successful(results: Results, conditions: Iterable[str]) -> pd.DataFrame:
    """Return the evaluation success by seed of the condition that succeeds most often."""
    success = (results.by_seed(condition, "evaluation") for condition in conditions)
    return max(success, key=lambda own: float(own.to_numpy().mean()))


def _paired(
    own: BySeed, base: BySeed, estimate: Callable[[Array, Array], Estimate], note: str = ""
) -> Measured | None:
    """Return an estimate from values and those of a reference; None if they share no seed."""
    values = select_shared([own, base])
    return Measured(estimate(*values), len(values[0]), note=note) if len(values[0]) else None


FAULTS = ("4 wheels, seized", "4 wheels, reversed")
"""The faults that count: feedback alone absorbs the milder ones, and two wheels leave no remedy."""


def recovered(results: Results, adapts: str) -> Measured | None:
    """Measure success at the end relative to before the failure, worst fault."""
    courses = (c for c in courses_of(results) if c.fault in FAULTS and c.adapts == adapts)
    return _worst(
        Measured(ratio(c.measured.end, c.measured.before), len(c.measured.success), note=c.fault)
        for c in courses
    )


def worst_shape(results: Results, condition: str = "") -> Measured | None:
    """Measure the success with the worst shape relative to that with the box trained.

    Of a condition by its label; without, of that by which claims are judged.
    """
    ratios = ratios_of(results, condition or learner_of(results))
    return _worst(Measured(r.estimate, r.seeds, note=r.condition) for r in ratios)


def without_model(results: Results) -> Measured | None:
    """Measure evaluation success where the box is predicted not to move, over the default's."""
    own = results.by_seed("static predictor", "evaluation")
    return _paired(own, results.by_seed("default", "evaluation"), ratio)


MEASURES: dict[str, Callable[..., Measured | None]] = {
    measure.__name__: measure
    for measure in (
        learned,
        sooner_than_planned,
        success,
        contact_gained,
        cost_error,
        tried_beside_joint_action_learners,
        optimal,
        gained_by_edges,
        order_matters,
        lost_without,
        decision_share,
        success_by_size,
        recovered,
        worst_shape,
        without_model,
    )
}
"""By the name that ``claims.toml`` has."""
