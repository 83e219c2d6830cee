"""Analysis of losses: what they cost by position and number, and whether a team tolerates them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from math import comb

from ...core.hierarchy.hierarchy import Hierarchy
from ...core.interface.measures import Measure
from ...core.numerics import pd
from ..results.analysis import Summary, mean_estimate, verdicts
from ..results.differences import (
    Difference,
    Pair,
    difference_of_estimates,
    differences,
    paired_difference,
)
from ..results.notation import format_estimate, format_number
from ..results.permutation_tests import LEVEL
from ..results.results import row_means
from ..results.statistics import Estimate, differ_equally
from .losses import Position, positions

HALF = 0.5
"""Share of the intact performance at which the number of losses stops growing."""
VERDICTS = {
    "yes": "the team tolerates any single loss",
    "no": "the team does not tolerate every single loss",
    "undecided": "it is undecided whether the team tolerates any single loss",
}
"""Verdicts of `Resilience.verdict` in words."""


@dataclass
class TeamLosses:
    """Performance of the teams of one condition, intact and with losses."""

    condition: str
    hierarchy: Hierarchy
    units: tuple[str, ...]
    """Agents or actuators that can be lost."""
    agents: tuple[int, ...]
    """Index of the agent of each unit."""
    intact: pd.DataFrame
    """Performance by seed and episode."""
    lost: dict[tuple[int, ...], pd.DataFrame] = field(default_factory=dict)
    """The same by the indices of the lost units."""

    @property
    def positions(self) -> tuple[Position, ...]:
        """Position of the agent of each unit in the hierarchy."""
        of_agents = positions(self.hierarchy)
        return tuple(of_agents[agent] for agent in self.agents)

    @property
    def intact_mean(self) -> float:
        """Mean performance of intact teams."""
        return float(row_means(self.intact).mean())

    @property
    def by_number(self) -> Mapping[int, Sequence[tuple[int, ...]]]:
        """The evaluated sets by the number of lost units."""
        return {n: list(sets) for n, sets in groupby(sorted(self.lost, key=len), key=len)}

    def joined(self, sets: Sequence[tuple[int, ...]]) -> pd.DataFrame:
        """Return the performance with any of some losses by seed and episode."""
        return pd.concat([self.lost[units] for units in sets], axis=1, ignore_index=True)

    @property
    def halving(self) -> int | None:
        """Number of lost units with which performance is at most half; None if not reached."""
        for n, sets in self.by_number.items():
            if float(row_means(self.joined(sets)).mean()) <= HALF * self.intact_mean:
                return n
        return None

    @property
    def loss(self) -> pd.Series:
        """Mean loss of performance after any single failure, by seed."""
        lost = row_means(self.joined(self.by_number[1]))
        return row_means(self.intact)[lost.index] - lost

    def name(self, units: Sequence[int]) -> str:
        """Return the names of lost units."""
        return ", ".join(self.units[i] for i in units)


@dataclass(frozen=True)
class Resilience:
    """Costs of losses in the teams of a study."""

    fault: str
    measure: Measure
    title: str
    """Title of the measure."""
    tolerance: float
    """Share of the intact performance that a tolerated loss may cost."""
    teams: tuple[TeamLosses, ...]
    left_out: tuple[str, ...] = ()
    """Conditions with an intact performance of 0 or below, of which losses say nothing."""

    @cached_property
    def single(self) -> Mapping[str, tuple[Difference, ...]]:
        """Change of performance by each single loss, by condition and in the order of units.

        p is adjusted over all of them.
        """
        groups: dict[str, list[Pair]] = {}
        for own in self.teams:
            singles = own.by_number.get(1, ())
            base = row_means(own.intact)
            groups[own.condition] = [
                (own.name(units), self.title, row_means(own.lost[units]), base) for units in singles
            ]
        return differences(groups, self.measure)

    def verdict(self, own: TeamLosses) -> str:
        """Return whether teams tolerate any single loss: yes, no, or undecided.

        They do if the interval of every loss lies above the margin, which needs no adjustment for
        several losses. They do not if that of any loss lies below it and its adjusted p is
        significant.
        """
        margin = -self.tolerance * own.intact_mean
        single = self.single[own.condition]
        if single and all(float(d.estimate.low) > margin for d in single):
            return "yes"
        if any(float(d.estimate.high) < margin and d.p < LEVEL for d in single):
            return "no"
        return "undecided"

    def worst(self, own: TeamLosses) -> Difference | None:
        """Return the single loss that costs most; None if there are fewer than two seeds.

        If the verdict is undecided, it is the loss whose interval reaches farthest down.
        """
        undecided = self.verdict(own) == "undecided"
        return min(
            self.single[own.condition],
            key=lambda d: float(d.estimate.low if undecided else d.estimate.value),
            default=None,
        )

    @property
    def loss_measure(self) -> Measure:
        """Measure of `TeamLosses.loss`."""
        least, greatest = self.measure.bounds
        return replace(
            self.measure,
            name="loss",
            title=f"loss in {self.measure.title} after any single failure",
            better="lower",
            is_rate=False,
            least=least - greatest,
            greatest=greatest - least,
        )

    @cached_property
    def comparison(self) -> tuple[Difference, ...]:
        """Differences of each condition from the first in the loss after any single failure.

        Teams are paired by seed. p is adjusted over all conditions. If all seeds differ equally,
        the interval combines those of the two changes (Zou and Donner 2008), because a bootstrap
        interval would have no width.
        """
        first, *others = (own for own in self.teams if 1 in own.by_number)
        title = self.loss_measure.title
        pairs: list[Pair] = [(own.condition, title, own.loss, first.loss) for own in others]
        (compared,) = differences({"": pairs}, self.loss_measure).values()
        changes = {
            own.condition: self._change(own, own.joined(own.by_number[1]))
            for own in (first, *others)
        }
        return tuple(
            d
            if not d.paired or not differ_equally(*d.values)
            else replace(
                d, estimate=difference_of_estimates(changes[first.condition], changes[d.condition])
            )
            for d in compared
        )

    @property
    def comparison_lines(self) -> list[str]:
        """Comparison of the conditions in words; empty if there is nothing to compare."""
        head = f"{self.loss_measure.heading}, minus that of {self.teams[0].condition}"
        return verdicts({head: self.comparison}, self.loss_measure, "loss")

    @cached_property
    def summaries(self) -> tuple[Summary, ...]:
        """Lines of the table: intact teams, single losses by position, and more losses."""
        return tuple(line for own in self.teams for line in self._lines(own))

    def _lines(self, own: TeamLosses) -> Iterator[Summary]:
        estimates = {self.title: mean_estimate(self.measure, own.intact)}
        yield Summary(f"{own.condition}, intact", len(own.intact), estimates)
        positions = own.positions
        for n, sets in own.by_number.items():
            of = comb(len(own.units), n)
            count = f"{len(sets)} sets" if len(sets) == of else f"{len(sets)} of {of} sets"
            if n > 1:
                yield self._line(own, f"{n} lost, {count}", sets)
                continue
            for position in dict.fromkeys(positions):
                part = [units for units in sets if positions[units[0]] == position]
                yield self._line(own, f"1 lost, {position} ({len(part)})", part)

    def _line(self, own: TeamLosses, label: str, sets: Sequence[tuple[int, ...]]) -> Summary:
        lost = own.joined(sets)
        estimates = {
            self.title: mean_estimate(self.measure, lost),
            "change": self._change(own, lost),
        }
        return Summary(f"{own.condition}, {label}", len(lost), estimates)

    def _change(self, own: TeamLosses, lost: pd.DataFrame) -> Estimate:
        with_losses, intact = row_means(lost), row_means(own.intact)
        return paired_difference(
            with_losses.to_numpy(), intact[with_losses.index].to_numpy(), self.measure
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """The findings, two sentences for each condition."""
        return tuple(sentence for own in self.teams for sentence in self._sentences(own))

    def _sentences(self, own: TeamLosses) -> Iterator[str]:
        worst = self.worst(own)
        if worst is None:
            yield f"{own.condition}: one seed has no interval, so that nothing can be said."
            return
        place = own.positions[own.units.index(worst.condition)]
        verdict = self.verdict(own)
        kind = "least certain" if verdict == "undecided" else "worst"
        yield (
            f"{own.condition}: {VERDICTS[verdict]}. The {kind} "
            f"is that of {worst.condition} ({place}), which changes {self.title} by "
            f"{format_estimate(worst.estimate, signed=True)}."
        )
        n = len(own.units)
        halving = own.halving
        if halving is None:
            largest = max(own.by_number)
            yield f"Performance does not halve with up to {largest} of {n} lost."
        else:
            value = format_estimate(mean_estimate(self.measure, own.joined(own.by_number[halving])))
            yield (
                f"With {halving} of {n} lost, {self.title} is at most half of its intact value: "
                f"{value}."
            )

    @property
    def legend(self) -> tuple[str, ...]:
        """Sentences on what was lost, what counts as tolerated, and what was left out."""
        share = format_number(100.0 * self.tolerance)
        text = (
            f"Fault: {self.fault}, from the first step on; teams are not trained again. A loss is "
            f"tolerated if it costs at most {share}% of the intact performance. Changes are paired "
            "by seed, on the same initial states."
        )
        return (text, self.remark) if self.remark else (text,)

    @property
    def remark(self) -> str:
        """Sentence that names the conditions that were left out; empty if there are none."""
        if not self.left_out:
            return ""
        return (
            f"Left out, because {self.title} of their intact teams is 0 or below: "
            f"{'; '.join(self.left_out)}."
        )

    def to_dict(self) -> dict[str, object]:
        """Return everything as tables and lists, see `plain`."""
        return {
            "fault": self.fault,
            "measure": self.measure.name,
            "tolerance": self.tolerance,
            "teams": [self._team_to_dict(own) for own in self.teams],
            "left_out": self.left_out,
            "comparison": [
                {
                    "condition": d.condition,
                    "reference": self.teams[0].condition,
                    "seeds": d.seeds,
                    "paired": d.paired,
                    "difference_in_loss": d.estimate,
                    "p": d.p,
                }
                for d in self.comparison
            ],
            "sentences": self.sentences,
        }

    def _team_to_dict(self, own: TeamLosses) -> dict[str, object]:
        positions = dict(zip(own.units, own.positions, strict=True))
        return {
            "condition": own.condition,
            "seeds": len(own.intact),
            "intact": mean_estimate(self.measure, own.intact),
            "tolerates_any_single_loss": self.verdict(own),
            "halving": own.halving,
            "single": [
                {
                    "lost": d.condition,
                    "position": positions[d.condition],
                    "change": d.estimate,
                    "p": d.p,
                }
                for d in self.single[own.condition]
            ],
            "numbers": [
                {"n_lost": n, "sets": len(sets), "change": self._change(own, own.joined(sets))}
                for n, sets in own.by_number.items()
            ],
        }
