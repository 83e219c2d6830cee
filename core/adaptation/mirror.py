"""Mirrored experience: what the image of a team would have met in the mirror image of its world.

Whoever learns which way to turn with the goal on the left has learned it for the right, if it is
told that the two are alike. In a mirror every agent stands where its partner stood (the left wheel
of a robot where the right one was), some state variables change their sign, and rewards stay. So a
step is two steps of experience, to learners that regress on after-states.
"""

from __future__ import annotations

import numpy as np

from ..interface.scenario import Scenario
from ..numerics import FloatArray, IntArray


class Mirror:
    """Doubles experience: agents, and behind them their mirror images.

    Parameters
    ----------
    signs
        ``(d,)`` -1 where a mirror turns the sign of a state variable, else 1.
    partners
        ``(n,)`` the agent whose place each agent takes.

    Examples
    --------
    >>> mirror = Mirror(np.array([1.0, -1.0]), np.array([1, 0]))
    >>> mirror.states(np.array([[0.1, 0.5], [0.2, 0.5]])).tolist()
    [[0.1, 0.5], [0.2, 0.5], [0.1, -0.5], [0.2, -0.5]]
    >>> mirror.rows(np.array([0, 1])).tolist()
    [0, 1, 1, 0]
    """

    def __init__(self, signs: FloatArray, partners: IntArray) -> None:
        self.signs, self.partners = signs, partners

    @classmethod
    def of(cls, scenario: Scenario) -> Mirror:
        """Return the mirror of a scenario.

        Raises
        ------
        ValueError
            If it has none, or a state variable does not say what a mirror does to it; one line.
        """
        if not hasattr(scenario, "partners"):
            raise ValueError("learner.mirrored: the scenario does not tell what a mirror does")
        variables = scenario.state_space.variables
        for variable in variables:
            if variable.mirrored is None:
                raise ValueError(
                    f"learner.mirrored: state variable {variable.name!r} does not say whether a "
                    "mirror turns its sign; declare mirrored = 'same' or 'opposite'"
                )
        signs = [-1.0 if variable.mirrored == "opposite" else 1.0 for variable in variables]
        return cls(np.array(signs), np.array(scenario.partners()))

    def rows(self, rows: IntArray) -> IntArray:
        """Return the rows of weights ``(2 n,)`` of agents and images, of those ``(n,)`` of agents.

        The image of an agent has learned for its partner, in whose place it stands.
        """
        return np.concatenate([rows, rows[self.partners]])

    def states(self, states: FloatArray) -> FloatArray:
        """Return the states ``(2 n, d)`` of agents and images, of those ``(n, d)`` of agents."""
        return np.concatenate([states, self.signs * states])

    def reward(self, reward: float | FloatArray) -> float | FloatArray:
        """Return what agents and images are paid: the same."""
        return np.tile(reward, 2) if isinstance(reward, np.ndarray) else reward
