"""Costs of the decisions of a team, summed over its parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..interface.agents import AnyAgents, ReportsCosts
from ..interface.measures import Measure
from ..numerics import IntArray

MESSAGES = Measure("messages", "messages", gathering="sum", better="lower", least=0.0)
"""Number of received messages, a measure of teams that send payloads."""


def total_costs(
    parts: Sequence[AnyAgents],
    inputs: Sequence[object],
    joint_action: IntArray,
    measures: Sequence[Measure],
    n_received: int,
) -> Mapping[str, float]:
    """Return the costs of a decision by the names of `measures`, see `join_costs`."""
    total = {measure.name: 0.0 for measure in measures}
    if MESSAGES.name in total:
        total[MESSAGES.name] = float(n_received)
    for part, own in zip(parts, inputs, strict=True):
        if isinstance(part, ReportsCosts):
            for name, value in part.decision_costs(own, joint_action).items():
                total[name] += value
    return total


def join_costs(parts: Sequence[AnyAgents], *, counts_messages: bool) -> tuple[Measure, ...]:
    """Return the measures of the costs of all parts, each once.

    Parameters
    ----------
    parts
        The agents, one part for each kind.
    counts_messages
        Whether the number of received messages is a cost.

    Raises
    ------
    ValueError
        If two parts report one cost in different units; one line.
    """
    measures = [MESSAGES] if counts_messages else []
    for part in parts:
        measures += part.costs if isinstance(part, ReportsCosts) else ()
    by_name: dict[str, Measure] = {}
    for measure in measures:
        known = by_name.setdefault(measure.name, measure)
        if known != measure:
            raise ValueError(
                f"learner.costs.{measure.name} = {measure.unit!r}: another part of the team gives "
                f"it in {known.unit!r}"
            )
    return tuple(by_name.values())
