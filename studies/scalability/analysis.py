"""Analysis of scalability: which hierarchy, how many agents, at which cost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations
from typing import NamedTuple, TypeVar

import numpy as np

from ..laws.inference import sign_change
from ..laws.universal import MIN_SIZES, Speedup, UniversalLaw, fit_universal_law, speedups
from ..results.analysis import Summary
from ..results.notation import format_estimate, format_number
from ..results.statistics import NOT_NEGATIVE, Estimate, bootstrap
from .data import COSTS, DECISIONS, Place, ScalabilityData, paired
from .fronts import (
    BudgetChoice,
    FrontPoint,
    are_greatest,
    best_within,
    pareto_points,
    parse_budget,
    probability_of_best,
)

T = TypeVar("T")
LIKELY = 0.5
"""Probability above which a sentence names a best size or a member of a front."""
MAX_NAMED = 4
"""Most hierarchies that the paragraph describes one by one."""
BEST_NAMED = 3
"""Number of hierarchies that it describes if there are more: the best at the largest size."""


class Crossover(NamedTuple):
    """A size from which on one hierarchy beats another."""

    better: str
    worse: str
    size: Estimate


class BestHierarchies(NamedTuple):
    """The hierarchy, or the hierarchies, with the best mean performance at the largest size."""

    size: float
    hierarchies: tuple[str, ...]
    probability: float
    """Probability over seeds that one of them is the best of all measured at this size."""


class BestSize(NamedTuple):
    """The measured size with the best mean performance of one hierarchy."""

    size: float
    probability: float
    """Probability over seeds that it is the best of the measured sizes."""


@dataclass(frozen=True)
class Scalability:
    """Speed-up, laws, crossovers, Pareto fronts and the best hierarchy within a budget."""

    data: ScalabilityData
    budget: str = ""
    """Limits of costs, such as ``messages <= 50``; empty for no budget."""

    @cached_property
    def speedups(self) -> Mapping[str, Mapping[float, Speedup]]:
        """Speed-up of the task by hierarchy and size, where times of paired seeds are known."""
        return {
            name: speedups(times)
            for name in self.data.hierarchies
            if (times := self.data.times_of(name)) is not None
        }

    @cached_property
    def laws(self) -> Mapping[str, UniversalLaw]:
        """Universal scalability law by hierarchy, where there are enough sizes."""
        times = {name: self.data.times_of(name) for name in self.data.hierarchies}
        return {
            name: fit_universal_law(own)
            for name, own in times.items()
            if own is not None and len(own.sizes) >= MIN_SIZES
        }

    @cached_property
    def best(self) -> BestHierarchies | None:
        """The best at the largest size; None without two hierarchies and two seeds there."""
        size = self.data.all_sizes[-1]
        names, (values,) = self.data.paired_at(size, [])
        if len(names) < 2 or len(values) < 2:
            return None
        shares = probability_of_best(list(self.data.sign * values.T))
        means = self.data.sign * values.mean(axis=0)
        best = np.flatnonzero(are_greatest(means)).tolist()
        return BestHierarchies(size, tuple(names[k] for k in best), float(shares[best].sum()))

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
    def best_sizes(self) -> Mapping[str, BestSize]:
        """Best measured size by hierarchy."""
        best = {}
        for name in self.data.hierarchies:
            sizes = self.data.sizes(name)
            values = paired([self.data.performances[name, n] for n in sizes])
            if len(values) > 1:
                shares = probability_of_best(list(self.data.sign * values.T))
                k = int((self.data.sign * values.mean(axis=0)).argmax())
                best[name] = BestSize(sizes[k], float(shares[k]))
        return best

    @cached_property
    def crossovers(self) -> tuple[Crossover, ...]:
        """Sizes from which on one hierarchy beats another, of all pairs."""
        changes = []
        for better, worse in permutations(self.data.hierarchies, 2):
            sizes = [n for n in self.data.sizes(better) if n in self.data.sizes(worse)]
            columns = [self.data.performances[name, n] for name in (better, worse) for n in sizes]
            values = paired(columns)
            if len(sizes) < 2 or len(values) < 2:
                continue
            differences = self.data.sign * (values[:, : len(sizes)] - values[:, len(sizes) :])
            size = sign_change(sizes, differences)
            if size is not None:
                changes.append(Crossover(better, worse, size))
        return tuple(changes)

    @cached_property
    def fronts(self) -> tuple[FrontPoint, ...]:
        """Every hierarchy at every size with every cost, and whether it is on the Pareto front."""
        return tuple(pareto_points(self.data))

    @cached_property
    def choices(self) -> tuple[BudgetChoice, ...]:
        """Best hierarchy within the budget by size; empty without a budget."""
        return tuple(best_within(self.data, parse_budget(self.budget))) if self.budget else ()

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
                own = self.speedups.get(name, {}).get(size)
                if own is not None:
                    estimates["speed-up"] = own.speedup
                    estimates["efficiency"] = own.efficiency
                    if own.serial_fraction is not None:
                        estimates["serial fraction"] = own.serial_fraction
                for cost, known in self.cost_estimates.items():
                    if place in known:
                        estimates[COSTS[cost].heading] = known[place]
                seeds = len(self.data.performances[place])
                lines.append(Summary(f"{name}, {size:g} {self.data.size}", seeds, estimates))
        return tuple(lines)

    @property
    def law_summaries(self) -> tuple[Summary, ...]:
        """A line for every hierarchy with a universal scalability law."""
        lines = []
        for name, law in self.laws.items():
            estimates = {"contention": law.contention, "coherency": law.coherency}
            best = law.best_size_within(self.data.sizes(name)[-1])
            if best is not None:
                estimates[f"best number of {self.data.size}"] = best
            seeds = len(self.data.performances[name, self.data.sizes(name)[0]])
            lines.append(Summary(name, seeds, estimates))
        return tuple(lines)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The findings as sentences, which make one paragraph."""
        return tuple(self._sentences())

    @property
    def paragraph(self) -> str:
        """The findings as one paragraph."""
        return " ".join(self.sentences)

    def _sentences(self) -> Iterator[str]:
        data = self.data
        sizes = data.all_sizes
        growth = "grows with the team" if data.scaling == "weak" else "is the same for all sizes"
        title = data.performance_title
        yield (
            f"{title[0].upper()}{title[1:]} was measured with {sizes[0]:g} to {sizes[-1]:g} "
            f"{data.size}; the task {growth} ({data.scaling} scaling)."
        )
        yield from self._best_sentences()
        yield from self._size_sentences()
        yield from self._crossover_sentences()
        yield from self._criterion_sentences()
        yield from self._front_sentences()
        yield from self._budget_sentences()

    def _best_sentences(self) -> Iterator[str]:
        """Yield which hierarchy is the best, and which hierarchies other sentences name."""
        data = self.data
        best = self.best
        if best is not None:
            names = best.hierarchies
            mean = format_estimate(data.performance_estimates[names[0], best.size])
            has = f"{names[0]} has" if len(names) == 1 else f"{len(names)} hierarchies share"
            yield (
                f"With {best.size:g} {data.size}, {has} the best mean of the "
                f"{len(data.at_size(best.size))} measured, {mean}, with probability "
                f"{format_number(best.probability)} over seeds."
            )
        if self.named != data.hierarchies:
            yield (
                f"The next sentences name the {len(self.named)} best hierarchies with "
                f"{data.all_sizes[-1]:g} {data.size}; the tables have all."
            )

    def _size_sentences(self) -> Iterator[str]:
        size = self.data.size
        efficiencies: dict[float, list[str]] = {}
        for name, own in self._of_named(self.speedups):
            text = f"{format_estimate(own[max(own)].efficiency)} for {name}"
            efficiencies.setdefault(max(own), []).append(text)
        for largest, texts in efficiencies.items():
            yield f"With {largest:g} {size}, the efficiency is {_join(texts)}."
        places: dict[str, list[str]] = {}
        for name, law in self._of_named(self.laws):
            largest = self.data.sizes(name)[-1]
            places.setdefault(_place(law, largest, size), []).append(name)
        for place, names in places.items():
            yield f"For {_join(names)}, {place}."
        likely = [
            f"{best.size:g} for {name} (probability {format_number(best.probability)})"
            for name, best in self._of_named(self.best_sizes)
            if best.probability > LIKELY
        ]
        if likely:
            yield f"Performance is best with this number of {size}: {_join(likely)}."

    def _of_named(self, items: Mapping[str, T]) -> list[tuple[str, T]]:
        return [(name, item) for name, item in items.items() if name in self.named]

    def _crossover_sentences(self) -> Iterator[str]:
        data = self.data
        if len(data.hierarchies) < 2:
            yield "There is one hierarchy, so that nothing can cross over."
            return
        known = [c for c in self.crossovers if c.better in self.named and c.worse in self.named]
        for better, worse, size in known:
            yield f"From {format_estimate(size)} {data.size} on, {better} beats {worse}."
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
        fronts: dict[str, list[str]] = {}
        for cost in dict.fromkeys(point.cost for point in self.fronts):
            members = [
                f"{p.hierarchy} ({format_number(p.probability)})"
                for p in self.fronts
                if p.cost == cost and p.size == largest and p.probability > LIKELY
            ]
            heading = COSTS[cost].heading.partition(" [")[0]
            fronts.setdefault(_join(members), []).append(heading)
        for members_text, costs in fronts.items():
            if members_text:
                yield (
                    f"With {largest:g} {self.data.size}, on the Pareto front of performance "
                    f"against {_join(costs)} (with the probability over seeds): {members_text}."
                )

    def _budget_sentences(self) -> Iterator[str]:
        for choice in self.choices:
            where = f"Within {self.budget}, with {choice.size:g} {self.data.size}"
            if choice.unknown:
                yield (
                    f"With {choice.size:g} {self.data.size}, a cost of {_join(choice.unknown)} is "
                    "not known."
                )
            if choice.hierarchy is None:
                yield f"{where}, there is no {'other ' * bool(choice.unknown)}hierarchy."
            elif len(choice.allowed) == 1:
                yield f"{where}, there is only {choice.hierarchy}."
            else:
                yield (
                    f"{where}, {choice.hierarchy} is the best of {_join(choice.allowed)} with "
                    f"probability {format_number(choice.probability)}."
                )

    def to_dict(self) -> dict[str, object]:
        """Return everything as tables and lists, see `plain`."""
        return {
            "size": self.data.size,
            "scaling": self.data.scaling,
            "performance": self.data.performance_title,
            "rows": [line._asdict() for line in self.summaries],
            "laws": {name: self._law_to_dict(name, law) for name, law in self.laws.items()},
            "best": self.best._asdict() if self.best else None,
            "best_sizes": {name: own._asdict() for name, own in self.best_sizes.items()},
            "crossovers": [crossover._asdict() for crossover in self.crossovers],
            "fronts": [point._asdict() for point in self.fronts],
            "budget": [choice._asdict() for choice in self.choices],
            "paragraph": self.paragraph,
        }

    def _law_to_dict(self, hierarchy: str, law: UniversalLaw) -> dict[str, object]:
        largest = self.data.sizes(hierarchy)[-1]
        return {
            "contention": law.contention,
            "coherency": law.coherency,
            "describes_times": law.is_plausible,
            "best_size": law.best_size_within(largest),
            "sentence": _place(law, largest, self.data.size),
        }


def _place(law: UniversalLaw, largest: float, size: str) -> str:
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
            f"the team of maximum throughput has more than {math.floor(low)} {size}, and may be "
            "larger than those measured"
        )
    if math.isinf(high):
        return (
            f"the throughput is at its maximum with {math.floor(low)} {size} or more; these seeds "
            "give no upper bound"
        )
    return f"the throughput is at its maximum with {format_estimate(law.best_size)} {size}"


def _join(names: Sequence[str]) -> str:
    """Return names as a list in a sentence.

    >>> _join(["a"]), _join(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    *first, last = names or [""]
    return f"{', '.join(first)} and {last}" if first else last
