"""What the control loop asks of those who act, whoever they are: `Actors`."""

from typing import Any, Protocol

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from .scenario import Scenario, Transition


class Actors(Protocol):
    """Those who act in a scenario: a hierarchy of fuzzy agents, or a learner that trains by itself.

    Their calls come in this order: `begin_episode`, `predict`, `check`, and at every step `act`,
    `adapt`, `predict`, `learn`; then `end_episode`. Where nothing is learned, only `predict`,
    `check` and `act` come, without `explore`. Those who have ``begin_world(seed, episode)`` hear of
    every world that begins, learned in or not: they have failures that follow from its seed.
    """

    rng: np.random.Generator
    """Source of all that is random in what they do."""

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def predict(self, scenario: Scenario, states: FloatArray) -> Any:
        """Return what they decide by, in the scenario's present state, of states ``(n, d)``."""

    def check(self, prediction: Any) -> None:
        """Refuse what they cannot decide by with a ValueError of one line."""

    def act(self, prediction: Any, *, explore: bool = True) -> IntArray:
        """Return a joint action ``(n,)``; without `explore` the best that they know."""

    def adapt(self, prediction: Any, joint_action: IntArray, transition: Transition) -> None:
        """Revise what predictions rest on."""

    def learn(self, transition: Transition) -> None:
        """Take in what a step led to."""

    def end_episode(self) -> None:
        """Learn what is learned after an episode."""

    def arrays(self) -> dict[str, FloatArray]:
        """Return what they have learned."""
