"""The door for plain classes of users: learners, evaluators and explorers that inherit nothing.

What they may have is asked for by name here, once, and nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping
from inspect import signature
from typing import Any, Self

import numpy as np

from ..interface.agents import Counts
from ..interface.plain import offered
from ..learners.learner import Learner
from ..numerics import FloatArray, IntArray
from ..search.evaluator import DecisionContext, Evaluator
from ..search.exploration import Explorer, no_way_on


def as_learner(thing: Any) -> Learner:
    """Return a learner: the thing itself if it is one, else one that lets it learn."""
    return thing if isinstance(thing, Learner) else PlainLearner(thing)


def as_evaluator(thing: Any) -> Evaluator:
    """Return an evaluator: the thing itself if it is one, else one that asks it."""
    return thing if isinstance(thing, Evaluator) else PlainEvaluator(thing)


def as_explorer(thing: Any) -> Explorer:
    """Return an explorer: the thing itself if it is one, else one that asks it."""
    return thing if isinstance(thing, Explorer) else PlainExplorer(thing)


class PlainLearner(Learner):
    """A learner of a user's plain class.

    A class whose ``observe`` has arguments named ``left`` and ``joint_action`` is given them, too,
    see `Learner.observe_decision`: what learners of state-action values learn from.

    Parameters
    ----------
    plain
        An object that has what a learner cannot do without.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self._more = signature(plain.observe).parameters.keys() & {"left", "joint_action"}

    @property
    def theta(self) -> FloatArray:  # type: ignore[override]  # a user's may be another array later
        """The consequent weights."""
        theta: FloatArray = self.plain.theta
        return theta

    def begin_episode(self) -> None:
        """Begin an episode."""
        self.plain.begin_episode()

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Take in the states entered."""
        return int(self.plain.observe(states, reward, terminated))

    def observe_decision(
        self,
        left: FloatArray,
        joint_action: IntArray,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
    ) -> int:
        """Take in what a decision led to, as far as the user's class asks for it."""
        known = {"left": left, "joint_action": joint_action}
        more = {name: known[name] for name in self._more}
        return int(self.plain.observe(states, reward, terminated, **more))

    def end_episode(self) -> int:
        """Learn what is learned after an episode."""
        return int(self.plain.end_episode())

    def arrays(self) -> dict[str, FloatArray]:
        """Return everything that `restore` needs."""
        arrays: dict[str, FloatArray] = self.plain.arrays()
        return arrays

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.plain.restore(arrays)

    def continue_from(self, former: Self, rows: IntArray) -> None:
        """Begin with what another learner has learned, if the user's class can."""
        if offered(self.plain, "continue_from") is None:
            raise ValueError(no_way_on("learner.kind", self.plain))
        self.plain.continue_from(former.plain, rows)


class PlainEvaluator(Evaluator):
    """An evaluator of a user's plain class.

    Parameters
    ----------
    plain
        An object with ``values(context)``; its ``counts``, if it counts, are ours.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self.counts: Counts = offered(plain, "counts", Counts())

    def values(self, context: DecisionContext) -> FloatArray:
        """Return the value ``(A,)`` of each action of the deciding agent."""
        values: FloatArray = self.plain.values(context)
        return values


class PlainExplorer(Explorer):
    """An explorer of a user's plain class.

    Parameters
    ----------
    plain
        An object with ``memory``, ``begin_episode``, ``choose`` and ``advance``.
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain

    @property
    def memory(self) -> FloatArray:  # type: ignore[override]  # a user's may be another array later
        """All that it remembers."""
        memory: FloatArray = self.plain.memory
        return memory

    def begin_episode(self) -> None:
        """Begin an episode of learning."""
        self.plain.begin_episode()

    def choose(self, agent: int, values: FloatArray, rng: np.random.Generator) -> int:
        """Return the action of `agent`."""
        return int(self.plain.choose(agent, values, rng))

    def advance(self) -> None:
        """Go on to the next step."""
        self.plain.advance()

    def continue_from(self, former: Self) -> None:
        """Go on from an explorer of other agents, if the user's class can."""
        if offered(self.plain, "continue_from") is None:
            raise ValueError(no_way_on("learner.exploration.kind", self.plain))
        self.plain.continue_from(former.plain)
