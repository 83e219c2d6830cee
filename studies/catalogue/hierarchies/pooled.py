"""Hierarchies over all settings at once: success, decisions to the goal, and if they are equal.

What is compared is as in the single settings; of every seed it is the mean over settings, so that a
small difference that is the same everywhere is found. Success saturates near 1, and decisions to
the goal do not: both count alike. That a difference is not significant does not make it none:
hierarchies are *equal* if the whole interval lies within a margin, `MARGIN` of success and `SLOWER`
of decisions, which were named before the comparisons that rest on them (two one-sided tests at
0.025, Schuirmann 1987).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ....core.numerics import pd
from ...results.analysis import select_shared
from ...results.notation import format_estimate, format_number, format_p, wrapped
from ...results.results import Results
from ...results.statistics import LEVEL, Array, Estimate, bootstrap, paired_tests
from .cases import HierarchyCase

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
    results: Results, cases: Sequence[HierarchyCase], reference: str
) -> dict[str, tuple[Effect, Effect]]:
    """Return by hierarchy its effects on success and on decisions, over all settings.

    Hierarchies of which fewer than two seeds are shared with the reference are left out; all, if
    nothing is a success.
    """
    if not results.main.is_rate:
        return {}
    bases = {case.setting: case for case in cases if case.hierarchy == reference}
    compared: dict[str, list[HierarchyCase]] = {}
    for case in cases:
        if case.setting in bases and case.hierarchy != reference:
            compared.setdefault(case.hierarchy, []).append(case)
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


def _success(results: Results, case: HierarchyCase) -> pd.Series:
    return results.means(case.condition, case.phase)


def _decisions(results: Results, case: HierarchyCase) -> pd.Series:
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
