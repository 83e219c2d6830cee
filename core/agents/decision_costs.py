"""Costs of the decisions of a team, summed over its parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..interface.agents import AnyAgents, ReportsCosts
from ..interface.measures import Measure
from ..numerics import IntArray

MESSAGES = Measure("messages", "messages", gathering="sum", better="lower", least=0.0)
"""Number of received messages, a measure of teams that send payloads."""


class DecisionCosts:
    """Costs of the decisions of all parts.

    Parameters
    ----------
    parts
        The agents, one part for each kind.
    counts_messages
        Whether the number of received messages is a cost.

    Attributes
    ----------
    measures
        Measures of the costs.

    Raises
    ------
    ValueError
        If two parts report one cost in different units; one line.
    """

    def __init__(self, parts: Sequence[AnyAgents], *, counts_messages: bool) -> None:
        self._parts = {k: p for k, p in enumerate(parts) if isinstance(p, ReportsCosts)}
        sent = [MESSAGES] if counts_messages else []
        own = [measure for part in self._parts.values() for measure in part.costs]
        self.measures = join_costs([*sent, *own])

    def total(
        self, inputs: Sequence[object], joint_action: IntArray, n_received: int
    ) -> Mapping[str, float]:
        """Return the costs of a decision by the names of `measures`."""
        total = {measure.name: 0.0 for measure in self.measures}
        if MESSAGES.name in total:
            total[MESSAGES.name] = float(n_received)
        for k, part in self._parts.items():
            for name, value in part.decision_costs(inputs[k], joint_action).items():
                total[name] += value
        return total


def join_costs(measures: Sequence[Measure]) -> tuple[Measure, ...]:
    """Return the measures of the costs of all parts, each once.

    Raises
    ------
    ValueError
        If two parts report one cost in different units; one line.
    """
    by_name: dict[str, Measure] = {}
    for measure in measures:
        known = by_name.setdefault(measure.name, measure)
        if known != measure:
            raise ValueError(
                f"learner.costs.{measure.name} = {measure.unit!r}: another part of the team gives "
                f"it in {known.unit!r}"
            )
    return tuple(by_name.values())
