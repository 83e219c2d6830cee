"""Interface of scenarios, environments with a task, and the transitions that they return.

Arrays follow the conventions of `spaces`. Scenarios inherit from `Scenario`, which has what every
scenario needs. Optional abilities are protocols, see `nested_agents.core.interface.abilities`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from copy import copy, deepcopy
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any, TypeVar

import numpy as np

from ..numerics import FloatArray, IntArray
from .measures import Measure
from .prediction import UNPREDICTED, Prediction
from .spaces import ActionSet, StateSpace

T = TypeVar("T")


@dataclass(frozen=True)
class Transition:
    """Result of one step of a scenario."""

    states: FloatArray
    """``(n, d)`` states of the agents after the step."""
    reward: float | FloatArray
    """Reward received on entering these states: one number for all agents, or ``(n,)``."""
    terminated: bool
    """Whether the task is solved, or lost, for good."""
    truncated: bool
    """Whether the episode ends for lack of time."""
    info: Mapping[str, Any]
    """Measurements by name, scalars or small arrays. They are recorded; learners ignore them."""
    twists: FloatArray | Callable[[], FloatArray | None] | None = None
    """``(M, 3)`` mean twist of every body in its own frame [m/s, m/s, rad/s], or a function that
    measures them; None without bodies. ``(K + M, 3)`` if the twists of K moved objects are
    measured, too. These come first, and only the bodies may have moved the objects."""
    absorbing: bool = True
    """Whether a terminal state is repeated forever, with its reward, like a box at its goal. If
    not, its reward is received once, as in Gymnasium."""

    def measured_twists(self) -> FloatArray | None:
        """Return the twists, which a function may have to measure."""
        return self.twists() if callable(self.twists) else self.twists


def checked_transition(transition: object, space: StateSpace, agents: Sequence[str]) -> Transition:
    """Return a checked copy of a transition; scenarios may reuse their arrays.

    Raises
    ------
    ValueError
        If it is no `Transition`, or its states or its reward are invalid; one line.
    """
    if not isinstance(transition, Transition):
        given = type(transition).__name__
        raise ValueError(f"step returns {given}, allowed: nested_agents.Transition")
    return Transition(
        states=space.checked(transition.states, agents),
        reward=checked_reward(transition.reward, agents),
        terminated=bool(transition.terminated),
        truncated=bool(transition.truncated),
        info={name: _copied(value) for name, value in transition.info.items()},
        twists=_copied(transition.twists),
        absorbing=bool(transition.absorbing),
    )


def _copied(value: T) -> T:
    """Return a copy of a mutable value."""
    return deepcopy(value) if isinstance(value, np.ndarray | list | dict) else value


def checked_reward(reward: object, agents: Sequence[str]) -> float | FloatArray:
    """Return a checked copy of a reward.

    Raises
    ------
    ValueError
        If it is neither a finite number nor one for each agent.
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


class Scenario(ABC):
    """An environment with a task.

    Required are `agents`, `state_space`, `action_set`, `reset` and `step`. The other members have
    defaults. Further abilities are the protocols of `nested_agents.core.interface.abilities`.
    """

    agents: tuple[str, ...]
    """Names of the agents, in agent order."""
    state_space: StateSpace
    """The state variables of every agent."""
    action_set: ActionSet
    """The actions of every agent."""
    measures: tuple[Measure, ...] = ()
    """Measures of an episode in addition to success, see `measures_of`. With `NO_SUCCESS`, returns
    are compared."""

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the agents of every body, consecutive; by default each agent is a body."""
        return tuple((i,) for i in range(len(self.agents)))

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """Role of every agent, by default its name. Agents of one role can share weights."""
        return tuple(self.agents)

    @property
    def lacks_prediction(self) -> str:
        """Reason why `predict` returns no prediction; empty if it returns one."""
        is_missing = type(self).predict is Scenario.predict
        return f"the scenario {type(self).__name__} has no method predict" if is_missing else ""

    @abstractmethod
    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return states ``(n, d)``.

        All random numbers of the episode follow from `seed`, scheduled events from `episode`.
        """

    @abstractmethod
    def step(self, joint_action: IntArray) -> Transition:
        """Execute a joint action ``(n,)`` for one decision period."""

    def predict(self) -> Prediction | None:
        """Return the prediction from the present state, or None without a predictor."""
        return None


class ScenarioWrapper(Scenario):
    """A scenario with the agents of another one, of which it changes a part.

    The other abilities of the wrapped scenario are found by `unwrapped`.

    Parameters
    ----------
    scenario
        The wrapped scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.agents = tuple(scenario.agents)
        self.state_space = scenario.state_space
        self.action_set = scenario.action_set
        self.measures = scenario.measures
        self.groups = scenario.groups
        self.roles = scenario.roles

    @property
    def lacks_prediction(self) -> str:
        """Reason why the wrapped scenario has no prediction."""
        return self.scenario.lacks_prediction

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode."""
        return self.scenario.reset(seed, episode)

    def step(self, joint_action: IntArray) -> Transition:
        """Execute a joint action."""
        return self.scenario.step(joint_action)

    def predict(self) -> Prediction | None:
        """Return the prediction of the wrapped scenario."""
        return self.scenario.predict()


def unwrapped(scenario: Scenario) -> Scenario:
    """Return a scenario without wrappers, to ask for the abilities that wrappers do not change."""
    while isinstance(scenario, ScenarioWrapper):
        scenario = scenario.scenario
    return scenario


def prediction_of(scenario: Scenario) -> Prediction:
    """Return the prediction from the present state; `UNPREDICTED` without a predictor.

    It is another object at every call, also of scenarios that predict themselves, unless it is
    constant: agents share what an object has predicted.

    Raises
    ------
    ValueError
        If the scenario returns something else than a prediction or None; one line.
    """
    prediction: object = scenario.predict()
    if prediction is None:
        return UNPREDICTED
    if isinstance(prediction, Prediction):
        if prediction.is_constant:
            return prediction
        if prediction.is_given:
            return copy(prediction)
        object.__setattr__(prediction, "is_given", True)  # also of a frozen dataclass
        return prediction
    raise ValueError(
        f"scenario.predict() returned {type(prediction).__name__}, allowed: None or an instance of "
        "nested_agents.Prediction"
    )


REQUIRED_WITH = {"recorded": "measure", "animate": "constants_of_episode"}
"""Members of optional abilities, and the members without which they have no effect."""


def checked_scenario(thing: object) -> Scenario:
    """Return what a user's class or function has built, if it is a complete scenario.

    Raises
    ------
    ValueError
        If it is no `Scenario`, or lacks a necessary attribute or a part of an ability; one line.
    """
    name = type(thing).__name__
    if not isinstance(thing, Scenario):
        hint = ""
        if not _lacking(thing, "action_space"):
            kind = "gymnasium" if _lacking(thing, "possible_agents") else "pettingzoo"
            hint = f"; a spec names it by scenario.id, with scenario.kind = {kind!r}"
        raise ValueError(f"scenario.kind: {name} must inherit nested_agents.Scenario{hint}")
    if missing := _lacking(thing, "agents", "state_space", "action_set"):
        raise ValueError(f"scenario.kind: {name} lacks {', '.join(missing)}")
    for member, needed in REQUIRED_WITH.items():
        if _lacking(thing, member, needed) == [needed]:
            raise ValueError(f"scenario.kind: {name} has {member}, and lacks {needed}")
    return thing


def _lacking(thing: object, *members: str) -> list[str]:
    """Return the members that a user's object does not have."""
    return [member for member in members if not hasattr(thing, member)]


def has_same_agents(scenario: Scenario, other: Scenario) -> bool:
    """Return whether agents of one scenario can act in another one as they are."""
    return (
        tuple(scenario.agents) == tuple(other.agents)
        and scenario.roles == other.roles
        and scenario.state_space == other.state_space
        and scenario.action_set == other.action_set
    )


def owners_of(scenario: Scenario, members: IntArray, *, shared: bool) -> list[str]:
    """Return the owner of each agent's weights: the agent, or its role if weights are shared."""
    names = scenario.roles if shared else tuple(scenario.agents)
    return [names[i] for i in members]


def rows_of(scenario: Scenario, members: IntArray, *, shared: bool) -> IntArray:
    """Return the index ``(k,)`` of every agent's row of weights, its own or that of its role.

    Examples
    --------
    >>> from nested_agents.scenarios.line_up import LineUpSettings
    >>> three = LineUpSettings(carts=3).build()
    >>> rows_of(three, np.arange(3), shared=True).tolist()
    [0, 0, 0]
    >>> rows_of(three, np.arange(1, 3), shared=False).tolist()
    [0, 1]
    """
    owners = owners_of(scenario, members, shared=shared)
    rows = list(dict.fromkeys(owners))
    return np.array([rows.index(owner) for owner in owners])


def check_transfer(former: Scenario, successor: Scenario, problem: str = "") -> None:
    """Refuse agents of one scenario in another one that has other states or actions.

    Raises
    ------
    ValueError
        If state spaces or actions differ, or there is another `problem`; one line.
    """
    if former.state_space != successor.state_space:
        problem = "the state spaces differ"
    elif former.action_set != successor.action_set:
        problem = "the actions differ"
    if problem:
        there, here = (
            f"{len(s.agents)} agents over {s.state_space.name!r}" for s in (former, successor)
        )
        raise ValueError(f"a team trained with {there} cannot act with {here}: {problem}")


def carried_rows(owners: Sequence[str], others: Sequence[str], *, shared: bool) -> IntArray:
    """Return the former row of weights from which each row of other agents starts.

    Parameters
    ----------
    owners, others
        Owner of the weights of each trained agent, and of each other agent, see `owners_of`.
    shared
        Whether roles share weights. If not, the agents must be the same.

    Returns
    -------
    IntArray
        ``(n_rows,)`` indices of rows of the trained agents.

    Raises
    ------
    ValueError
        If the owners of the weights differ; one line.

    Examples
    --------
    >>> carried_rows(["left", "right"], ["right", "left", "right"], shared=True).tolist()
    [1, 0]
    """
    rows, new_rows = list(dict.fromkeys(owners)), list(dict.fromkeys(others))
    if {*rows} != {*new_rows} and shared:
        raise ValueError(
            f"learner.weights = 'role': the trained weights are those of {', '.join(rows)}; the "
            f"roles here are {', '.join(new_rows)}"
        )
    if {*rows} != {*new_rows}:
        raise ValueError(
            f"learner.weights = 'own': the {len(rows)} agents that were trained are not the "
            f"{len(new_rows)} agents here; with 'role', agents of a role share theirs"
        )
    return np.array([rows.index(owner) for owner in new_rows])
