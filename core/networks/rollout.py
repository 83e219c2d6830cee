"""Rollouts, their minibatches, and generalized advantage estimates.

Axes are T steps of a rollout, E environments, k agents and h heads of an action.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..numerics import AnyArray, BoolArray, FloatArray, IntArray
from .settings import NetworkSettings


class PolicyShape(NamedTuple):
    """Sizes of the arrays of a policy."""

    n_told: int
    """Inputs of the actor in front of those of its own agent."""
    n_own: int
    """Inputs of one agent."""
    n_joint: int
    """Inputs of the critic beyond those of its own agent."""
    n_heads: int
    n_actions: int
    """Choices of a head."""


class Choices(NamedTuple):
    """Choices of a step by the heads of all agents."""

    logits: FloatArray
    """``(E, k, h, A)``."""
    actions: IntArray
    """``(E, k, h)``."""
    decided: BoolArray
    """``(k, h)`` whether a policy chose the action: an absent agent does not decide."""


class Batch(NamedTuple):
    """Transitions of a rollout, or of a minibatch."""

    actor_inputs: FloatArray
    """``(m, n_told + n_own)``."""
    critic_inputs: FloatArray
    """``(m, n_own + n_joint)``."""
    actions: IntArray
    """``(m, h)``."""
    decided: BoolArray
    """``(m, h)`` whether the policy chose an action; each transition has one that it chose."""
    log_probs: FloatArray
    """``(m,)`` log probabilities of the actions when they were sampled."""
    advantages: FloatArray
    """``(m,)``."""
    returns: FloatArray
    """``(m,)`` targets of the critic."""

    def take(self, rows: IntArray) -> Batch:
        """Return the minibatch of some rows."""
        return Batch._make(array.take(rows, axis=0) for array in self)


class Rollout:
    """Steps between two updates.

    Parameters
    ----------
    size
        Number of steps, T.
    n_environments, n_agents
        E and k.
    shape
        Shape of the policy.
    """

    def __init__(self, size: int, n_environments: int, n_agents: int, shape: PolicyShape) -> None:
        axes = size, n_environments, n_agents
        self.steps = 0
        self.actor_inputs = np.zeros((*axes, shape.n_told + shape.n_own), np.float32)
        self.joint_inputs = np.zeros((size, n_environments, shape.n_joint), np.float32)
        self.actions = np.zeros((*axes, shape.n_heads), np.int64)
        self.decided = np.zeros((*axes, shape.n_heads), bool)
        self.log_probs = np.zeros(axes, np.float32)
        self.rewards = np.zeros(axes, np.float32)
        self.last = np.zeros((size, n_environments), bool)

    @property
    def is_full(self) -> bool:
        """Whether an update is due."""
        return self.steps == len(self.rewards)

    def arrays(self) -> dict[str, AnyArray]:
        """Return its arrays by name."""
        return {name: array for name, array in vars(self).items() if name != "steps"}


def generalized_advantages(
    rollout: Rollout, values: FloatArray, next_values: FloatArray, settings: NetworkSettings
) -> FloatArray:
    """Return generalized advantage estimates ``(T, E, k)`` (Schulman et al. 2016).

    Backward in time, where nothing follows the end of an episode::

        d_t = r_t + gamma v_t+1 - v_t,    A_t = d_t + gamma lambda A_t+1

    An absence of an agent is a truncation: ``A_t = d_t`` before it, and 0 while it lasts.

    Parameters
    ----------
    rollout
        A full rollout; rewards before a truncation contain the discounted value of the next state.
    values
        ``(T, E, k)`` values of its states.
    next_values
        ``(E, k)`` values of the states after the rollout.
    settings
        Discount and trace decay.
    """
    advantages = np.empty_like(values)
    advantage: FloatArray = np.zeros_like(next_values)
    decided: BoolArray = np.logical_or.reduce(rollout.decided, axis=-1)
    for t in range(len(values) - 1, -1, -1):
        discount = settings.discount * ~rollout.last[t][:, None]
        advantage = rollout.rewards[t] + discount * (next_values + settings.gae_lambda * advantage)
        advantage -= values[t]
        advantage *= decided[t]
        advantages[t] = advantage
        next_values = values[t]
    return advantages
