"""Signals: in every step, all agents name a state of which each has a private signal.

Before every step one of two states is drawn with equal probability. Every agent receives a private
signal, which equals the state with probability `accuracy`, independently of the other signals. Each
agent names a state. The vote of the team is the majority; a coin decides ties. An agent receives a
reward of 1 if it is right, or all agents receive 1 if the vote is right.

Messages about the decisions of others are the only information beside an agent's own signal, so
communication has a value, which `theory` computes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

import nested_agents as na

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

STATES = ("a", "b")
"""Possible states, which are also the signals and the actions."""


def _share(
    name: str, title: str, better: Literal["higher", "lower"] | None = "higher"
) -> na.Measure:
    return na.Measure(name, title, gathering="mean", better=better, least=0.0, greatest=1.0)


MEASURES = (
    na.Measure(na.SUCCESS.name, na.SUCCESS.title, source="vote", better="higher", is_rate=True),
    _share("right", "share right"),
    _share("vote", "vote right"),
    _share("last", "last agent right"),
    _share("followed", "against own signal", better=None),
)
"""Measures of an episode; it is a success if the vote of the last step is right."""


class SignalsSettings(na.ScenarioSettings):
    """Settings of the scenario `signals`."""

    kind: Literal["signals"] = "signals"
    factory: ClassVar[str] = f"{__name__}:Signals"
    players: Annotated[int, Field(ge=2, le=10_000)] = 8
    """Number of agents."""
    accuracy: Annotated[float, Field(gt=0.5, le=1.0)] = 0.7
    """Probability that a signal equals the state."""
    pays: Literal["own", "vote"] = "own"
    """Source of the reward: the own decision of an agent, or the vote of the team."""


class Plays(NamedTuple):
    """Random numbers of a step; leading axes ``...`` are those of environments."""

    states: BoolArray
    """Whether the state is b ``(...)``."""
    coins: BoolArray
    """Outcome of a tied vote ``(...)``."""
    signals: BoolArray
    """Whether the signal of an agent is b ``(..., n)``."""

    @classmethod
    def of(cls, draws: FloatArray, accuracy: float) -> Plays:
        """Return the play given by uniform random numbers ``(..., n + 2)`` in [0, 1).

        Examples
        --------
        >>> play = Plays.of(np.array([0.2, 0.7, 0.1, 0.9]), 0.7)
        >>> bool(play.states), bool(play.coins), play.signals.tolist()
        (True, False, [True, False])
        """
        states = draws[..., 0] < 0.5
        correct = draws[..., 2:] < accuracy
        return cls(states, draws[..., 1] < 0.5, correct == states[..., None])

    def right(self, named: IntArray) -> BoolArray:
        """Return whether each agent names the state ``(..., n)``."""
        return named.astype(bool) == self.states[..., None]

    def vote(self, named: IntArray) -> BoolArray:
        """Return whether the vote is right ``(...)``, given the named states ``(..., n)``."""
        twice = 2 * named.sum(axis=-1)
        n = named.shape[-1]
        voted = np.where(twice == n, self.coins, twice > n)
        return voted.astype(bool) == self.states

    @property
    def seen(self) -> FloatArray:
        """State of every agent, its own signal ``(..., n, 1)``."""
        return self.signals[..., None].astype(float)


class Signals(na.Scenario):
    """Agents name a state of which each has a private signal; there is no predictor.

    Parameters
    ----------
    settings
        Number of agents, accuracy and reward.

    Examples
    --------
    >>> scenario = SignalsSettings(players=3, accuracy=1.0).build()
    >>> signals = scenario.reset(0)
    >>> scenario.step(signals[:, 0].astype(int)).reward.tolist()
    [1.0, 1.0, 1.0]
    """

    measures = MEASURES

    def __init__(self, settings: SignalsSettings) -> None:
        self.settings = settings
        self.agents = tuple(f"agent{i + 1}" for i in range(settings.players))
        self.roles = ("player",) * settings.players
        self.action_set = na.ActionSet(STATES, (0.0, 0.0), (0.0, 0.0), neutral=0)
        self.state_space = na.StateSpace("signals", (na.choice("signal", STATES),), n_own=1)
        Signals.reset(self, 0)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Draw the first state and its signals."""
        self._rng = np.random.default_rng(seed)
        return self._advance()

    def step(self, joint_action: IntArray) -> na.Transition:
        """Compare the named states with the state, and draw the next one."""
        play = self._play
        right = play.right(joint_action)
        vote = float(play.vote(joint_action))
        info = {
            "right": float(right.mean()),
            "vote": vote,
            "last": float(right[-1]),
            "followed": float((joint_action.astype(bool) != play.signals).mean()),
        }
        reward = right.astype(float) if self.settings.pays == "own" else vote
        return na.Transition(self._advance(), reward, False, False, info)

    def environments(self, count: int) -> SignalEnvironments:
        """Return many environments, stepped in one call."""
        return SignalEnvironments(self, count)

    def _advance(self) -> FloatArray:
        draws = self._rng.random(self.settings.players + 2)
        self._play = Plays.of(draws, self.settings.accuracy)
        return self._play.seen


class SignalEnvironments(na.Environments):
    """Many environments of signals; each gives the same bits as a single one.

    Parameters
    ----------
    scenario
        Scenario of all environments.
    count
        Number of environments.

    Examples
    --------
    >>> environments = SignalEnvironments(SignalsSettings(players=3, pays="vote").build(), 2)
    >>> environments.reset([np.random.SeedSequence(seed) for seed in (0, 1)]).shape
    (2, 3, 1)
    >>> environments.step(np.zeros((2, 3), dtype=int)).rewards.shape
    (2, 3)
    """

    def __init__(self, scenario: Signals, count: int) -> None:
        self.scenario: Signals = scenario
        self.count = count
        self._generators = [np.random.default_rng(0) for _ in range(count)]
        self._draws: FloatArray = np.zeros((count, scenario.settings.players + 2))

    def begin(
        self, places: Sequence[int], seeds: Sequence[np.random.SeedSequence], first_episode: int
    ) -> FloatArray:
        """Start an episode in some environments."""
        for place, seed in zip(places, seeds, strict=True):
            self._generators[place] = np.random.default_rng(seed)
        return self._advance(places)[np.asarray(places)]

    def step(self, joint_actions: IntArray) -> na.Transitions:
        """Step all environments by joint actions ``(E, n)``."""
        plays = self.plays
        right = plays.right(joint_actions).astype(float)
        vote = plays.vote(joint_actions).astype(float)
        is_own = self.scenario.settings.pays == "own"
        never = np.zeros(self.count, dtype=bool)
        return na.Transitions(
            states=self._advance(range(self.count)),
            rewards=right if is_own else np.broadcast_to(vote[:, None], right.shape),
            terminated=never,
            truncated=never,
        )

    def _advance(self, places: Sequence[int]) -> FloatArray:
        for place in places:
            self._draws[place] = self._generators[place].random(self._draws.shape[1])
        self.plays = Plays.of(self._draws, self.scenario.settings.accuracy)
        """Next step of every environment."""
        return self.plays.seen
