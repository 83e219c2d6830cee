"""Stages of a joint decision, and the messages that agents receive in them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..numerics import IntArray
from .hierarchy import Hierarchy


class Inbox(NamedTuple):
    """Messages that the agents of a stage receive, one after the other."""

    agents: IntArray
    """``(k,)`` agents that decide now."""
    receivers: IntArray
    """``(m,)`` receiver of every message."""
    senders: IntArray
    """``(m,)`` sender of every message."""
    actions: IntArray
    """``(m,)`` action of the sender, as received; ``(E, m)`` in many environments."""
    payloads: tuple[object, ...] = ()
    """``(m,)`` payload of every message; empty if the agents receive actions only."""


class DecisionStage(NamedTuple):
    """Agents of one part of a team that decide at the same time."""

    part: int
    """Index of the part."""
    agents: IntArray
    """``(k,)`` agents that decide."""
    receivers: IntArray
    """``(m,)`` receivers of all messages of the stage, if none fails."""
    senders: IntArray
    """``(m,)`` their senders."""


def decision_stages(
    hierarchy: Hierarchy, part_of: Sequence[int], acts_in_parallel: Sequence[bool]
) -> tuple[DecisionStage, ...]:
    """Return the stages of a joint decision, first to last.

    If all parts act in parallel, agents on one communication level form a stage. Otherwise the
    order of the hierarchy holds. Consecutive agents of a part that acts in parallel then form a
    stage if none of them receives an action from another.

    Parameters
    ----------
    hierarchy
        Order of decisions and communication.
    part_of
        ``(n,)`` index of the part of every agent.
    acts_in_parallel
        Whether the agents of a part decide together, by part.

    Examples
    --------
    >>> star = Hierarchy("abc", [("a", "b"), ("a", "c")])
    >>> [stage.agents.tolist() for stage in decision_stages(star, [0, 0, 0], [True])]
    [[0], [1, 2]]
    >>> [stage.agents.tolist() for stage in decision_stages(star, [0, 0, 0], [False])]
    [[0], [1], [2]]
    """
    if all(acts_in_parallel):
        levels: dict[tuple[int, int], list[int]] = {}
        for agent, level in enumerate(communication_levels(hierarchy)):
            levels.setdefault((level, part_of[agent]), []).append(agent)
        groups = [levels[key] for key in sorted(levels)]
    else:
        groups = []
        for agent in hierarchy.order:
            previous = groups[-1] if groups else []
            is_same_part = {part_of[i] for i in previous} == {part_of[agent]}
            is_independent = not set(previous) & set(hierarchy.senders(agent))
            if acts_in_parallel[part_of[agent]] and is_same_part and is_independent:
                previous.append(agent)
            else:
                groups.append([agent])
    return tuple(_stage(hierarchy, part_of[agents[0]], agents) for agents in groups)


def communication_levels(hierarchy: Hierarchy) -> list[int]:
    """Return the level of every agent ``(n,)``: 0 without senders, else below all its senders."""
    levels: dict[int, int] = {}
    for agent in hierarchy.order:
        levels[agent] = 1 + max((levels[i] for i in hierarchy.senders(agent)), default=-1)
    return [levels[agent] for agent in range(len(hierarchy))]


def is_fully_communicating(hierarchy: Hierarchy) -> bool:
    """Return whether every agent receives all earlier actions and searches over all later ones."""
    return all(
        len(hierarchy.senders(agent)) == position and not hierarchy.unseen(agent)
        for position, agent in enumerate(hierarchy.order)
    )


def _stage(hierarchy: Hierarchy, part: int, agents: list[int]) -> DecisionStage:
    receivers = [agent for agent in agents for _ in hierarchy.senders(agent)]
    senders = [sender for agent in agents for sender in hierarchy.senders(agent)]
    arrays = (np.array(indices, dtype=np.int64) for indices in (agents, receivers, senders))
    return DecisionStage(part, *arrays)
