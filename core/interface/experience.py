"""Observation, decision and experience of a team: values that are passed on.

Arrays of one environment are ``(n, d)`` and ``(n,)``. In many environments their axis comes first:
``(E, n, d)`` and ``(E, n)``, see `nested_agents.core.interface.environments`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ..numerics import FloatArray, IntArray
from .prediction import UNPREDICTED, Prediction
from .scenario import Transition


class Observation(NamedTuple):
    """States of all agents when a decision begins, and the prediction from these states."""

    states: FloatArray
    """``(n, d)`` states of the agents."""
    prediction: Prediction = UNPREDICTED
    """Prediction of the scenario, see `Team.observe`."""
    previous: IntArray | None = None
    """``(n,)`` previous joint action; None in the first decision of an episode."""


@dataclass(frozen=True)
class AgentDecision:
    """Decision of one agent, for inspection."""

    agent: str
    """Name of the agent."""
    action: str
    """Name of the action taken."""
    values: dict[str, float]
    """Values of the actions by name; log probabilities of policies; empty without values."""
    received: dict[str, str]
    """Received actions by the name of the sender."""
    payloads: dict[str, object]
    """Payloads received with these actions by the name of the sender, where there are any."""
    explored: bool
    """Whether another action has a greater value: the agent explored, or its policy drew."""
    present: bool = True
    """Whether the agent decided; an agent that is absent or has left the team does not."""


class Decision(NamedTuple):
    """Joint decision of a team."""

    joint_action: IntArray
    """``(n,)`` action of every agent."""
    inputs: tuple[object, ...]
    """Inputs of the parts of the team, for learning."""
    agents: tuple[AgentDecision, ...] = ()
    """Decisions of single agents in the order of decision, if the team was asked to inspect."""


class Experience(NamedTuple):
    """A decision and its result."""

    before: Observation
    """Observation on which the decision was made."""
    decision: Decision
    """The decision."""
    transition: Transition
    """Result of the step."""
    last: bool
    """Whether the episode ends: terminated, truncated, or out of steps."""
    duration: int = 1
    """Number of decision periods that the actions lasted; more than one for options only."""
