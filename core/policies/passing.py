"""The passing down of actions, as inputs of a policy: whose turn it is, and who is then told.

It is the turn of all agents at once who are told by those of turns before alone, and act by the
same weights. What an agent is told is one entry for every action of every agent that anybody is
told by, in agent order: 1 for an action of somebody who tells it, else 0.
"""

from typing import NamedTuple

import numpy as np

from ..interface.hierarchy import Hierarchy
from ..numerics.arrays import FloatArray, IntArray


class Turn(NamedTuple):
    """Agents that decide at once, and their messages, one after the other."""

    weights: int
    """Number of the weights that they act by."""
    agents: slice | IntArray
    """Who they are; a slice if they are consecutive, by which arrays are not copied."""
    tells: IntArray
    """``(k,)`` who tells something."""
    told: IntArray
    """``(k,)`` who is told."""
    columns: IntArray
    """``(k,)`` the entry of the first action of the one who tells."""


class Passing:
    """What agents are told, turn by turn.

    Parameters
    ----------
    hierarchy
        Who is told by whom.
    n_actions
        Actions of every agent.
    rows
        ``(n,)`` numbers of the weights that they act by.

    Attributes
    ----------
    turns
        From the top down.
    width
        Number of entries that an agent is told.

    Examples
    --------
    >>> star = Hierarchy("abc", [("a", "b"), ("a", "c")])
    >>> passing = Passing(star, n_actions=2, rows=np.zeros(3, dtype=int))
    >>> [turn.agents for turn in passing.turns], passing.width
    ([slice(0, 1, None), slice(1, 3, None)], 2)
    >>> told = np.zeros((3, passing.width))
    >>> passing.tell(passing.turns[0], np.array([1, 0, 0]), told)
    >>> told.tolist()
    [[0.0, 0.0], [0.0, 1.0], [0.0, 1.0]]
    """

    def __init__(self, hierarchy: Hierarchy, n_actions: int, rows: IntArray) -> None:
        depths: dict[int, int] = {}
        for agent in hierarchy.order:
            depths[agent] = 1 + max((depths[other] for other in hierarchy.above(agent)), default=-1)
        heard = sorted({tells for agent in depths for tells in hierarchy.above(agent)})
        self.width = len(heard) * n_actions
        self.turns = []
        places = {agent: (depths[agent], int(rows[agent])) for agent in sorted(depths)}
        for place in sorted(set(places.values())):
            agents = np.array([agent for agent in places if places[agent] == place])
            sent = [(j, i) for i in places for j in hierarchy.above(i) if places[j] == place]
            tells, told = np.array(sent, dtype=np.int64).reshape(-1, 2).T
            columns = np.searchsorted(heard, tells) * n_actions
            first, last = int(agents[0]), int(agents[-1])
            is_whole = last - first + 1 == len(agents)
            block = slice(first, last + 1) if is_whole else agents
            self.turns.append(Turn(place[1], block, tells, told, columns))

    @staticmethod
    def tell(turn: Turn, joint_action: IntArray, told: FloatArray) -> None:
        """Write what the agents have decided in a turn into what all are told ``(n, width)``."""
        told[turn.told, turn.columns + joint_action[turn.tells]] = 1.0
