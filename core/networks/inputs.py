"""What networks are fed: states in the ranges of their variables, and scaled rewards.

A variable is mapped so that its range is [-1, 1], and cut at `FARTHEST`; a periodic one becomes
sine and cosine. These are the ranges that membership functions are laid over, so that networks know
no less of the variables than fuzzy agents do.
"""

from collections.abc import Mapping

import numpy as np

from ..interface.agents import Memory
from ..interface.scenario import Scenario
from ..numerics import AnyArray, FloatArray

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
    own_names, joint_names
        What each of them is, in words: inputs of one name mean the same in other worlds.

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
        self._identities = np.eye(n) if numbered else np.zeros((n, 0))
        self.n_own = len(self._columns) + self._identities.shape[1]
        self.n_joint = int(n * self._own.sum() + len(self._firsts) * (~self._own).sum())
        variables = [space.variables[column].name for column in self._columns]
        kinds = ["value"] * space.n_variables + ["cosine"] * int(self._periodic.sum())
        inputs = [f"{name} {kind}" for name, kind in zip(variables, kinds, strict=True)]
        identities = [f"is {agent}" for agent in scenario.agents] if numbered else []
        self.own_names = [*inputs, *identities]
        firsts = [scenario.agents[first] for first in self._firsts]
        of_agents = [name for name, own in zip(inputs, self._own, strict=True) if own]
        of_groups = [name for name, own in zip(inputs, self._own, strict=True) if not own]
        self.joint_names = [
            *(f"{agent}: {name}" for agent in scenario.agents for name in of_agents),
            *(f"{first}: {name}" for first in firsts for name in of_groups),
        ]

    def each(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(..., n, n_own)`` of every agent: its state, and which one it is."""
        scaled = self._scaled(states)
        identities = np.broadcast_to(
            self._identities, (*scaled.shape[:-1], len(self._identities.T))
        )
        return np.concatenate([scaled, identities], axis=-1)

    def joint(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(..., n_joint)`` of all: what agents of a group share stands once."""
        scaled = self._scaled(states)
        lead = scaled.shape[:-2]
        of_agents = scaled[..., self._own].reshape(*lead, -1)
        of_groups = scaled[..., self._firsts, :][..., ~self._own].reshape(*lead, -1)
        return np.concatenate([of_agents, of_groups], axis=-1)

    def _scaled(self, states: FloatArray) -> FloatArray:
        place = (states - self._low) / self._span
        linear = np.clip(2.0 * place - 1.0, -FARTHEST, FARTHEST)
        angles = 2.0 * np.pi * place[..., self._periodic]
        columns = np.where(self._periodic, np.sin(2.0 * np.pi * place), linear)
        return np.concatenate([columns, np.cos(angles)], axis=-1)


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
        self._discount = discount
        self._returns: FloatArray = np.zeros(n)
        self._count = 1e-4
        self._mean = 0.0
        self._squares = 1e-4

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
        """Begin the return anew."""
        self._returns[:] = 0.0

    def memory(self) -> Memory:
        """Return what it remembers."""
        return {
            "returns": self._returns,
            "moments": np.array([self._count, self._mean, self._squares]),
        }

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned, or from that of other agents between episodes."""
        if memory["returns"].shape == self._returns.shape:
            self._returns = memory["returns"].copy()
        self._count, self._mean, self._squares = memory["moments"].tolist()
