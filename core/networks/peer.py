"""What all peers are to the control loop, and what their networks are fed.

That is states in the ranges of their variables, and scaled rewards. A variable is mapped so that
its range is [-1, 1], and cut at `FARTHEST`; a periodic one becomes sine and cosine. These are the
ranges that membership functions are laid over, so that peers know no less of the variables than
fuzzy agents do.

Actions are passed down as inputs, too: turn by turn, and then others are told. It is the turn of
all agents at once who are told by those of turns before alone, and act by the same weights. What an
agent is told is one entry for every action of every agent that anybody is told by, in agent order:
1 for an action of somebody who tells it, else 0.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..interface.scenario import Actors, Scenario
from ..numerics import FloatArray, IntArray


@dataclass(frozen=True)
class Seen:
    """The present states, and what could follow, for those who ask."""

    present: FloatArray
    """``(n, d)`` states of all agents."""
    scenario: Scenario
    """Where they are."""

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` as the scenario predicts them."""
        return cast(Any, self.scenario).predict().states(agent, joint_actions)


class Peer(Actors):
    """A learner that acts for all agents by what it sees; inherit it, and add what it learns.

    Without more it predicts, refuses, revises and learns nothing.

    Parameters
    ----------
    seed
        Source of everything random in it.
    """

    def __init__(self, seed: np.random.SeedSequence) -> None:
        self.rng = np.random.Generator(np.random.PCG64(seed))

    def predict(self, scenario: Scenario, states: FloatArray) -> Seen:
        """Return the present states: nothing is predicted unless asked, and it costs nothing."""
        return Seen(states, scenario)

    def arrays(self) -> dict[str, FloatArray]:
        """Return what has been learned, if anything."""
        return {}


FARTHEST = 3.0
"""Where inputs are cut, in half ranges."""


class Inputs:
    """Turns states into inputs.

    Parameters
    ----------
    scenario
        Whose states.
    numbered
        Whether the inputs of an agent say which one it is.

    Attributes
    ----------
    n_own, n_joint
        Number of inputs of one agent, and of all together.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> inputs = Inputs(LineUpSettings(carts=2).build())
    >>> inputs.n_own, inputs.n_joint
    (4, 4)
    """

    def __init__(self, scenario: Scenario, *, numbered: bool = True) -> None:
        space = scenario.state_space
        self._low, self._span = space.ranges
        self._periodic = np.array([v.periodic for v in space.variables])
        # Which variable each input is of: all of them, then the cosines of the periodic.
        self._columns = np.append(np.arange(space.n_variables), np.flatnonzero(self._periodic))
        self._own = self._columns < space.n_own
        self._firsts = [group[0] for group in scenario.groups]
        n = len(scenario.agents)
        self._names = np.eye(n) if numbered else np.zeros((n, 0))
        self.n_own = len(self._columns) + self._names.shape[1]
        self.n_joint = int(n * self._own.sum() + len(self._firsts) * (~self._own).sum())

    def each(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(n, n_own)`` of every agent: its state, and which one it is."""
        return np.hstack([self._scaled(states), self._names])

    def joint(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(n_joint,)`` of all: what agents of a group share stands once."""
        scaled, own = self._scaled(states), self._own
        return np.concatenate([scaled[:, own].ravel(), scaled[self._firsts][:, ~own].ravel()])

    def _scaled(self, states: FloatArray) -> FloatArray:
        place = (states - self._low) / self._span
        linear = np.clip(2.0 * place - 1.0, -FARTHEST, FARTHEST)
        angles = 2.0 * np.pi * place[:, self._periodic]
        columns = np.where(self._periodic, np.sin(2.0 * np.pi * place), linear)
        return np.hstack([columns, np.cos(angles)])


class RewardScale:
    """Divides rewards by the standard deviation of the discounted return so far.

    Parameters
    ----------
    discount
        Of the return.
    n
        Number of rewards at every step.
    """

    def __init__(self, discount: float, n: int) -> None:
        self._discount, self._returns = discount, np.zeros(n)
        self._count, self._mean, self._squares = 1e-4, 0.0, 1e-4

    def scaled(self, rewards: FloatArray) -> FloatArray:
        """Take in the rewards ``(n,)`` of a step, and return them scaled, cut at 10."""
        self._returns = self._discount * self._returns + rewards
        for value in self._returns:  # Welford's recursion
            self._count += 1.0
            before = value - self._mean
            self._mean += before / self._count
            self._squares += before * (value - self._mean)
        return np.clip(rewards / np.sqrt(self._squares / self._count), -10.0, 10.0)

    def end_episode(self) -> None:
        """Begin anew."""
        self._returns[:] = 0.0


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
