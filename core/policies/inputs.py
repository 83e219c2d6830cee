"""What the networks of peers are fed: states in the ranges of their variables, and scaled rewards.

A variable is mapped so that its range is [-1, 1], and cut at `FARTHEST`; a periodic one becomes
sine and cosine. These are the ranges that membership functions are laid over, so that peers know no
less of the variables than fuzzy agents do.
"""

import numpy as np

from ..interface.scenario import Scenario, groups_of
from ..numerics.arrays import FloatArray

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
        self._low = np.array([v.low for v in space.variables])
        self._span = np.array([v.high - v.low for v in space.variables])
        self._periodic = np.array([v.periodic for v in space.variables])
        # Which variable each input is of: all of them, then the cosines of the periodic.
        self._columns = np.append(np.arange(space.n_variables), np.flatnonzero(self._periodic))
        self._groups, self._n_own = groups_of(scenario), space.n_own
        n = len(scenario.agents)
        self._names = np.eye(n) if numbered else np.zeros((n, 0))
        of_own = int((self._columns < space.n_own).sum())
        of_shared = len(self._columns) - of_own
        self.n_own = len(self._columns) + self._names.shape[1]
        self.n_joint = n * of_own + len(self._groups) * of_shared

    def each(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(n, n_own)`` of every agent: its state, and which one it is."""
        return np.hstack([self._scaled(states), self._names])

    def joint(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(n_joint,)`` of all: what agents of a group share stands once."""
        scaled, own = self._scaled(states), self._columns < self._n_own
        parts = [scaled[:, own].ravel()]
        parts += [scaled[group[0], ~own] for group in self._groups]
        return np.concatenate(parts)

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
