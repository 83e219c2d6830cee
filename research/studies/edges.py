"""The edges study: what the edges of a hierarchy do, without training anew.

A team is trained in its condition's hierarchy, and then acts greedily, with the same weights and on
the same worlds, as every entry of ``[evaluations]`` has it: agents that are told nothing, that
consider nobody, that expect something else of the unseen, whose messages are lost. So the weights
are the same; but a team that acts under relations which it was not trained under meets situations
that it has not learned in, and a part of each difference is this shift of distribution.

For each condition of training, every evaluation is compared with that under the hierarchy of
training by evaluation success, as in the study `hierarchies`; and over all conditions by success
and decisions to the goal, equal measures of one question.

Over all settings, each seed counts by its mean over settings, so that a small difference that is
the same everywhere is found. Success saturates near 1, and decisions to the goal do not: both count
alike. Hierarchies are *equal* if the whole interval lies within a margin, `MARGIN` of success and
`SLOWER` of decisions, which were named before the comparisons that rest on them (two one-sided
tests at 0.025, Schuirmann 1987).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from nested_agents import Analysis, Session, Spec, Study
from nested_agents.analysis import (
    EVALUATED,
    LEVEL,
    Array,
    Estimate,
    Figures,
    Results,
    SizedCase,
    Sizes,
    bootstrap,
    distinct,
    format_estimate,
    format_number,
    format_p,
    label_but,
    paired_tests,
    select_shared,
    wrapped,
)
from nested_agents.analysis import compare_hierarchies as analysis_of
from nested_agents.analysis import estimates_of_hierarchy as estimates
from nested_agents.study import (
    StepRecord,
    Trial,
    TrialResult,
    check_evaluated,
    check_evaluations,
    check_rule_bases,
)

PUBLISHED = ("success", "agreement")
"""Measures of an episode that published results keep."""
TRAINED = "as trained"
"""How the hierarchy of training is called among the others."""
PARTED = (("neither", "considered only"), ("told only", TRAINED))
"""Names of evaluations by telling (rows) and considering (columns): told x considered."""


def check(spec: Spec) -> None:
    """Raise `SpecError` unless trained teams are evaluated under other hierarchies."""
    check_evaluated(spec)
    check_rule_bases(spec, "who consider others and are told")
    check_evaluations(spec, 'silent.topology.communication = "none"')


def measure(trial: Trial) -> TrialResult:
    """Train a team, let it act under all hierarchies; imported by name in workers."""
    session = Session(trial)
    session.train(trial.episodes)
    deciding: dict[str, list[float]] = {n: [] for n in (TRAINED, *dict(trial.evaluations))}

    def note(name: str, record: StepRecord) -> None:
        deciding[name].append(record.deciding)

    session.evaluate(partial(note, TRAINED))
    session.run_other_evaluations({name: partial(note, name) for name in deciding})
    numbers = {"robots": float(len(session.world.groups))}
    for name, settings in ((TRAINED, trial.settings), *trial.evaluations):
        numbers[f"messages.{name}"] = float(settings.arrange(session.world)[1].n_messages)
    usage = {f"decision.{name}": float(np.median(d)) for name, d in deciding.items()}
    return session.result(numbers, usage)


def analyse(results: Results) -> Analysis:
    """Estimate and compare; 95% intervals, seeds as the unit of sampling."""
    sizes = Sizes.of(results, results.of_phase("evaluation"))
    cases = []
    for condition, robots in sizes.counts.items():
        numbers = results.numbers(condition)
        value_of = label_but(results.columns.get(condition, {}), sizes.keys)
        for name, phase in ({TRAINED: "evaluation"} | results.other_evaluations(condition)).items():
            deciding = numbers[f"decision.{name}"]
            values = estimates(results, condition, phase, deciding, numbers[f"messages.{name}"])
            cases.append(SizedCase(condition, name, value_of, robots, sizes, values, phase))
    analysis = analysis_of(results, cases, TRAINED)
    pooled = lines_of(effects(results, cases, TRAINED), TRAINED)
    return replace(analysis, notes=(*analysis.notes, *pooled))


def draw(analysis: Analysis) -> Figures:
    """Return told x considered, if that is asked; and all differences from training.

    The second figure has a panel for each setting, if there are enough seeds to compare.
    """
    from nested_agents.figures import draw_forest

    names = {case.name for case in analysis.cases if EVALUATED in case.values}
    figures = _draw_parted(analysis) if {*sum(PARTED, ())} <= names else {}
    unit = f"difference from {TRAINED}" if not names else f"success minus that {TRAINED}"
    return figures | draw_forest("differences", analysis.differences, unit)


def _draw_parted(analysis: Analysis) -> Figures:
    """Draw success by telling and considering: four fields of a color for each setting."""
    from nested_agents import figures

    cases = sorted(analysis.cases, key=lambda case: (case.group, case.robots))
    by_name = {(case.setting, case.name): case.values[EVALUATED] for case in cases}
    settings = distinct(case.setting for case in cases)
    sizes = len({case.robots for case in cases})
    figure, panels = figures.grid(
        len(settings), sizes if sizes > 1 else 4, (1.9, 1.75), (0.9, 0.5), sharex=True, sharey=True
    )
    for axes, setting in zip(panels.flat, settings, strict=False):
        fields = np.array([[by_name[setting, name] for name in row] for row in PARTED], dtype=float)
        axes.imshow(fields[..., 0], "Blues", vmin=0, vmax=1)
        for row, column in np.ndindex(2, 2):
            name = PARTED[row][column]
            value, _, interval = format_estimate(by_name[setting, name]).partition(" ")
            color = "white" if fields[row, column, 0] > 0.5 else "black"
            write = partial(axes.text, column, ha="center", color=color)
            write(row, value, va="bottom", fontsize=15)
            write(row + 0.08, interval, va="top", fontsize=7)
        axes.set_title(setting, loc="left")
        axes.set_xticks((0, 1), ("without\nlookahead", "with\nlookahead"))
        axes.set_yticks((0, 1), ("without\nmessages", "with\nmessages"))
        axes.tick_params(length=0, labelsize=7.5)
        axes.spines[:].set_visible(False)
    figure.suptitle("evaluation success of the same weights, 95% intervals", fontsize=9)
    return {"edges": figure}


MARGIN = 0.05
"""Of success: differences within it are none that matter."""
SLOWER = 0.1
"""Share of the decisions to the goal, likewise."""


class Effect(NamedTuple):
    """What a hierarchy does to one measure, beside the reference."""

    hierarchy: str
    """Its label."""
    settings: int
    """In how many settings it is compared."""
    sample: Array
    """Of each seed the mean over settings: difference of success, or log ratio of decisions."""
    estimate: Estimate
    """Difference of success, or how many times the decisions it takes."""
    p: float
    """By permutation of signs over seeds, adjusted over all that are compared together (Holm)."""
    is_ratio: bool
    """Whether it is one of decisions."""

    @property
    def verdict(self) -> str:
        """Whether the two are equal but for the margin, differ, or cannot be decided about."""
        least, greatest = (1 / (1 + SLOWER), 1 + SLOWER) if self.is_ratio else (-MARGIN, MARGIN)
        if self.estimate.low >= least and self.estimate.high <= greatest:
            return "equal"
        return "different" if self.p < LEVEL else "not decided"

    @property
    def shown(self) -> str:
        """Estimate, interval, p and verdict, as text."""
        what = "decisions x" if self.is_ratio else "success "
        shown = format_estimate(self.estimate, signed=not self.is_ratio)
        return f"{what}{shown}, p {format_p(self.p)}: {self.verdict}"


def effects(
    results: Results, cases: Sequence[SizedCase], reference: str
) -> dict[str, tuple[Effect, Effect]]:
    """Return by hierarchy its effects on success and on decisions, over all settings.

    Hierarchies of which fewer than two seeds are shared with the reference are left out; all, if
    nothing is a success.
    """
    if not results.main.is_rate:
        return {}
    bases = {case.setting: case for case in cases if case.name == reference}
    compared: dict[str, list[SizedCase]] = {}
    for case in cases:
        if case.setting in bases and case.name != reference:
            compared.setdefault(case.name, []).append(case)
    samples: list[tuple[str, int, Array]] = []
    for hierarchy, own in compared.items():
        for of_seeds in (_success, _decisions):
            pairs = [(of_seeds(results, c), of_seeds(results, bases[c.setting])) for c in own]
            less = [pd.Series(a - b).dropna() for a, b in pairs]
            sample = np.mean(select_shared(less), axis=0)
            samples.append((hierarchy, len(own), sample))
    kept = {h for h, _, _ in samples} - {h for h, _, sample in samples if len(sample) < 2}
    samples = [one for one in samples if one[0] in kept]
    tests = paired_tests([(sample, np.zeros_like(sample)) for _, _, sample in samples])
    by_hierarchy: dict[str, list[Effect]] = {}
    for (hierarchy, settings, sample), (_, p) in zip(samples, tests, strict=True):
        own_effects = by_hierarchy.setdefault(hierarchy, [])
        is_ratio = bool(own_effects)
        estimate = bootstrap(sample)
        if is_ratio:
            estimate = Estimate(*map(np.exp, estimate))
        own_effects.append(Effect(hierarchy, settings, sample, estimate, p, is_ratio))
    return {hierarchy: (both[0], both[1]) for hierarchy, both in by_hierarchy.items()}


def _success(results: Results, case: SizedCase) -> pd.Series:
    return results.means(case.condition, case.phase)


def _decisions(results: Results, case: SizedCase) -> pd.Series:
    """Return the logarithm of the mean decisions of successful episodes, where there are any."""
    success = results.success(case.condition, case.phase)
    steps = results.values(case.condition, "steps", case.phase)
    reached = success.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        decisions = np.log((success * steps).sum(axis=1) / reached)
    return pd.Series(np.where(reached > 0, decisions, np.nan), _success(results, case).index)


def lines_of(compared: Mapping[str, tuple[Effect, Effect]], reference: str) -> Iterator[str]:
    """Yield what comes out over all settings, line by line."""
    if not compared:
        return
    head = (
        f"All settings together, seed by seed, beside {reference}; equal: the interval lies within "
        f"{format_number(MARGIN)} of success, {SLOWER:.0%} of decisions to the goal:"
    )
    yield from wrapped(head)
    for hierarchy, both in compared.items():
        settings = f"{both[0].settings} setting{'s' * (both[0].settings > 1)}"
        yield from wrapped(f"{hierarchy} ({settings}): {both[0].shown}; {both[1].shown}", "  ")


class EdgesStudy(Study):
    """Compares relations of a hierarchy under the same weights."""

    PUBLISHED = PUBLISHED
    check = staticmethod(check)
    measure = staticmethod(measure)
    analyse = staticmethod(analyse)
    draw = staticmethod(draw)
