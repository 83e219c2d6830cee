"""What those who act are told, decide and experience: values that are handed on.

Arrays of one environment are ``(n, d)`` and ``(n,)``. Where several environments are stepped
together, their axis stands first: ``(E, n, d)`` and ``(E, n)``, see
`nested_agents.core.interface.environments`.
"""

from __future__ import annotations

from typing import NamedTuple

from ..numerics import FloatArray, IntArray
from .plain import as_prediction
from .prediction import Prediction
from .scenario import Scenario, Transition


class Observation(NamedTuple):
    """What may be known when a decision begins."""

    present: FloatArray
    """``(n, d)`` states that all agents are in."""
    scenario: Scenario
    """Where they are; it predicts from there until its next step."""
    previous: IntArray | None = None
    """``(n,)`` what all did in the decision before; none: there was none, all were neutral."""
    imagined: Prediction | None = None
    """What to decide by in place of what agents predict themselves: a situation thought of."""

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` as the scenario predicts them.

        Raises
        ------
        ValueError
            If it predicts nothing.
        """
        prediction = self.imagined or as_prediction(self.scenario.predict())
        if prediction is None:
            raise ValueError(f"the scenario {type(self.scenario).__name__} predicts nothing")
        return prediction.states(agent, joint_actions)


class Decision(NamedTuple):
    """What a team has decided."""

    joint_action: IntArray
    """``(n,)`` an action of every agent."""
    inputs: tuple[object, ...]
    """What each part of the team decided by: its own affair, kept for what it learns of it."""


class Experience(NamedTuple):
    """A decision and what it led to."""

    before: Observation
    """Where it was taken."""
    decision: Decision
    """What was decided."""
    transition: Transition
    """What it led to."""
    last: bool
    """Whether the episode ends with it: terminated, truncated, or out of steps."""
