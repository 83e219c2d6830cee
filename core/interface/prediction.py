"""Interface of predictions: next states and rewards of joint actions.

Arrays follow the conventions of `spaces`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..numerics import FloatArray, IntArray


class Exploring(NamedTuple):
    """State and probabilities of burst exploration, for compiled code."""

    memory: FloatArray
    """``(1 + 2 n,)`` after the first entry the remaining decisions and the action of every agent's
    burst; modified."""
    chance: float
    """Probability that an agent starts a burst; negative without exploration."""
    stop: float
    """Probability that a burst ends."""


NOT_EXPLORING = Exploring(np.zeros(0), -1.0, 1.0)
"""No exploration."""


class Prediction(ABC):
    """Next states and rewards of joint actions, valid until the next step of the scenario.

    Only `states` is required. The other methods may return None, which means that they are not
    supported. `nested_agents.scenarios.checking` compares them with `states`.
    """

    repeats: bool = False
    """Whether agents are assumed to repeat their action in all decisions after the first. If not,
    they take the neutral action. See `nested_agents.core.interface.abilities.PredictsAhead`."""
    is_constant: bool = False
    """Whether predictions are the same in every state, as in a repeated game."""
    is_given: bool = False
    """Whether a decision has used this object; the next decision gets a copy."""

    @cached_property
    def alike(self) -> IntArray | None:
        """``(G, L)`` first robot-action index with the same result as each index; None if unknown.

        The evaluators ``exact`` and ``best-response`` predict only these.
        """
        return None

    @abstractmethod
    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """Return own variables ``(n, m, n_own)`` and shared variables ``(G, m, d - n_own)``."""
        return None

    def rewards(self, joint_actions: IntArray) -> FloatArray | None:
        """Return the rewards ``(m,)`` of joint actions ``(m, n)``."""
        return None

    def prepare_kernels(self) -> None:
        """Begin to compile what `states_by_group` calls, if that takes long; by default nothing."""
        return None

    def of(self, agent: int) -> Prediction:
        """Return the prediction of an agent with its own sensors; by default this prediction."""
        return self

    def after(self, joint_action: IntArray) -> Prediction | None:
        """Return the prediction from the states after a joint action ``(n,)``.

        Plans of several decisions require it, and rewards.
        """
        return None


class Unpredicted(Prediction):
    """Prediction of agents that do not predict: they value actions in their present states."""

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Raise an error.

        Raises
        ------
        ValueError
            Always.
        """
        raise ValueError(
            "nothing is predicted here: the scenario has no predictor, or needs_prediction of the "
            "learner's settings is false"
        )


UNPREDICTED = Unpredicted()
"""The only instance."""


def states_of(prediction: Prediction, agent: int, joint_actions: IntArray) -> FloatArray:
    """Return the predicted states ``(m, d)`` of an agent for joint actions ``(m, n)``.

    Raises
    ------
    ValueError
        If they are not finite.
    """
    return _finite(prediction.states(agent, joint_actions), f"states of agent {agent}", prediction)


def rewards_of(prediction: Prediction, joint_actions: IntArray) -> FloatArray:
    """Return the predicted rewards ``(m,)`` of joint actions ``(m, n)``.

    Raises
    ------
    ValueError
        If none are predicted, or they are not finite.
    """
    rewards = prediction.rewards(joint_actions)
    if rewards is None:
        raise ValueError(f"{type(prediction).__name__} predicts no rewards")
    return _finite(rewards, "rewards", prediction)


def _finite(values: FloatArray, what: str, prediction: Prediction) -> FloatArray:
    if not np.isfinite(values).all():
        raise ValueError(f"{type(prediction).__name__}: predicted {what} are not finite")
    return values


class Assumptions(NamedTuple):
    """Assumptions of agents about bodies. None keeps the assumption of the prediction."""

    effects: Sequence[FloatArray] | None = None
    """Effect ``(3, w + 1)`` of the wheel speeds on the twist, by body."""
    constants: FloatArray | None = None
    """``(c,)`` logarithms of factors on the nominal values of the constants."""
    regressions: Sequence[FloatArray] | None = None
    """Weights ``(f, t)`` of the regressions that predict poses, see
    `Embodiment.regression_shapes`."""
    decisions: int = 1
    """Number of decisions for which regressions hold the wheel speeds after a joint action."""


class EmbodiedPrediction(Prediction):
    """A prediction for assumed effects of actuators, and possibly for assumed constants.

    Scenarios with such predictions describe their bodies, see
    `nested_agents.core.interface.abilities.Embodiment`.
    """

    groups: tuple[tuple[int, ...], ...]
    """Indices of the agents of every body."""

    @abstractmethod
    def assuming(self, assumptions: Assumptions) -> EmbodiedPrediction:
        """Return the prediction from the same states under other assumptions."""

    @abstractmethod
    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds ``(n,)`` that a joint action ``(n,)`` commands."""

    @abstractmethod
    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return the predicted change ``(M, 3)`` of the bodies' twists by contact."""

    def outcomes(self, joint_action: IntArray, constants: FloatArray) -> FloatArray:
        """Return predicted mean twists ``(k, K + M, 3)`` for choices of constants ``(k, c)``.

        Twists of moved objects come before those of bodies, see `Transition.twists`.
        """
        raise TypeError(f"{type(self).__name__} has no constants")

    def pose_samples(
        self, joint_action: IntArray, info: Mapping[str, FloatArray]
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Return features ``(m, f)`` and targets ``(m, t)`` of all regressions of poses.

        See `Embodiment.regression_shapes`; `info` holds measurements after the joint action
        ``(n,)``, see `Transition`.
        """
        raise TypeError(f"{type(self).__name__} has no poses to learn")


def first_alike(keys: IntArray | FloatArray) -> IntArray:
    """Return the first column with the same key for every entry of ``(G, L)``."""
    return (keys[:, :, None] == keys[:, None, :]).argmax(axis=2)


def states_by_group(
    prediction: Prediction, joint_actions: IntArray, groups: tuple[tuple[int, ...], ...], n_own: int
) -> tuple[FloatArray, FloatArray]:
    """Return the own variables ``(n, m, n_own)`` and the shared ones ``(G, m, d - n_own)``."""
    states = prediction.states_by_group(joint_actions)
    if states is not None:
        return states
    agents = range(joint_actions.shape[1])
    each = np.stack([np.array(states_of(prediction, i, joint_actions)) for i in agents])
    firsts = [group[0] for group in groups]
    return each[:, :, :n_own], each[firsts, :, n_own:]
