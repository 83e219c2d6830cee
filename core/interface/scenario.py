"""What a learner may know of the world: what a scenario promises, and what a step of it returns.

A scenario also declares what is measured of an episode: the columns of results. Conventions are
those of `spaces`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from ..numerics import FloatArray, IntArray
from .spaces import ActionSet, StateSpace


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
    twists: FloatArray | None = None
    """``(M, 3)`` mean twist of every group's body in its own frame [m/s, m/s, rad/s], where bodies
    measure it; ``(K + M, 3)`` where they also measure what they move, its twists standing first,
    and nothing else than these bodies moved it."""
    absorbing: bool = True
    """Whether a terminal state is as if entered again for ever, as where a box stands at its goal;
    if not, its reward is received once, as in Gymnasium."""


def check_reward(reward: object, agents: Sequence[str]) -> None:
    """Check that the reward of some agents can be learned from.

    Raises
    ------
    ValueError
        If it is neither a finite number nor one for each of them.
    """
    array = np.asarray(reward)
    is_numeric = array.dtype.kind in "biuf" and array.shape in ((), (len(agents),))
    if not (is_numeric and np.isfinite(array).all()):
        raise ValueError(
            f"reward = {reward!r:.60}, allowed: a finite number, or one for each of "
            f"{len(agents)} agents"
        )


@runtime_checkable
class Scenario(Protocol):
    """A world with a task. Everything a learner may know of it.

    What else it may have is asked for by `groups_of`, `roles_of` and `measures_of`, which know what
    holds without; by `RecordedScenario` and `EmbodiedScenario`; and by name:

    ``predict()``
        The `Prediction` from the present state: what learners decide by whose settings say
        `needs_prediction`.
    ``measure()``
        See `RecordedScenario`; asked for alone where a scenario is checked.
    ``interactions``
        Pairs of agents, by index, whose actions matter to each other: what a topology with ``shape
        = "scenario"`` joins.
    ``partners()``
        For every agent the one in whose place it stands in the mirror, or a ValueError of one line
        if an agent has none: experience can be mirrored, see `core.adaptation.predictors`.
    ``horizon``
        Decisions that its predictions look ahead, while nobody changes what it does after the
        first; 1 without. By that a check judges how far they are off. Then all are neutral; where
        it ``repeats``, all do the same again.
    ``with_exact_prediction()``
        The same scenario with a predictor that makes no errors but those of rounding; itself, if it
        has one already. Then it can be checked that sensing and predicting mean the same.
    ``run_episode(team, seed, episode, steps, learn=...)``
        A whole episode of a team at once, compiled, see `core.agents.loop.EpisodeSummary`.
    """

    @property
    def agents(self) -> tuple[str, ...]:
        """Names of the agents, in agent order."""

    @property
    def state_space(self) -> StateSpace:
        """The state variables of every agent."""

    @property
    def action_set(self) -> ActionSet:
        """The actions of every agent."""

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return states ``(n, d)``.

        Everything random in it follows from `seed`; what is scheduled, from its number `episode`.
        """

    def step(self, joint_action: IntArray) -> Transition:
        """Carry out a joint action ``(n,)`` for one decision period."""


@runtime_checkable
class RecordedScenario(Scenario, Protocol):
    """A scenario whose episodes are worth keeping step by step.

    If it has ``animate(recording, path)``, too, a recording (arrays by name) can be drawn, as GIF
    or MP4 by the suffix of ``path``; `can_draw` asks for it.
    """

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state, as in `Transition.info`.

        It is asked for between steps, and before the first one.
        """

    @property
    def recorded(self) -> tuple[str, ...]:
        """Names of the measurements that are kept, one array ``(T + 1, ...)`` each."""

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return what is kept once an episode: numbers, texts, arrays."""


class EpisodeRecorder:
    """Collects the recording of one episode.

    Parameters
    ----------
    scenario
        As it is before the first step, which no transition describes; another instance than the one
        that steps may be given, if it is in the same state.
    """

    def __init__(self, scenario: RecordedScenario) -> None:
        opening = scenario.measure()
        self._frames = {name: [np.array(opening[name])] for name in scenario.recorded}
        constants = scenario.constants_of_episode()
        self._constants = {name: np.array(value) for name, value in constants.items()}
        self._rewards: list[FloatArray] = []

    def add(self, transition: Transition) -> None:
        """Take in one step."""
        for name, frames in self._frames.items():
            frames.append(np.array(transition.info[name]))
        self._rewards.append(np.array(transition.reward, dtype=float))

    def recording(self) -> dict[str, Any]:
        """Return what was recorded, arrays by name."""
        arrays = {name: np.stack(frames) for name, frames in self._frames.items()}
        return arrays | {"reward": np.array(self._rewards)} | self._constants


@runtime_checkable
class EmbodiedScenario(Scenario, Protocol):
    """A scenario whose groups are bodies on wheels, open to self-models.

    If its predictions rest on positive constants that can be calibrated, it also has their names
    ``constants`` (none if the present predictor has none), and ``levers`` ``(K + M,)``, the speed
    per turning rate of what is moved and of the bodies [m].
    """

    @property
    def nominal_effects(self) -> tuple[FloatArray, ...]:
        """Per body the ``(3, w + 1)`` effect of its wheel speeds on its twist."""

    def predict_with(
        self, effects: Sequence[FloatArray], constants: FloatArray | None = None
    ) -> Any:
        """Predict from the present state, believing in these effects, and in constants if given.

        The constants are logarithms, in units of what is believed without them. The prediction has

        ``groups``
            Agents by body.
        ``commands(joint_action)``
            The wheel speeds ``(n,)`` that a joint action ``(n,)`` would command.
        ``slips(joint_action)``
            By how much contact is predicted to change the bodies' twists, ``(M, 3)``.
        ``outcomes(joint_action, constants)``
            Where there are constants: what a joint action would lead to under each of ``k`` choices
            of them ``(k, c)``, as mean twists ``(k, K + M, 3)`` of what is moved, and then of the
            bodies, see `Transition.twists`.
        """


def lacking(scenario: object) -> str:
    """Return what of `Scenario` an object has not, in words; nothing if it has all."""
    members = ("agents", "state_space", "action_set", "reset", "step")
    missing = ", ".join(name for name in members if not hasattr(scenario, name))
    return f"{type(scenario).__name__} lacks {missing}" if missing else ""


def can_draw(scenario: Scenario) -> bool:
    """Return whether recordings of a scenario's episodes can be drawn."""
    return isinstance(scenario, RecordedScenario) and hasattr(scenario, "animate")


def groups_of(scenario: Scenario) -> tuple[tuple[int, ...], ...]:
    """Return the agents by body, consecutive; of a scenario without ``groups``, each alone."""
    return getattr(scenario, "groups", tuple((i,) for i in range(len(scenario.agents))))


def roles_of(scenario: Scenario) -> tuple[str, ...]:
    """Return the role of every agent: agents of one role may share weights.

    Of a scenario without ``roles``, every agent has its own.
    """
    return getattr(scenario, "roles", tuple(scenario.agents))


def rows_of(scenario: Scenario, *, shared: bool) -> IntArray:
    """Return the row of weights of every agent ``(n,)``: its own, or that of its role.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> three = SimpleNamespace(agents=("a.left", "a.right", "b.left"), roles=("l", "r", "l"))
    >>> rows_of(three, shared=True).tolist(), rows_of(three, shared=False).tolist()
    ([0, 1, 0], [0, 1, 2])
    """
    owners = roles_of(scenario) if shared else tuple(scenario.agents)
    names = list(dict.fromkeys(owners))
    return np.array([names.index(owner) for owner in owners])


def carried_rows(former: Scenario, scenario: Scenario, *, shared: bool) -> IntArray:
    """Return the row of weights of a scenario's team that each row of another's goes on from.

    Parameters
    ----------
    former, scenario
        The scenario that was learned in, and the one that follows.
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
    >>> carried_rows(one, three, shared=True).tolist()
    [0]
    """
    trained, acting = (
        f"{len(s.agents)} agents over {s.state_space.name!r}" for s in (former, scenario)
    )
    problem = f"a team trained with {trained} cannot act with {acting}"
    if former.state_space != scenario.state_space:
        raise ValueError(f"{problem}: the state spaces differ")
    if former.action_set != scenario.action_set:
        raise ValueError(f"{problem}: the actions differ")
    owners, others = (
        list(dict.fromkeys(roles_of(s) if shared else s.agents)) for s in (former, scenario)
    )
    if set(owners) != set(others):
        raise ValueError(
            f"{problem}: their roles are {', '.join(owners)}, and {', '.join(others)}"
            if shared
            else f"{problem}: learner.weights = 'own'; with 'role', agents of a role share theirs"
        )
    return np.array([owners.index(owner) for owner in others])


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


@dataclass(frozen=True)
class Measure:
    """A number that describes an episode: a column of results."""

    name: str
    """Of the column; ``success`` is the one by which scenarios are compared."""
    title: str
    """Its heading in tables and figures."""
    unit: str = "1"
    """In words of the SI, ``"1"`` for a pure number."""
    source: str = ""
    """Where it is taken from at every step: a key of `Transition.info`, or ``terminated``; empty:
    the key of its own name."""
    gathering: Literal["last", "mean", "sum", "max"] = "last"
    """How the steps of an episode make one number: their ``last``, ``mean``, ``sum`` or ``max``."""
    better: Literal["higher", "lower"] | None = None
    """Which way is better, if one is."""
    is_rate: bool = False
    """Whether an episode has it or has it not: 1 or 0."""
    least: float | None = None
    """What it cannot be below, if there is such; intervals end there."""
    greatest: float | None = None
    """What it cannot be above, if there is such; intervals end there."""

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


def measures_of(scenario: Scenario) -> tuple[Measure, ...]:
    """Return what is measured of an episode of a scenario, success first.

    Of a scenario without ``measures`` it is success alone, see `SUCCESS`.
    """
    declared: tuple[Measure, ...] = tuple(getattr(scenario, "measures", ()))
    own = [m for m in declared if m.name == SUCCESS.name] or [SUCCESS]
    return (*own, *(m for m in declared if m.name != SUCCESS.name))
