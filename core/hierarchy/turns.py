"""Turns: in which order agents decide, and who is told whose action before."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..numerics import IntArray
from .hierarchy import Hierarchy


class Turn(NamedTuple):
    """Agents who decide now, and what they have been told.

    A message is the action of an agent that has decided before; those that arrive in this turn are
    listed one after the other.
    """

    agents: IntArray
    """``(k,)`` who decide."""
    receivers: IntArray
    """``(m,)`` of every message, who is told."""
    senders: IntArray
    """``(m,)`` whose action it is."""
    actions: IntArray
    """``(m,)`` the action."""
    contents: tuple[object, ...] = ()
    """``(m,)`` what is said beside it; empty: nobody says more."""


class Slot(NamedTuple):
    """Agents of one part of a team who decide at the same time."""

    part: int
    """Which part."""
    agents: IntArray
    """``(k,)`` who they are."""
    receivers: IntArray
    """``(m,)`` of every message that they get if none fails, who gets it."""
    senders: IntArray
    """``(m,)`` whose action it tells."""


def slots_of(
    hierarchy: Hierarchy, part_of: Sequence[int], at_once: Sequence[bool]
) -> tuple[Slot, ...]:
    """Return the slots of a decision, first to last.

    Where all parts decide at once, agents who are told by equally long lines of others are one
    slot. Otherwise the order of the hierarchy holds, and agents in a row are one slot if their part
    decides at once and none is told of another.

    Parameters
    ----------
    hierarchy
        Who decides before whom, and who is told by whom.
    part_of
        ``(n,)`` the part of every agent.
    at_once
        By part, whether its agents decide together.

    Examples
    --------
    >>> star = Hierarchy("abc", [("a", "b"), ("a", "c")])
    >>> [slot.agents.tolist() for slot in slots_of(star, [0, 0, 0], [True])]
    [[0], [1, 2]]
    >>> [slot.agents.tolist() for slot in slots_of(star, [0, 0, 0], [False])]
    [[0], [1], [2]]
    """
    groups = _levels(hierarchy, part_of) if all(at_once) else _runs(hierarchy, part_of, at_once)
    return tuple(_slot(hierarchy, part_of[agents[0]], agents) for agents in groups)


def all_hear_all(hierarchy: Hierarchy) -> bool:
    """Return whether everybody is told all that was decided before, and considers all others."""
    return all(
        len(hierarchy.senders(agent)) == place and not hierarchy.unseen(agent)
        for place, agent in enumerate(hierarchy.order)
    )


def levels_of(hierarchy: Hierarchy) -> list[int]:
    """Return the level of every agent ``(n,)``: 0 if nobody tells it anything.

    Those who are told are one level below the lowest of those who tell them.
    """
    levels: dict[int, int] = {}
    for agent in hierarchy.order:
        above = [levels[other] for other in hierarchy.senders(agent)]
        levels[agent] = 1 + max(above, default=-1)
    return [levels[agent] for agent in range(len(hierarchy))]


def _levels(hierarchy: Hierarchy, part_of: Sequence[int]) -> list[list[int]]:
    levels: dict[tuple[int, int], list[int]] = {}
    for agent, level in enumerate(levels_of(hierarchy)):
        levels.setdefault((level, part_of[agent]), []).append(agent)
    return [levels[place] for place in sorted(levels)]


def _runs(hierarchy: Hierarchy, part_of: Sequence[int], at_once: Sequence[bool]) -> list[list[int]]:
    runs: list[list[int]] = []
    for agent in hierarchy.order:
        part = part_of[agent]
        last = runs[-1] if runs else []
        joins = at_once[part] and bool(last) and part_of[last[0]] == part
        if joins and not set(last) & set(hierarchy.senders(agent)):
            last.append(agent)
        else:
            runs.append([agent])
    return runs


def _slot(hierarchy: Hierarchy, part: int, agents: list[int]) -> Slot:
    above = [hierarchy.senders(agent) for agent in agents]
    receivers = np.repeat(np.array(agents, dtype=np.int64), [len(senders) for senders in above])
    senders = np.array([j for senders in above for j in senders], dtype=np.int64)
    return Slot(part, np.array(agents, dtype=np.int64), receivers, senders)
