"""What an agent perceives, what it can do, and what a predictor promises of where that leads.

A state space falls in two blocks. The leading *own* variables of an agent depend on the actions of
its own group only (the wheels of its robot); the others, the *shared* ones, may depend on every
agent. Kernels use the split: an own block takes few distinct values while joint actions are
enumerated, so that its part of a rule base is contracted once.

Conventions. ``n`` agents, ``d`` state variables, ``A`` actions. A joint action is an integer array
``(n,)`` in agent order. Its *joint-action index* is that array read as a number in base ``A``, the
first agent being the most significant digit; tables of all joint actions are in the order of this
index. Groups are blocks of consecutive agents that move one body (the wheels of a robot); the
digits of one group read as a number are its *robot-action index*.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np

from ..numerics import FloatArray, IntArray

FARTHEST = 1000.0
"""Ranges of a variable beyond which its value cannot be meant."""


@dataclass(frozen=True)
class Variable:
    """One state variable.

    Raises
    ------
    ValueError
        If the range is empty or not finite, or the centres do not increase within it.
    """

    name: str
    """Short identifier, unique within its state space."""
    unit: str
    """Unit in words of the SI, ``"1"`` for a pure number."""
    low: float
    """Lower end of the range over which membership functions are laid; values outside are legal and
    belong to the outermost membership functions."""
    high: float
    """Upper end of that range. For a periodic variable ``high - low`` is the period."""
    periodic: bool = False
    """Whether `low` and `high` are the same point (an angle)."""
    centres: tuple[float, ...] = ()
    """Default centres of the membership functions, increasing, within the range. Empty: spread
    evenly, see `core.rules.kernels.fuzzy.Partition.of`."""
    labels: tuple[str, ...] = ()
    """Words for the membership functions, in the order of `centres`; empty: numbered."""
    mirrored: Literal["same", "opposite"] | None = None
    """What it is in the mirror image of a world: the ``same``, or of ``opposite`` sign; none: it is
    not known, see `core.adaptation.predictors`."""

    def __post_init__(self) -> None:
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise ValueError(
                f"variable {self.name!r}: range [{self.low}, {self.high}] must be finite, low first"
            )
        ordered = all(a < b for a, b in zip(self.centres, self.centres[1:], strict=False))
        inside = all(self.low <= c <= self.high for c in self.centres)
        if not (ordered and inside):
            raise ValueError(
                f"variable {self.name!r}: centres {self.centres} must increase within "
                f"[{self.low}, {self.high}]"
            )
        if self.labels and len(self.labels) != len(self.centres):
            raise ValueError(
                f"variable {self.name!r}: {len(self.labels)} labels for {len(self.centres)} centres"
            )


def choice(name: str, actions: tuple[str, ...]) -> Variable:
    """Return a variable that is the index of an action, with a membership centre at each."""
    centres = tuple(map(float, range(len(actions))))
    return Variable(name, "1", 0.0, centres[-1], centres=centres, labels=actions)


@dataclass(frozen=True)
class StateSpace:
    """The state variables of an agent, own block first.

    Examples
    --------
    >>> space = StateSpace("demo", (Variable("speed", "m/s", -1, 1), Variable("gap", "m", 0, 2)), 1)
    >>> space.n_variables, [v.name for v in space.shared]
    (2, ['gap'])
    """

    name: str
    """The name under which specs know it."""
    variables: tuple[Variable, ...]
    """The variables, the own ones leading."""
    n_own: int = 0
    """How many leading variables depend on the actions of the agent's own group only."""
    common: tuple[str, ...] = ()
    """Names of shared variables that are the same for all agents: what they are worth to a team is
    found once."""
    actions: tuple[str, ...] = ()
    """Names of variables that are actions taken, of the agent or of others, with a membership
    function at each: what `QLearning` maximises over."""

    def __post_init__(self) -> None:
        names = [v.name for v in self.variables]
        if not names or len(set(names)) != len(names):
            raise ValueError(f"state space {self.name!r}: variable names {names} must be distinct")
        if not 0 <= self.n_own <= len(names):
            raise ValueError(
                f"state space {self.name!r}: n_own = {self.n_own}, allowed 0 to {len(names)}"
            )
        for name in self.common:
            if name not in names[self.n_own :]:
                raise ValueError(
                    f"state space {self.name!r}: common variable {name!r} is none of the shared"
                )
        for name in self.actions:
            if name not in names:
                raise ValueError(f"state space {self.name!r}: action {name!r} is no variable")

    def checked(self, states: FloatArray, agents: Sequence[str]) -> FloatArray:
        """Return the states of some agents, if they can be learned from.

        Raises
        ------
        ValueError
            If they are no ``(n, d)`` finite numbers, or one is farther than `FARTHEST` times the
            range of its variable from its lower end; the first that is wrong is named.
        """
        wanted = len(agents), self.n_variables
        try:
            array = np.asarray(states, float)
        except (TypeError, ValueError):
            array = np.empty(0)
        if array.shape != wanted:
            given = f"shape {array.shape}" if array.ndim == 2 else type(states).__name__
            raise ValueError(f"states of agents: {given}, allowed: numbers of shape {wanted}")
        low, width = self.ranges
        near = np.abs((array - low) / width) <= FARTHEST
        if not near.all():
            agent, variable = np.argwhere(~near)[0]
            v = self.variables[variable]
            raise ValueError(
                f"{v.name} of {agents[agent]} is {array[agent, variable]:.6g}, "
                f"allowed: finite, and at most {FARTHEST:g} times its range from {v.low:g}"
            )
        return array

    @cached_property
    def ranges(self) -> tuple[FloatArray, FloatArray]:
        """Where the ranges of all variables begin ``(d,)``, and how wide they are ``(d,)``."""
        low, high = np.array([(v.low, v.high) for v in self.variables]).T
        return low, high - low

    @property
    def bounds(self) -> FloatArray:
        """Between which states lie ``(d, 2)``: those of periodic variables within their period."""
        any_ = (-np.inf, np.inf)
        return np.array([(v.low, v.high) if v.periodic else any_ for v in self.variables])

    @property
    def n_variables(self) -> int:
        """Number of state variables d."""
        return len(self.variables)

    @property
    def own(self) -> tuple[Variable, ...]:
        """The variables that depend on the agent's own group only."""
        return self.variables[: self.n_own]

    @property
    def shared(self) -> tuple[Variable, ...]:
        """The variables that may depend on every agent."""
        return self.variables[self.n_own :]


@dataclass(frozen=True)
class ActionSet:
    """The actions that every agent chooses from, and their effect on its commanded speed.

    Action ``a`` turns the commanded speed ``u`` into
    ``clip(gain[a] * u + increment[a] * unit, -limit, limit)`` where unit and limit belong to the
    scenario. The paper's four (Section V) are increase, decrease, maintain and make zero.
    """

    names: tuple[str, ...] = ("increase", "decrease", "maintain", "zero")
    gains: tuple[float, ...] = (1.0, 1.0, 1.0, 0.0)
    increments: tuple[float, ...] = (1.0, -1.0, 0.0, 0.0)
    neutral: int = field(default=2)
    """The action attributed to agents that the deciding agent cannot see: maintain."""

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.gains) == len(self.increments):
            raise ValueError("action set: names, gains and increments must have equal lengths")
        if not 0 <= self.neutral < len(self.names):
            raise ValueError(f"action set: neutral = {self.neutral} names no action")

    def __len__(self) -> int:
        return len(self.names)

    def apply(
        self, speeds: FloatArray, actions: IntArray, unit: FloatArray, limit: FloatArray
    ) -> FloatArray:
        """Return the commanded speeds ``(..., n)`` after `actions` ``(..., n)``.

        Parameters
        ----------
        speeds
            ``(n,)`` commanded speeds before.
        actions
            Action indices.
        unit, limit
            ``(n,)`` what an increment changes, and the greatest speed.

        Examples
        --------
        >>> ActionSet().apply(np.array([0.5, 0.1]), np.array([0, 3]), np.ones(2), np.ones(2))
        array([1., 0.])
        """
        gains, increments = np.asarray(self.gains), np.asarray(self.increments)
        wanted = gains[actions] * speeds + increments[actions] * unit
        return np.clip(wanted, -limit, limit)


@dataclass(frozen=True)
class Blocks:
    """Next states of one agent for all joint actions, in their two blocks.

    Compiled kernels read the tables without looking at their sizes.
    `nested_agents.scenarios.checking.checker` does look.
    """

    own: FloatArray
    """``(K, n_own)`` own variables, one row per robot-action index of the agent's group of ``w``
    agents; fewer with `own_rows`, or if there are no own variables: then one row will do."""
    shared: FloatArray
    """``(R, d - n_own)`` shared variables, one row per joint-action index; fewer with
    `shared_rows`."""
    divisor: int
    """``A`` to the power of the number of agents behind the group: the robot-action index of
    joint-action index ``c`` is ``c // divisor % A ** w``."""
    own_rows: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """``(A ** w,)`` the row of `own` of every robot-action index, where several lead to one; empty:
    each has its row."""
    shared_rows: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """``(A ** n,)`` the row of `shared` of every joint-action index; empty: each has its row."""
    alone: bool = False
    """Whether own variables are those that the group would reach alone, which is an approximation
    where others matter to them. If not, the blocks give for every index exactly what
    `Prediction.states` gives; if so, of the shared variables only."""

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

    ``states_by_group(joint_actions)``
        Own variables ``(n, m, n_own)`` of all agents and shared ones ``(G, m, d - n_own)`` of all
        groups. `states_by_group` asks for it, where the values of many agents are pooled.
    ``rewards(joint_actions)``
        Rewards ``(m,)`` of joint actions ``(m, n)``: what deciding by rewards needs.
    ``after(joint_action)``
        The prediction from where a joint action ``(n,)`` leads in one decision, which knows the
        reward and goes on likewise: what plans of several decisions need.
    ``alike``
        ``(G, L)`` for every robot-action index of every group the first one that comes to the same:
        the evaluator ``best-response`` tries only that.
    ``best_responses(rules)``
        `BestResponses` by such rules, or None: what the evaluator ``best-response`` comes to where
        all agents are bodies of their own that hear all and decide by the value of the team. They
        are the very same joint actions, with the same draws, but sooner.
    ``blocks(agent)``
        `Blocks` of an agent's next states for all ``A ** n`` joint actions. The evaluator ``exact``
        reads them where few agents are free.
    ``reward_table()``
        Rewards ``(A ** n,)`` of all joint actions by index, as `rewards` gives them. The evaluator
        ``exact`` needs it besides ``blocks``, except to decide by the deciding agent's value alone.
    """

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""


class Exploring(NamedTuple):
    """How agents explore by random actions that are held, as compiled code takes it."""

    memory: FloatArray
    """``(1 + 2 n,)``, changed: per agent, behind the first, decisions left and the action held."""
    chance: float
    """Probability with which an agent begins to hold one; below zero: nobody does."""
    stop: float
    """Probability with which it ends."""


NOT_EXPLORING = Exploring(np.zeros(0), -1.0, 1.0)
"""Nobody explores."""
BestResponses = Callable[[FloatArray, IntArray, IntArray, Exploring, np.random.Generator], IntArray]
"""Returns the joint action ``(n,)`` by the agents' weights ``(n, n_rules)``, a plan ``(n,)`` to
start from, the order of decision ``(n,)``, how they explore, and a source of randomness."""


def has_tables(prediction: Any) -> bool:
    """Return whether a prediction has tables of all joint actions: of states, and of rewards."""
    return hasattr(prediction, "blocks") and hasattr(prediction, "reward_table")


def first_alike(keys: IntArray | FloatArray) -> IntArray:
    """Return in every row of ``(G, L)`` the first column that holds the same."""
    return (keys[:, :, None] == keys[:, None, :]).argmax(axis=2)


def states_by_group(
    prediction: Prediction, joint_actions: IntArray, groups: tuple[tuple[int, ...], ...], n_own: int
) -> tuple[FloatArray, FloatArray]:
    """Return the own variables ``(n, m, n_own)`` and the shared ones ``(G, m, d - n_own)``."""
    own_way = getattr(prediction, "states_by_group", None)
    if own_way is not None:
        return own_way(joint_actions)
    each = range(joint_actions.shape[1])
    states = np.stack([prediction.states(i, joint_actions) for i in each])
    return states[:, :, :n_own], states[[group[0] for group in groups], :, n_own:]
