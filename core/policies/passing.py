"""The passing down of actions, as inputs of a policy: who decides at once, and who is then told.

Agents of one *level* are told by those of the levels before alone, so they decide at once. What an
agent is told is one entry for every action of every agent that anybody is told by, in agent order:
1 for an action of somebody who tells it, else 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..interface.hierarchy import Hierarchy
from ..numerics.arrays import FloatArray, IntArray


class Level(NamedTuple):
    """Agents that decide at once, and their messages, one after the other."""

    agents: IntArray
    """Who they are."""
    tells: IntArray
    """``(k,)`` who tells something."""
    told: IntArray
    """``(k,)`` who is told."""
    columns: IntArray
    """``(k,)`` the entry of the first action of the one who tells."""


class Passing:
    """What agents are told, level by level.

    Parameters
    ----------
    hierarchy
        Who is told by whom.
    n_actions
        Actions of every agent.

    Attributes
    ----------
    levels
        From the top down.
    width
        Number of entries that an agent is told.

    Examples
    --------
    >>> passing = Passing(Hierarchy("abc", [("a", "b"), ("a", "c")]), n_actions=2)
    >>> [level.agents.tolist() for level in passing.levels], passing.width
    ([[0], [1, 2]], 2)
    >>> told = np.zeros((3, passing.width))
    >>> passing.tell(passing.levels[0], np.array([1, 0, 0]), told)
    >>> told.tolist()
    [[0.0, 0.0], [0.0, 1.0], [0.0, 1.0]]
    """

    def __init__(self, hierarchy: Hierarchy, n_actions: int) -> None:
        depths: dict[int, int] = {}
        for agent in hierarchy.order:
            depths[agent] = 1 + max((depths[other] for other in hierarchy.above(agent)), default=-1)
        messages = [(j, i) for i in range(len(hierarchy)) for j in hierarchy.above(i)]
        heard = sorted({tells for tells, _ in messages})
        self.width = len(heard) * n_actions
        self.levels = []
        for depth in range(1 + max(depths.values())):
            agents = [i for i in sorted(depths) if depths[i] == depth]
            sent = [(tells, told) for tells, told in messages if tells in agents]
            columns = [heard.index(tells) * n_actions for tells, _ in sent]
            parts = agents, [tells for tells, _ in sent], [told for _, told in sent], columns
            self.levels.append(Level(*(np.array(part, dtype=np.int64) for part in parts)))

    @staticmethod
    def tell(level: Level, joint_action: IntArray, told: FloatArray) -> None:
        """Write what the agents of a level have decided into what all are told ``(n, width)``."""
        told[level.told, level.columns + joint_action[level.tells]] = 1.0
