"""Signals: a step is a play, in which all agents must name a state of which each has a signal.

Before every play one of two states is drawn, with equal probability. Every agent gets a private
signal, which is the state with probability `accuracy`, independently of others. Each names a state.
The team's vote is what most have named; where as many name either, a coin decides. An agent is paid
1 if it is right, or all are paid 1 if the vote is.

Nothing but what agents are told of the others' decisions can tell them more than their own signal:
here information is private, and a message is worth something. `theory` has the numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...core.interface.environments import Environments, Transitions
from ...core.interface.measures import SUCCESS, Measure
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet, StateSpace, choice
from ...core.numerics import BoolArray, FloatArray, IntArray
from ...core.plugins.settings import ScenarioSettings

STATES = ("a", "b")
"""What the state may be; actions name it, and signals are of it."""


def _share(name: str, title: str, better: Literal["higher", "lower"] | None = "higher") -> Measure:
    return Measure(name, title, gathering="mean", better=better, least=0.0, greatest=1.0)


MEASURES = (
    Measure(SUCCESS.name, SUCCESS.title, source="vote", better="higher", is_rate=True),
    _share("right", "share right"),
    _share("vote", "vote right"),
    _share("last", "last agent right"),
    _share("followed", "against own signal", better=None),
)
"""What is measured of plays: success is that the vote was right in the last one of an episode."""


class SignalsSettings(ScenarioSettings):
    """Agents that must name a state, of which each has a noisy signal of its own."""

    kind: Literal["signals"] = "signals"
    factory: ClassVar[str] = f"{__name__}:Signals"
    players: Annotated[int, Field(ge=2, le=10_000)] = 8
    """Number of agents."""
    accuracy: Annotated[float, Field(gt=0.5, le=1.0)] = 0.7
    """Probability with which a signal is the state."""
    pays: Literal["own", "vote"] = "own"
    """Whether an agent is paid for what it names itself, or all for the vote of the team."""


class Plays(NamedTuple):
    """Plays of several worlds, or of one: leading axes ``...`` are those of worlds."""

    states: BoolArray
    """``(...)`` whether the state is b."""
    coins: BoolArray
    """``(...)`` what a tied vote says."""
    signals: BoolArray
    """``(..., n)`` whether an agent's signal is b."""

    @classmethod
    def of(cls, draws: FloatArray, accuracy: float) -> Plays:
        """Return the plays that numbers ``(..., n + 2)`` between 0 and 1 stand for.

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
        """Return which agents ``(..., n)`` name the state."""
        return named.astype(bool) == self.states[..., None]

    def vote(self, named: IntArray) -> BoolArray:
        """Return whether the vote ``(...)`` of what agents ``(..., n)`` name is right."""
        twice = 2 * named.sum(axis=-1)
        n = named.shape[-1]
        voted = np.where(twice == n, self.coins, twice > n)
        return voted.astype(bool) == self.states

    @property
    def seen(self) -> FloatArray:
        """The states ``(..., n, 1)`` of agents: each its own signal."""
        return self.signals[..., None].astype(float)


class Signals(Scenario):
    """Agents that must name a state, which is not predicted.

    Parameters
    ----------
    settings
        See `SignalsSettings`.

    Examples
    --------
    >>> world = SignalsSettings(players=3, accuracy=1.0).build()
    >>> signals = world.reset(0)
    >>> world.step(signals[:, 0].astype(int)).reward.tolist()
    [1.0, 1.0, 1.0]
    """

    measures = MEASURES

    def __init__(self, settings: SignalsSettings) -> None:
        self.settings = settings
        self.agents = tuple(f"agent{i + 1}" for i in range(settings.players))
        self.roles = ("player",) * settings.players
        self.action_set = ActionSet(STATES, (0.0, 0.0), (0.0, 0.0), neutral=0)
        self.state_space = StateSpace("signals", (choice("signal", STATES),), n_own=1)
        Signals.reset(self, 0)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Begin with the first play."""
        self._rng = np.random.default_rng(seed)
        return self._advance()

    def step(self, joint_action: IntArray) -> Transition:
        """Play once."""
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
        return Transition(self._advance(), reward, False, False, info)

    def environments(self, count: int) -> SignalEnvironments:
        """Return many such worlds, played in one call."""
        return SignalEnvironments(self, count)

    def _advance(self) -> FloatArray:
        draws = self._rng.random(self.settings.players + 2)
        self._play = Plays.of(draws, self.settings.accuracy)
        return self._play.seen


class SignalEnvironments(Environments):
    """Many worlds of signals, played in one call; each has the bits that it has by itself.

    Parameters
    ----------
    scenario
        What all of them are.
    count
        How many there are.

    Examples
    --------
    >>> worlds = SignalEnvironments(SignalsSettings(players=3, pays="vote").build(), 2)
    >>> worlds.reset([np.random.SeedSequence(seed) for seed in (0, 1)]).shape
    (2, 3, 1)
    >>> worlds.step(np.zeros((2, 3), dtype=int)).rewards.shape
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
        """Begin with the first play in some worlds."""
        for place, seed in zip(places, seeds, strict=True):
            self._generators[place] = np.random.default_rng(seed)
        return self._advance(places)[np.asarray(places)]

    def step(self, joint_actions: IntArray) -> Transitions:
        """Play once in every world."""
        plays = self.plays
        right = plays.right(joint_actions).astype(float)
        vote = plays.vote(joint_actions).astype(float)
        is_own = self.scenario.settings.pays == "own"
        never = np.zeros(self.count, dtype=bool)
        return Transitions(
            states=self._advance(range(self.count)),
            rewards=right if is_own else np.broadcast_to(vote[:, None], right.shape),
            terminated=never,
            truncated=never,
        )

    def _advance(self, places: Sequence[int]) -> FloatArray:
        for place in places:
            self._draws[place] = self._generators[place].random(self._draws.shape[1])
        self.plays = Plays.of(self._draws, self.scenario.settings.accuracy)
        """What is played next."""
        return self.plays.seen
