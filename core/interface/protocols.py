"""What a learner may know of the world: the protocols that a scenario and its predictor fulfil.

Conventions. ``n`` agents, ``d`` state variables, ``A`` actions. A joint action is an integer array
``(n,)`` in agent order. Its *joint-action index* is that array read as a number in base ``A``, the
first agent being the most significant digit; tables of all joint actions are in the order of this
index. Groups are blocks of consecutive agents that move one body (the wheels of a robot); the
digits of one group read as a number are its *robot-action index*.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from ..numerics.arrays import FloatArray, IntArray
from .spaces import ActionSet, StateSpace


def _no_rows() -> IntArray:
    return np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class Blocks:
    """Next states of one agent for all joint actions, in their two blocks.

    Attributes
    ----------
    own
        ``(K, n_own)`` own variables, one row per robot-action index of the agent's group of ``w``
        agents; fewer with `own_rows`, or if there are no own variables: then one row will do.
    shared
        ``(R, d - n_own)`` shared variables, one row per joint-action index; fewer with
        `shared_rows`.
    divisor
        ``A`` to the power of the number of agents behind the group: the robot-action index of
        joint-action index ``c`` is ``c // divisor % A ** w``.
    own_rows, shared_rows
        The row of `own` of every robot-action index ``(A ** w,)``, and of `shared` of every
        joint-action index ``(A ** n,)``, where several lead to one; empty: each has its row.
    alone
        Whether own variables are those that the group would reach alone, which is an approximation
        where others matter to them. If not, the blocks give for every index exactly what
        `Prediction.states` gives; if so, of the shared variables only.

    Compiled kernels read the tables without looking at their sizes.
    `nested_agents.scenarios.checking.checker` does look.
    """

    own: FloatArray
    shared: FloatArray
    divisor: int
    own_rows: IntArray = field(default_factory=_no_rows)
    shared_rows: IntArray = field(default_factory=_no_rows)
    alone: bool = False

    def states(self, indices: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of joint-action indices ``(m,)``."""
        local = indices // self.divisor % (len(self.own_rows) or len(self.own))
        own = self.own[self.own_rows[local] if len(self.own_rows) else local]
        shared = self.shared[self.shared_rows[indices] if len(self.shared_rows) else indices]
        return np.concatenate([own, shared], axis=1)


@runtime_checkable
class Prediction(Protocol):
    """What joint actions taken now would lead to. Valid until the scenario's next step.

    Only `states` is required. What a prediction may have besides is asked for by name, and where it
    is missing, what needs it does without or says so. `nested_agents.scenarios.checking` compares
    it with `states`.

    ``states_of_all(joint_actions)``
        Next states ``(n, m, d)`` of all agents at once. `states_of_all` asks for it.
    ``states_by_group(joint_actions)``
        Own variables ``(n, m, n_own)`` of all agents and shared ones ``(G, m, d - n_own)`` of all
        groups. `states_by_group` asks for it, where the values of many agents are pooled.
    ``rewards(joint_actions)``, ``after(joint_action)``
        See `RewardPrediction` and `ContinuedPrediction`.
    ``blocks(agent)``
        `Blocks` of an agent's next states for all ``A ** n`` joint actions. The evaluator ``exact``
        reads them where few agents are free.
    ``reward_table()``
        Rewards ``(A ** n,)`` of all joint actions by index, as `rewards` gives them. The evaluator
        ``exact`` needs it besides ``blocks``, except to decide by the deciding agent's value alone.
    """

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        ...


@runtime_checkable
class RewardPrediction(Prediction, Protocol):
    """A prediction that knows the reward, too: what a planner needs."""

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the predicted rewards ``(m,)`` of joint actions ``(m, n)``."""
        ...


@runtime_checkable
class ContinuedPrediction(RewardPrediction, Protocol):
    """A prediction that goes on from what it predicts: what plans of several decisions need."""

    def after(self, joint_action: IntArray) -> ContinuedPrediction:
        """Return the prediction from where a joint action ``(n,)`` leads in one decision."""
        ...


def states_of_all(prediction: Prediction, joint_actions: IntArray) -> FloatArray:
    """Return the next states ``(n, m, d)`` of all agents for joint actions ``(m, n)``."""
    own_way = getattr(prediction, "states_of_all", None)
    if own_way is not None:
        found: FloatArray = own_way(joint_actions)
        return found
    return np.stack([prediction.states(i, joint_actions) for i in range(joint_actions.shape[1])])


def states_by_group(
    prediction: Prediction,
    joint_actions: IntArray,
    groups: tuple[tuple[int, ...], ...],
    n_own: int,
) -> tuple[FloatArray, FloatArray]:
    """Return the own variables ``(n, m, n_own)`` and the shared ones ``(G, m, d - n_own)``."""
    own_way = getattr(prediction, "states_by_group", None)
    if own_way is not None:
        found: tuple[FloatArray, FloatArray] = own_way(joint_actions)
        return found
    states = states_of_all(prediction, joint_actions)
    return states[:, :, :n_own], states[[group[0] for group in groups], :, n_own:]


@dataclass(frozen=True)
class Transition:
    """What one step of a scenario returns.

    Attributes
    ----------
    states
        ``(n, d)`` states of the agents after the step.
    reward
        Reward received on entering these states: one number for all agents, or ``(n,)``.
    terminated
        Whether the task is solved (or lost) for good.
    truncated
        Whether the episode ends for lack of time.
    info
        Measurements of the step by name, scalars or small arrays; for records, not for learners.
    twists
        ``(M, 3)`` mean twist of every group's body in its own frame [m/s, m/s, rad/s], where bodies
        measure it; ``(K + M, 3)`` where they also measure what they move, its twists standing
        first, and nothing else than these bodies moved it.
    """

    states: FloatArray
    reward: float | FloatArray
    terminated: bool
    truncated: bool
    info: Mapping[str, Any]
    twists: FloatArray | None = None


@dataclass(frozen=True)
class Measure:
    """A number by which an episode is told: a column of results.

    Attributes
    ----------
    name
        Of the column; ``success`` is the one by which scenarios are compared.
    title
        Its heading in tables and figures.
    unit
        In words of the SI, ``"1"`` for a pure number.
    source
        Where it is taken from at every step: a key of `Transition.info`, or ``terminated``; empty:
        the key of its own name.
    gathering
        How the steps of an episode make one number: their ``last``, ``mean``, ``sum`` or ``max``.
    better
        Which way is better, if one is.
    is_rate
        Whether an episode has it or has it not: 1 or 0.
    least, greatest
        What it cannot be below or above, if there is such; intervals end there.
    """

    name: str
    title: str
    unit: str = "1"
    source: str = ""
    gathering: Literal["last", "mean", "sum", "max"] = "last"
    better: Literal["higher", "lower"] | None = None
    is_rate: bool = False
    least: float | None = None
    greatest: float | None = None

    def __post_init__(self) -> None:
        """Take it from the key of its own name, if no other is given."""
        object.__setattr__(self, "source", self.source or self.name)

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest value, infinite where none is known."""
        least = -math.inf if self.least is None else self.least
        return least, math.inf if self.greatest is None else self.greatest

    @property
    def heading(self) -> str:
        """Title and unit.

        >>> Measure("final_distance_m", "distance", "m").heading
        'distance [m]'
        """
        return self.title if self.unit == "1" else f"{self.title} [{self.unit}]"


SUCCESS = Measure("success", "success", source="terminated", better="higher", is_rate=True)
"""Whether the episode ended with the task solved: success, unless a scenario says otherwise."""


@runtime_checkable
class Scenario(Protocol):
    """A world with a task. Everything a learner may know of it.

    What else it may have is asked for by `groups_of`, `roles_of` and `measures_of`, which know what
    holds without; and by the protocols below, its *capabilities*. One more is asked for by
    name: ``measure()``, see `RecordedScenario`.
    """

    @property
    def agents(self) -> tuple[str, ...]:
        """Names of the agents, in agent order."""
        ...

    @property
    def state_space(self) -> StateSpace:
        """The state variables of every agent."""
        ...

    @property
    def action_set(self) -> ActionSet:
        """The actions of every agent."""
        ...

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return states ``(n, d)``.

        Everything random in it follows from `seed`; what is scheduled, from its number `episode`.
        """
        ...

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out a joint action ``(n,)`` for one decision period."""
        ...

    def predict(self) -> Prediction:
        """Predict from the present state."""
        ...


def groups_of(scenario: Scenario) -> tuple[tuple[int, ...], ...]:
    """Return the agents by body, consecutive; of a scenario without ``groups``, each alone."""
    single = tuple((i,) for i in range(len(scenario.agents)))
    groups: tuple[tuple[int, ...], ...] = getattr(scenario, "groups", single)
    return groups


def joint_reward(reward: float | FloatArray, groups: Sequence[Sequence[int]]) -> float | FloatArray:
    """Return the reward of those who act for groups of agents: the mean of each group's rewards.

    Examples
    --------
    >>> joint_reward(0.5, [(0, 1)]), joint_reward(np.array([1.0, 3.0, 5.0]), [(0, 1), (2,)])
    (0.5, array([2., 5.]))
    """
    if np.ndim(reward) == 0:
        return reward
    return np.array([np.asarray(reward)[list(group)].mean() for group in groups])


def roles_of(scenario: Scenario) -> tuple[str, ...]:
    """Return the role of every agent: agents of one role may share weights.

    Of a scenario without ``roles``, every agent has its own.
    """
    roles: tuple[str, ...] = getattr(scenario, "roles", tuple(scenario.agents))
    return roles


def measures_of(scenario: Scenario) -> tuple[Measure, ...]:
    """Return what an episode of a scenario is told by, success first.

    Of a scenario without ``measures`` it is success alone, see `SUCCESS`.
    """
    found: tuple[Measure, ...] = tuple(getattr(scenario, "measures", ()))
    own = [m for m in found if m.name == SUCCESS.name] or [SUCCESS]
    return (*own, *(m for m in found if m.name != SUCCESS.name))


@runtime_checkable
class RecordedScenario(Scenario, Protocol):
    """A scenario whose episodes are worth keeping step by step."""

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state, as in `Transition.info`.

        It is asked for between steps, and before the first one.
        """
        ...

    @property
    def recorded(self) -> tuple[str, ...]:
        """Names of the measurements that are kept, one array ``(T + 1, ...)`` each."""
        ...

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return what is kept once an episode: numbers, texts, arrays."""
        ...


@runtime_checkable
class DrawnScenario(RecordedScenario, Protocol):
    """A scenario whose recordings can be drawn."""

    def animate(self, recording: Mapping[str, FloatArray], path: Path) -> None:
        """Draw a recorded episode as an animation, GIF or MP4 by the suffix of `path`."""
        ...


@runtime_checkable
class ExactlyPredictedScenario(Scenario, Protocol):
    """A scenario that can be had with a predictor that makes no errors but those of rounding."""

    def with_exact_prediction(self) -> Scenario:
        """Return the same scenario with such a predictor; this one, if it has it already."""
        ...


@runtime_checkable
class MirroredScenario(Scenario, Protocol):
    """A scenario whose mirror image is the same task, see `core.adaptation.mirror`."""

    def partners(self) -> tuple[int, ...]:
        """Return for every agent the one in whose place it stands in the mirror.

        Raises
        ------
        ValueError
            If an agent has none; one line.
        """
        ...


class EmbodiedPrediction(Prediction, Protocol):
    """A prediction for bodies that are moved by wheels."""

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Agents by body."""
        ...

    def commands(self, joint_action: IntArray) -> FloatArray:
        """Return the wheel speeds ``(n,)`` that a joint action ``(n,)`` would command."""
        ...

    def slips(self, joint_action: IntArray) -> FloatArray:
        """Return by how much contact is predicted to change the bodies' twists, ``(M, 3)``."""
        ...


@runtime_checkable
class EmbodiedScenario(Scenario, Protocol):
    """A scenario whose groups are bodies on wheels, open to self-models."""

    @property
    def nominal_effects(self) -> tuple[FloatArray, ...]:
        """Per body the ``(3, w + 1)`` effect of its wheel speeds on its twist."""
        ...

    def predict_with(self, effects: Sequence[FloatArray]) -> EmbodiedPrediction:
        """Predict from the present state, believing in these effects."""
        ...


@runtime_checkable
class CalibratedScenario(EmbodiedScenario, Protocol):
    """A scenario whose predictions rest on positive constants that can be calibrated."""

    @property
    def constants(self) -> tuple[str, ...]:
        """Names of the constants; none if the present predictor has none."""
        ...

    @property
    def levers(self) -> FloatArray:
        """``(K + M,)`` speed per turning rate of what is moved and of the bodies [m]."""
        ...

    def predict_with(
        self, effects: Sequence[FloatArray], constants: FloatArray | None = None
    ) -> EmbodiedPrediction:
        """Predict, believing in these effects and in these constants.

        The constants are logarithms, in units of what is believed without them. The prediction also
        has ``outcomes(joint_action, constants)``: what a joint action ``(n,)`` would lead to under
        each of ``k`` choices of the constants ``(k, c)``, as mean twists ``(k, K + M, 3)`` of what
        is moved, and then of the bodies, see `Transition.twists`.
        """
        ...
