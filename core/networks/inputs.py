"""Encoding of states as inputs of networks.

The range of every variable is scaled to [-1, 1] and clipped at `MAX_INPUT`; a periodic variable
becomes a sine and a cosine. Membership functions of rule bases cover the same ranges.
"""

import numpy as np

from ..interface.scenario import Scenario
from ..numerics import FloatArray, IntArray

MAX_INPUT = 3.0
"""Bound of scaled variables, in half ranges."""


class InputEncoder:
    """Encoder of states.

    Parameters
    ----------
    scenario
        Scenario of the states.
    numbered
        Whether the inputs of an agent contain its number, one-hot.
    joins
        Whether there are joint inputs.

    Attributes
    ----------
    own_names, joint_names
        Names of the inputs of one agent, and of all agents together. Equal names mean the same
        quantity in all scenarios.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> encoder = InputEncoder(LineUpSettings(carts=2).build())
    >>> own = encoder.own(np.array([[0.0, 1.0], [2.0, 9.0]]))
    >>> own.shape, encoder.joint(own).shape
    ((2, 4), (4,))
    """

    def __init__(self, scenario: Scenario, *, numbered: bool = True, joins: bool = True) -> None:
        space = scenario.state_space
        n_agents = len(scenario.agents)
        self._low, self._span = space.ranges
        self._periodic: IntArray = np.flatnonzero([v.periodic for v in space.variables])
        self._n_variables = space.n_variables
        self._identities = np.eye(n_agents, n_agents if numbered else 0, dtype=np.float32)
        variables = [v.name for v in space.variables]
        names = [f"{name} value" for name in variables]
        names += [f"{variables[column]} cosine" for column in self._periodic]
        identities = [f"is {agent}" for agent in scenario.agents] if numbered else []
        self.own_names = [*names, *identities]
        # Agents of a group share their last variables, which are joint inputs once.
        columns = np.append(np.arange(space.n_variables), self._periodic)
        firsts = [group[0] for group in scenario.groups]
        entries = [(i, k) for i in range(n_agents) for k in np.flatnonzero(columns < space.n_own)]
        entries += [(i, k) for i in firsts for k in np.flatnonzero(columns >= space.n_own)]
        entries = entries if joins else []
        self.joint_names = [f"{scenario.agents[i]}: {names[k]}" for i, k in entries]
        self._joint: IntArray = np.array([i * len(self.own_names) + k for i, k in entries], int)

    def own(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(..., n, len(own_names))`` of agents in states ``(..., n, d)``."""
        n = self._n_variables
        inputs = np.empty((*states.shape[:-1], len(self.own_names)), np.float32)
        position = (states - self._low) / self._span
        np.clip(2.0 * position - 1.0, -MAX_INPUT, MAX_INPUT, out=inputs[..., :n], casting="unsafe")
        if len(self._periodic):
            angles = 2.0 * np.pi * position[..., self._periodic]
            inputs[..., self._periodic] = np.sin(angles)
            inputs[..., n : n + len(self._periodic)] = np.cos(angles)
        inputs[..., n + len(self._periodic) :] = self._identities
        return inputs

    def joint(self, own: FloatArray) -> FloatArray:
        """Return the inputs ``(..., len(joint_names))`` of all, given those ``own`` returns."""
        return own.reshape(*own.shape[:-2], -1).take(self._joint, axis=-1)
