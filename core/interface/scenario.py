"""A world with a task: what a scenario promises, and what a step of it returns.

Conventions are those of `spaces`. Scenarios inherit `Scenario` and define five members: `agents`,
`state_space`, `action_set`, `reset` and `step`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..numerics import BoolArray, FloatArray, IntArray
from .environments import Environments
from .measures import Measure
from .prediction import EmbodiedPrediction, Prediction
from .spaces import ActionSet, StateSpace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Twists = FloatArray | Callable[[], FloatArray | None] | None
"""Those of a transition, what measures them, or nothing."""


class DeferredTwists:
    """The twists of a transition: given, or measured when they are first asked for."""

    def __get__(self, transition: Transition | None, owner: type[Transition]) -> FloatArray | None:
        """Return them; None, which is the default, of no transition."""
        if transition is None:
            return None
        twists: Twists = vars(transition)["twists"]
        if callable(twists):
            twists = twists()
            vars(transition)["twists"] = twists
        return twists

    def __set__(self, transition: Transition, twists: Twists) -> None:
        """Keep them, or what measures them."""
        vars(transition)["twists"] = twists


@dataclass(frozen=True)
class Transition:
    """What one step of a scenario returns."""

    states: FloatArray
    """``(n, d)`` states of the agents after the step."""
    reward: float | FloatArray
    """Reward received on entering these states: one number for all agents, or ``(n,)``."""
    terminated: bool
    """Whether the task is solved (or lost) for good."""
    truncated: bool
    """Whether the episode ends for lack of time."""
    info: Mapping[str, Any]
    """Measurements of the step by name, scalars or small arrays; for records, not for learners."""
    twists: DeferredTwists = DeferredTwists()
    """``(M, 3)`` mean twist of every group's body in its own frame [m/s, m/s, rad/s], where bodies
    measure it; ``(K + M, 3)`` where they also measure what they move, its twists standing first,
    and nothing else than these bodies moved it. Given is also a function that returns them, which
    is called if they are asked for."""
    absorbing: bool = True
    """Whether a terminal state is as if entered again for ever, as where a box stands at its goal;
    if not, its reward is received once, as in Gymnasium."""


def checked_transition(transition: object, space: StateSpace, agents: Sequence[str]) -> Transition:
    """Return a copy of a transition if agents can learn from it.

    A scenario may reuse its arrays: learners keep transitions, so each enters as a copy.

    Raises
    ------
    ValueError
        If it is no `Transition`, or its states or its reward cannot be learned from; one line.
    """
    if not isinstance(transition, Transition):
        given = type(transition).__name__
        raise ValueError(f"step returns {given}, allowed: nested_agents.Transition")
    twists: Twists = vars(transition)["twists"]
    return Transition(
        states=space.checked(transition.states, agents),
        reward=checked_reward(transition.reward, agents),
        terminated=bool(transition.terminated),
        truncated=bool(transition.truncated),
        info={name: _copied(value) for name, value in transition.info.items()},
        twists=_copied(twists),  # type: ignore[arg-type]  # given, or a function that returns them
        absorbing=bool(transition.absorbing),
    )


def _copied(value: object) -> object:
    """Return a copy of what code of users might change in place."""
    return deepcopy(value) if isinstance(value, np.ndarray | list | dict) else value


def checked_reward(reward: object, agents: Sequence[str]) -> float | FloatArray:
    """Return a copy of the reward of agents if it can be learned from.

    Raises
    ------
    ValueError
        If it is neither a finite number nor one for each of them.
    """
    if isinstance(reward, float) and isfinite(reward):
        return reward  # most scenarios return a float
    array = np.array(reward)
    is_numeric = array.dtype.kind in "biuf" and array.shape in ((), (len(agents),))
    if not (is_numeric and np.isfinite(array).all()):
        raise ValueError(
            f"reward = {reward!r:.60}, allowed: a finite number, or one for each of "
            f"{len(agents)} agents"
        )
    return array if array.ndim else array.item()


class Embodiment(ABC):
    """Bodies on wheels, open to self-models, and perhaps to calibration."""

    nominal_effects: tuple[FloatArray, ...]
    """Per body the ``(3, w + 1)`` effect of its wheel speeds on its twist."""
    constants: tuple[str, ...] = ()
    """Names of the positive constants of its predictor that can be calibrated."""
    levers: FloatArray = np.zeros(0)
    """``(K + M,)`` the speed per turning rate of what is moved and of the bodies [m], if there are
    constants."""

    @abstractmethod
    def predict_with(
        self, effects: Sequence[FloatArray], constants: FloatArray | None = None
    ) -> EmbodiedPrediction:
        """Predict from the present state, believing in these effects, and in constants if given.

        The constants are logarithms, in units of what is believed without them.
        """


class PolicyMap(ABC):
    """What a team does in many places, to be looked at."""

    @abstractmethod
    def lines(self) -> Iterator[str]:
        """Yield it in words, a line each."""

    @abstractmethod
    def figure(self) -> Figure:
        """Draw it."""


class Scenario(ABC):
    """A world with a task. Everything a learner may know of it.

    Necessary are `agents`, `state_space`, `action_set`, `reset` and `step`; the rest has defaults.
    """

    agents: tuple[str, ...]
    """Names of the agents, in agent order."""
    state_space: StateSpace
    """The state variables of every agent."""
    action_set: ActionSet
    """The actions of every agent."""
    measures: tuple[Measure, ...] = ()
    """What is measured of an episode beside success, see `measures_of`. By `NO_SUCCESS` nothing is
    one, and returns are compared."""
    interactions: Sequence[tuple[int, int]] | None = None
    """Pairs of agents, by index, whose actions matter to each other: what a topology with ``shape =
    "scenario"`` joins."""
    horizon: int = 1
    """Decisions that its predictions look ahead, while nobody changes what it does after the first.
    By that a check judges how far they are off. Then all are neutral, unless it `repeats`."""
    repeats: bool = False
    """Whether in the decisions after the first all do the same again."""
    recorded: tuple[str, ...] = ()
    """Names of the measurements that are kept, one array ``(T + 1, ...)`` each."""

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The agents by body, consecutive; by default each is a body of its own."""
        return tuple((i,) for i in range(len(self.agents)))

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """The role of every agent; agents of one role may share weights. By default its name."""
        return tuple(self.agents)

    @cached_property
    def perceived(self) -> BoolArray:
        """Of which other bodies each agent perceives the state, ``(n, G)``: by default of all."""
        own = np.zeros((len(self.agents), len(self.groups)), dtype=bool)
        for body, group in enumerate(self.groups):
            own[list(group), body] = True
        return ~own

    @property
    def is_private(self) -> bool:
        """Whether agents perceive it each for itself, see `Prediction.of`."""
        return False

    @cached_property
    def bounds(self) -> FloatArray:
        """Between which states lie ``(d, 2)``."""
        return self.state_space.bounds

    @property
    def lacks_prediction(self) -> str:
        """Why it predicts nothing, if it does not."""
        return f"the scenario {type(self).__name__} has no method predict"

    @abstractmethod
    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return states ``(n, d)``.

        Everything random in it follows from `seed`; what is scheduled, from its number `episode`.
        """

    @abstractmethod
    def step(self, joint_action: IntArray) -> Transition:
        """Carry out a joint action ``(n,)`` for one decision period."""

    def environments(self, count: int) -> Environments | None:
        """Return many environments of equal settings, stepped in one call; None: not supported."""
        return None

    @property
    def predicts(self) -> bool:
        """Whether it has a `Prediction` to decide by."""
        return type(self).predict is not Scenario.predict

    def predict(self) -> Prediction | None:
        """Return the prediction from the present state; None: it predicts nothing."""
        return None

    def with_exact_prediction(self) -> Scenario | None:
        """Return the same with a predictor that makes no errors but those of rounding, or None.

        Itself, if it has one already. Then it can be checked that sensing and predicting mean the
        same.
        """
        return None

    def partners(self) -> Sequence[int] | None:
        """Return for every agent the one in whose place it stands in the mirror, None if unknown.

        Raises
        ------
        ValueError
            If an agent has none; one line.
        """
        return None

    def embodiment(self) -> Embodiment | None:
        """Return its bodies on wheels, if it has such."""
        return None

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state, as in `Transition.info`.

        It is asked for between steps, and before the first one, of what is `recorded`.
        """
        return {}

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return what is kept once an episode: numbers, texts, arrays."""
        return {}

    def show_policy(
        self,
        choose: Callable[[Prediction], IntArray],
        predict: Callable[[], Prediction | None],
    ) -> PolicyMap | None:
        """Return what those do who choose and predict so; None: it shows no policies.

        The scenario begins another episode.

        Parameters
        ----------
        choose
            Returns the joint action ``(n,)`` that they choose by a prediction.
        predict
            Returns what they predict from the scenario's present state.

        Raises
        ------
        ValueError
            If its predictions cannot begin anywhere; one line.
        """
        return None

    @property
    def draws(self) -> bool:
        """Whether recordings of its episodes can be drawn."""
        return bool(self.recorded) and type(self).animate is not Scenario.animate

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Draw a recording (arrays by name) as GIF or MP4, by the suffix of `path`."""
        raise ValueError(f"the scenario {type(self).__name__} draws no recordings")


def checked_scenario(thing: object) -> Scenario:
    """Return what a user's class or function has built, if it is a complete scenario.

    Raises
    ------
    ValueError
        If it is no `Scenario`, or lacks a necessary attribute; one line.
    """
    name = type(thing).__name__
    if not isinstance(thing, Scenario):
        hint = ""
        if hasattr(thing, "action_space"):
            kind = "pettingzoo" if hasattr(thing, "possible_agents") else "gymnasium"
            hint = f"; a spec names it by scenario.id, with scenario.kind = {kind!r}"
        raise ValueError(f"scenario.kind: {name} must inherit nested_agents.Scenario{hint}")
    missing = [key for key in ("agents", "state_space", "action_set") if not hasattr(thing, key)]
    if missing:
        raise ValueError(f"scenario.kind: {name} lacks {', '.join(missing)}")
    return thing


class Members(NamedTuple):
    """Some agents of a scenario."""

    scenario: Scenario
    members: IntArray
    """``(k,)`` who they are, in agent order."""

    def owners(self, *, shared: bool) -> list[str]:
        """Return whose weights there are, in order: those of agents, or of their roles."""
        names = self.scenario.roles if shared else tuple(self.scenario.agents)
        return list(dict.fromkeys(names[i] for i in self.members))

    @property
    def text(self) -> str:
        """How many of them there are over which state space."""
        return f"{len(self.members)} agents over {self.scenario.state_space.name!r}"


def rows_of(scenario: Scenario, members: IntArray, *, shared: bool) -> IntArray:
    """Return the row of weights of agents ``(k,)``: its own, or that of its role.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> three = LineUpSettings(carts=3).build()
    >>> rows_of(three, np.arange(3), shared=True).tolist()
    [0, 0, 0]
    >>> rows_of(three, np.arange(1, 3), shared=False).tolist()
    [0, 1]
    """
    owners = Members(scenario, members).owners(shared=shared)
    names = scenario.roles if shared else tuple(scenario.agents)
    return np.array([owners.index(names[i]) for i in members])


def carried_rows(former: Members, successor: Members, *, shared: bool) -> IntArray:
    """Return the row of weights of some agents that each row of others goes on from.

    Parameters
    ----------
    former, successor
        Those who learned, and those who follow.
    shared
        Whether weights are those of roles; if not, the agents must be the same.

    Returns
    -------
    IntArray
        ``(n_rows,)`` rows of the weights of `former`.

    Raises
    ------
    ValueError
        If state space, actions, or whose weights there are differ; one line.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> one, three = (LineUpSettings(carts=carts).build() for carts in (1, 3))
    >>> carried_rows(Members(one, np.arange(1)), Members(three, np.arange(3)), shared=True).tolist()
    [0]
    """
    problem = f"a team trained with {former.text} cannot act with {successor.text}"
    if former.scenario.state_space != successor.scenario.state_space:
        raise ValueError(f"{problem}: the state spaces differ")
    if former.scenario.action_set != successor.scenario.action_set:
        raise ValueError(f"{problem}: the actions differ")
    owners = former.owners(shared=shared)
    others = successor.owners(shared=shared)
    if set(owners) != set(others):
        raise ValueError(
            f"{problem}: their roles are {', '.join(owners)}, and {', '.join(others)}"
            if shared
            else f"{problem}: learner.weights = 'own'; with 'role', agents of a role share theirs"
        )
    return np.array([owners.index(owner) for owner in others])
