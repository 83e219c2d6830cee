"""Analysis of scalability: which hierarchy, how many agents, at what cost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import TypeVar

from ...core.numerics import pd
from ..laws.universal import MIN_SIZES, UniversalLaw, fit_universal_law, speedups
from ..results.analysis import Summary
from ..results.notation import format_estimate, format_number
from ..results.sizes import with_name
from ..results.statistics import NOT_NEGATIVE, Estimate, bootstrap
from . import fronts
from .data import DECISIONS, HEADINGS, Place, ScalabilityData

T = TypeVar("T")
LIKELY = 0.5
"""Probability above which a sentence names a best size or a member of a front."""
MAX_NAMED = 4
"""Most hierarchies that the paragraph describes one by one."""
BEST_NAMED = 3
"""Number of hierarchies that it describes if there are more: the best at the largest size."""

GROWTH = {
    "strong": "is the same for all sizes (strong scaling)",
    "weak": "grows with the team (weak scaling)",
    None: "grows, but not in proportion to the team",
}
"""How the task depends on the team, in words."""


@dataclass(frozen=True, repr=False)
class Scalability:
    """Speed-up, laws, crossovers, Pareto fronts and the best hierarchy within a budget."""

    data: ScalabilityData
    budget: str = ""
    """Limits of costs, such as ``messages <= 50``; empty for no budget."""

    @cached_property
    def times(self) -> Mapping[str, pd.DataFrame]:
        """Times of the task by hierarchy, where times of paired seeds are known."""
        times = {name: self.data.times_of(name) for name in self.data.hierarchies}
        return {name: own for name, own in times.items() if own is not None}

    @cached_property
    def speedups(self) -> Mapping[str, Mapping[float, Mapping[str, Estimate]]]:
        """Speed-up, efficiency and serial fraction by hierarchy and size.

        There are none if the task grows, but not in proportion to the team.
        """
        scaling = self.data.scaling
        return {name: speedups(own, scaling) for name, own in self.times.items() if scaling}

    @cached_property
    def universal_laws(self) -> Mapping[str, UniversalLaw]:
        """Universal scalability law by hierarchy, where there are enough sizes."""
        scaling = self.data.scaling
        return {
            name: fit_universal_law(own, scaling)
            for name, own in self.times.items()
            if scaling and own.shape[1] >= MIN_SIZES
        }

    @cached_property
    def best(self) -> tuple[tuple[str, ...], float] | None:
        """The best hierarchies at the largest size, and how probable it is that they are."""
        return fronts.best_hierarchies(self.data)

    @cached_property
    def named(self) -> tuple[str, ...]:
        """The hierarchies that the paragraph describes, see `MAX_NAMED`."""
        data = self.data
        if len(data.hierarchies) <= MAX_NAMED:
            return data.hierarchies
        size = data.all_sizes[-1]
        means = {name: data.performances[name, size].mean() for name in data.at_size(size)}
        ranked = sorted(means, key=lambda name: -data.sign * means[name])
        return tuple(name for name in data.hierarchies if name in ranked[:BEST_NAMED])

    @cached_property
    def best_sizes(self) -> Mapping[str, tuple[float, float]]:
        """Best measured size by hierarchy, and how probable it is that it is the best."""
        return fronts.best_sizes(self.data)

    @cached_property
    def crossovers(self) -> Sequence[tuple[str, str, Estimate]]:
        """Better and worse hierarchy, and the size from which on the one beats the other."""
        return fronts.crossovers(self.data)

    @cached_property
    def fronts(self) -> pd.DataFrame:
        """Every hierarchy at every size with every cost, and whether it is on the Pareto front."""
        return fronts.pareto_points(self.data)

    @cached_property
    def choices(self) -> pd.DataFrame:
        """Best hierarchy within the budget by size; empty without a budget."""
        limits = fronts.parse_budget(self.budget) if self.budget else {}
        return fronts.best_within(self.data, limits) if limits else pd.DataFrame()

    @cached_property
    def cost_estimates(self) -> Mapping[str, Mapping[Place, Estimate]]:
        """Mean of every cost with its interval by hierarchy and size."""
        return {
            cost: {
                place: bootstrap(values.dropna(), bounds=NOT_NEGATIVE)
                for place, values in cells.items()
            }
            for cost, cells in self.data.costs.items()
        }

    @cached_property
    def summaries(self) -> tuple[Summary, ...]:
        """A line of the table for every hierarchy at every size."""
        lines = []
        for name in self.data.hierarchies:
            for size in self.data.sizes(name):
                place = name, size
                estimates = {self.data.performance_title: self.data.performance_estimates[place]}
                estimates |= self.speedups.get(name, {}).get(size, {})
                for cost, known in self.cost_estimates.items():
                    estimates |= {HEADINGS[cost]: known[place]} if place in known else {}
                seeds = len(self.data.performances[place])
                lines.append(
                    Summary(f"{name}, {with_name(size, self.data.size)}", seeds, estimates)
                )
        return tuple(lines)

    @property
    def paragraph(self) -> str:
        """The findings as one paragraph."""
        return " ".join(self._sentences())

    def _sentences(self) -> Iterator[str]:
        data = self.data
        sizes = data.all_sizes
        title = data.performance_title
        yield (
            f"{title[0].upper()}{title[1:]} was measured with {sizes[0]:g} to {sizes[-1]:g} "
            f"{data.size}; the task {GROWTH[data.scaling]}."
        )
        if len({frozenset(own.index) for own in data.performances.values()}) > 1:
            yield "Not all teams have the same seeds; they are compared on those that they share."
        yield from self._best_sentences()
        yield from self._size_sentences()
        yield from self._crossover_sentences()
        yield from self._criterion_sentences()
        yield from self._front_sentences()
        yield from self._budget_sentences()

    def _best_sentences(self) -> Iterator[str]:
        """Yield which hierarchy is the best, and which hierarchies other sentences name."""
        data = self.data
        largest = data.all_sizes[-1]
        if self.best is not None:
            names, probability = self.best
            mean = self._mean_of(names[0], largest)
            has = f"{names[0]} has" if len(names) == 1 else f"{len(names)} hierarchies share"
            yield (
                f"With {largest:g} {data.size}, {has} the best mean of the "
                f"{len(data.at_size(largest))} measured, {mean}, with probability "
                f"{format_number(probability)} over seeds."
            )
        if self.named != data.hierarchies:
            yield (
                f"The next sentences name the {len(self.named)} best hierarchies with "
                f"{largest:g} {data.size}; the tables have all."
            )

    def _mean_of(self, hierarchy: str, size: float) -> str:
        """Return the performance at a size, of the seeds that all hierarchies there share."""
        data = self.data
        names, (values,) = data.paired_at(size, [])
        if all(len(data.performances[name, size]) == len(values) for name in names):
            return format_estimate(data.performance_estimates[hierarchy, size])
        mean = format_number(values[:, names.index(hierarchy)].mean())
        return f"{mean} over the {len(values)} seeds that all have"

    def _size_sentences(self) -> Iterator[str]:
        size = self.data.size
        efficiencies: dict[float, list[str]] = {}
        for name, own in self._of_named(self.speedups):
            text = f"{format_estimate(own[max(own)]['efficiency'])} for {name}"
            efficiencies.setdefault(max(own), []).append(text)
        for largest, texts in efficiencies.items():
            yield f"With {largest:g} {size}, the efficiency is {_join(texts)}."
        places: dict[str, list[str]] = {}
        for name, law in self._of_named(self.universal_laws):
            place = place_of_maximum(law, self.data.sizes(name)[-1], size)
            places.setdefault(place, []).append(name)
        for place, names in places.items():
            yield f"For {_join(names)}, {place}."
        likely = [
            f"{with_name(best, size)} for {name} (probability {format_number(probability)})"
            for name, (best, probability) in self._of_named(self.best_sizes)
            if probability > LIKELY
        ]
        if likely:
            title = self.data.performance_title
            yield f"{title[0].upper()}{title[1:]} is best with {_join(likely)}."

    def _of_named(self, items: Mapping[str, T]) -> list[tuple[str, T]]:
        return [(name, item) for name, item in items.items() if name in self.named]

    def _crossover_sentences(self) -> Iterator[str]:
        data = self.data
        if len(data.hierarchies) < 2:
            yield "There is one hierarchy, so that nothing can cross over."
            return
        known = [own for own in self.crossovers if {*own[:2]} <= {*self.named}]
        for better, worse, size in known:
            yield f"From {format_estimate(size)} {data.size} on, {better} beats {worse}."
        if known:
            yield "These intervals are Student's over seeds, not adjusted for several pairs."
        pairs = [*combinations(self.named, 2)]
        apart = [p for p in pairs if not fronts.can_cross(fronts.differences_by_size(data, *p))]
        if apart:
            names = "; ".join(f"{one} and {two}" for one, two in apart)
            yield f"No crossover can be found without two sizes and seeds that both have: {names}."
        if len(apart) == len(pairs):
            return
        other = "other " if known else ""
        between = " between them" if self.named != data.hierarchies else ""
        largest = f"{data.all_sizes[-1]:g} {data.size}"
        yield f"There is no {other}crossover{between} up to {largest}."

    def _criterion_sentences(self) -> Iterator[str]:
        if self.data.has_criterion:
            reached = self.data.costs.get(DECISIONS, {})
            missing = [
                f"{name}, {n:g}" for name, n in self.data.performances if (name, n) not in reached
            ]
            if missing:
                yield f"Not all seeds reach the criterion: {'; '.join(missing)} {self.data.size}."

    def _front_sentences(self) -> Iterator[str]:
        largest = self.data.all_sizes[-1]
        points = self.fronts[self.fronts["size"] == largest]
        fronts: dict[str, list[str]] = {}
        for cost, own in points[points["probability"] > LIKELY].groupby("cost", sort=False):
            members = [f"{p.hierarchy} ({format_number(p.probability)})" for p in own.itertuples()]
            heading = HEADINGS[cost].partition(" [")[0]
            fronts.setdefault(_join(members), []).append(heading)
        for members_text, costs in fronts.items():
            yield (
                f"With {largest:g} {self.data.size}, on the Pareto front of performance "
                f"against {_join(costs)} (with the probability over seeds): {members_text}."
            )

    def _budget_sentences(self) -> Iterator[str]:
        for choice in self.choices.itertuples():
            with_size = with_name(choice.size, self.data.size)
            where = f"Within {self.budget}, with {with_size}"
            if choice.unknown:
                yield f"With {with_size}, a cost of {_join(choice.unknown)} is not known."
            if choice.hierarchy is None:
                yield f"{where}, there is no {'other ' * bool(choice.unknown)}hierarchy."
            elif len(choice.allowed) == 1:
                yield f"{where}, there is only {choice.hierarchy}."
            else:
                yield (
                    f"{where}, {choice.hierarchy} is the best of {_join(choice.allowed)} with "
                    f"probability {format_number(choice.probability)}."
                )


def place_of_maximum(law: UniversalLaw, largest: float, size: str) -> str:
    """Return where the throughput of a law has its maximum, in words."""
    value, low, high = map(float, law.best_size)
    if not law.is_plausible:
        return "the universal scalability law does not describe these times"
    if (value > largest or math.isinf(high)) and low <= 1.0:
        return "no best team size can be determined from these seeds"
    if low >= largest:
        return (
            "the team of maximum throughput is not within the sizes measured: more than "
            f"{largest:g} {size}"
        )
    if value > largest:
        return (
            f"the team of maximum throughput has more than {with_name(math.floor(low), size)}, "
            "and may be larger than those measured"
        )
    if math.isinf(high):
        return (
            f"the throughput is greatest with at least {with_name(math.floor(low), size)}; the "
            "seeds do not say with how many"
        )
    return f"the throughput is at its maximum with {format_estimate(law.best_size)} {size}"


def _join(names: Sequence[str]) -> str:
    """Return names as a list in a sentence.

    >>> _join(["a"]), _join(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    *first, last = names or [""]
    return f"{', '.join(first)} and {last}" if first else last
