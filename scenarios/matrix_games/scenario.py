"""Repeated matrix games, in which a step is one play.

The payoff and the next state depend on the joint action only. The state of an agent holds the last
actions of all agents, its own action, or its own and those of the agents listed before it.
Membership functions are centered at the actions, so that a rule base of full order is a table with
one value for each combination of actions.

The games are those of Claus and Boutilier (1998) and of Kapetanakis and Kudenko (2002). All agents
receive the same payoff and must find the joint action with the maximum expected payoff. Rows are
the actions of the first agent, columns those of the second::

    climbing    a    b    c        penalty     a    b    c
           a   11  -30    0               a   10    0    k
           b  -30    7    6               b    0    2    0
           c    0    0    5               c    k    0   10

Climbing punishes an agent that plays its part of the optimum (a, a) alone. The penalty game has two
optima, which must not be mixed. In the stochastic games, a joint action pays one of two amounts
with equal probability, with the same means as in climbing.

The game for three agents is not from these papers. It pays the minimum of climbing over all pairs
of agents: 11 if all play a, 7 if all play b, 5 if all play c.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from ...core.interface.environments import Transitions
from ...core.interface.measures import SUCCESS, Measure
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet, StateSpace, choice
from ...core.interface.stacked import StackedEnvironments
from ...core.numerics import FloatArray, IntArray
from ...core.plugins.settings import ScenarioSettings
from ...core.plugins.words import closest

OPTIMALITY = (
    Measure(SUCCESS.name, SUCCESS.title, source="optimal", better="higher", is_rate=True),
    Measure(
        "optimal_plays",
        "optimal plays",
        source="optimal",
        gathering="mean",
        better="higher",
        least=0.0,
        greatest=1.0,
    ),
)
"""Measures of every game. An episode is a success if its last play is optimal."""
CLIMBING = ((11, -30, 0), (-30, 7, 6), (0, 0, 5))
PARTIALLY_STOCHASTIC = ((11, -30, 0), (-30, (14, 0), 6), (0, 0, 5))
STOCHASTIC = (
    ((10, 12), (5, -65), (8, -8)), ((5, -65), (14, 0), (12, 0)), ((5, -5), (5, -5), (7, 3)),
)  # fmt: skip


def payoffs_of(game: str) -> FloatArray:
    """Return the two equally probable payoffs ``(2, A, ..., A)`` of each joint action of a game.

    Parameters
    ----------
    game
        A name in `GAMES`, or ``"penalty:k"`` with a number k.

    Raises
    ------
    ValueError
        If the game is unknown, or k is not a finite number.

    Examples
    --------
    >>> payoffs_of("penalty:-100")[0].tolist()
    [[10.0, 0.0, -100.0], [0.0, 2.0, 0.0], [-100.0, 0.0, 10.0]]
    """
    name, colon, argument = game.partition(":")
    if name not in GAMES:
        raise ValueError(closest(name, [n if n != "penalty" else "penalty:K" for n in GAMES]))
    if (name == "penalty") != bool(colon):
        raise ValueError("penalty is written penalty:K with a number K, other games without")
    return GAMES[name](argument)


def payoff_pairs(table: Sequence[Sequence[float | tuple[float, float]]]) -> FloatArray:
    """Return the payoffs ``(2, A, A)`` of a table of numbers, or of pairs of numbers.

    >>> payoff_pairs([[1, (0, 4)], [0, 3]]).mean(axis=0).tolist()
    [[1.0, 2.0], [0.0, 3.0]]
    """
    pairs = [[e if isinstance(e, tuple) else (e, e) for e in row] for row in table]
    return np.moveaxis(np.array(pairs, dtype=float), -1, 0).copy()


def optimal(payoffs: FloatArray) -> FloatArray:
    """Return 1 for joint actions ``(A, ..., A)`` with the maximum expected payoff, else 0."""
    expected = payoffs.mean(axis=0)
    return (expected == expected.max()).astype(float)


def _penalty(argument: str) -> FloatArray:
    try:
        k = float(argument)
    except ValueError:
        raise ValueError(f"K = {argument!r}: must be a number") from None
    if not isfinite(k):
        raise ValueError(f"K = {argument}: must be finite")
    return payoff_pairs([[10, 0, k], [0, 2, 0], [k, 0, 10]])


def _three(argument: str) -> FloatArray:
    of_pair = np.array(CLIMBING, dtype=float)
    digits = np.indices((3, 3, 3))
    least = np.min([of_pair[digits[i], digits[j]] for i, j in combinations(range(3), 2)], axis=0)
    return np.stack([least, least])


GAMES: dict[str, Callable[[str], FloatArray]] = {
    "climbing": lambda _: payoff_pairs(CLIMBING),
    "penalty": _penalty,
    "partially-stochastic-climbing": lambda _: payoff_pairs(PARTIALLY_STOCHASTIC),
    "stochastic-climbing": lambda _: payoff_pairs(STOCHASTIC),
    "three-agents": _three,
}
"""Functions that return the payoffs, given the text after the colon, by name."""


MAX_ACTIONS = 26
"""Maximum number of actions, which are named by letters."""


def _known(game: str) -> str:
    payoffs_of(game)
    return game


Row = Annotated[tuple[float, ...], Field(min_length=2, max_length=MAX_ACTIONS)]


class MatrixGameSettings(ScenarioSettings):
    """A repeated matrix game."""

    kind: Literal["matrix-game"] = "matrix-game"
    game: Annotated[str, AfterValidator(_known)] = "climbing"
    """``climbing``, ``penalty:K`` with a number K, ``partially-stochastic-climbing``,
    ``stochastic-climbing`` or ``three-agents``."""
    payoffs: Annotated[tuple[Row, ...], Field(min_length=2, max_length=MAX_ACTIONS)] | None = None
    """Square table of payoffs of another game for two agents, instead of `game`."""
    observed: Literal["joint", "own", "above"] = "joint"
    """Actions in the state of an agent: those of all agents, its own, or its own and those of the
    agents listed before it."""

    factory: ClassVar[str] = f"{__name__}:MatrixGame"


class MatrixGame(Scenario, Prediction):
    """A matrix game, which is also its own prediction.

    Parameters
    ----------
    settings
        See `MatrixGameSettings`.

    Raises
    ------
    ValueError
        If the table of payoffs is not square.

    Examples
    --------
    >>> game = MatrixGameSettings(game="climbing").build()
    >>> _ = game.reset(0)
    >>> game.step(np.array([0, 0])).reward, game.step(np.array([0, 1])).reward
    (11.0, -30.0)
    """

    is_constant = True
    measures = (*OPTIMALITY, Measure("payoff", "mean payoff", gathering="mean", better="higher"))

    def __init__(self, settings: MatrixGameSettings) -> None:
        table = settings.payoffs
        if table is not None and any(len(row) != len(table) for row in table):
            lengths = ", ".join(str(len(row)) for row in table)
            raise ValueError(
                f"scenario.payoffs: {len(table)} rows of {lengths} numbers, must be square"
            )
        self.payoffs = payoffs_of(settings.game) if table is None else payoff_pairs(table)
        """Two equally probable payoffs of every joint action ``(2, A, ..., A)``."""
        self.optimal = optimal(self.payoffs)
        self.is_stochastic = bool((self.payoffs[0] != self.payoffs[1]).any())
        n = self.payoffs.ndim - 1
        n_actions = self.payoffs.shape[1]
        names = tuple("abcdefghijklmnopqrstuvwxyz"[:n_actions])
        self.agents = tuple(f"agent{i + 1}" for i in range(n))
        self.action_set = ActionSet(names, (0.0,) * n_actions, (0.0,) * n_actions, neutral=0)
        self.observed = settings.observed
        self.state_space = _state_space(self.agents, names, settings.observed)
        MatrixGame.reset(self, 0)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode after a random joint action."""
        self.rng = np.random.default_rng(seed)
        before = self.rng.integers(0, len(self.action_set), size=len(self.agents))
        self.present = self.states_after(before)
        return self.present

    def play(
        self, rngs: Sequence[np.random.Generator], states: FloatArray, joint_actions: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the next states ``(W, n, d)`` and the payoffs ``(W,)`` of ``W`` environments."""
        drawn = [rng.integers(0, 2) for rng in rngs] if self.is_stochastic else 0
        return self.states_after(joint_actions), self.payoffs[(drawn, *joint_actions.T)]

    def step(self, joint_action: IntArray) -> Transition:
        """Play once."""
        states, payoffs = self.play([self.rng], self.present[None], joint_action[None])
        info = {"optimal": float(self.optimal[tuple(joint_action)]), "payoff": float(payoffs[0])}
        return Transition(states[0], info["payoff"], False, False, info)

    def predict(self) -> MatrixGame:
        """Return this game, because predictions are the same in every play."""
        return self

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        return self.states_after(joint_actions)[:, agent]

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the expected payoffs ``(m,)`` of joint actions ``(m, n)``."""
        return self.payoffs.mean(axis=0)[tuple(joint_actions.T)]

    def with_exact_prediction(self) -> MatrixGame:
        """Return this game, because its predictions are exact."""
        return self

    def environments(self, count: int) -> GameEnvironments:
        """Return many environments that are stepped in one call."""
        return GameEnvironments(self, count)

    def draw(self, path: Path | str) -> None:
        """Draw the payoffs to a picture file, in a panel for each action of a third agent."""
        from .drawing import draw_tables

        tables = self.payoffs.mean(axis=0)
        panels = tables[None] if tables.ndim == 2 else np.moveaxis(tables, 2, 0)
        names = [f"agent3 plays {name}" for name in self.action_set.names]
        draw_tables(panels, names if tables.ndim > 2 else ["payoff"], self.action_set.names, path)

    def states_after(self, joint_actions: IntArray) -> FloatArray:
        """Return the states ``(..., n, d)`` of all agents after joint actions ``(..., n)``."""
        played = np.asarray(joint_actions, dtype=float)
        n = len(self.agents)
        if self.observed == "own":
            return played[..., None]
        every = np.repeat(played[..., None, :], n, axis=-2)
        if self.observed == "joint":
            return every
        above = np.where(np.arange(n - 1) < np.arange(n)[:, None], every[..., :-1], 0.0)
        return np.concatenate([played[..., None], above], axis=-1)


class GameEnvironments(StackedEnvironments[Any]):
    """Many environments of one game, which has the method `MatrixGame.play`."""

    def allocate(self, scenario: Any, count: int) -> None:
        """Allocate the state of all environments."""
        self._rngs = [scenario.rng] * count
        self._states = np.stack([scenario.present] * count)

    def store(self, index: int, scenario: Any) -> None:
        """Store the generator and the initial states of an environment."""
        self._rngs[index] = scenario.rng
        self._states[index] = scenario.present

    def step(self, joint_actions: IntArray) -> Transitions:
        """Play once in every environment."""
        states, payoffs = self.scenario.play(self._rngs, self._states, joint_actions)
        self._states = states
        never = np.zeros(self.count, dtype=bool)
        rewards = np.broadcast_to(payoffs[:, None], joint_actions.shape)
        return Transitions(states.copy(), rewards, never, never)


def _state_space(
    agents: tuple[str, ...], actions: tuple[str, ...], observed: Literal["joint", "own", "above"]
) -> StateSpace:
    if observed == "joint":
        names = tuple(f"action_of_{agent}" for agent in agents)
        return StateSpace(observed, tuple(choice(name, actions) for name in names), common=names)
    above = tuple(f"told_by_{agent}" for agent in agents[:-1]) if observed == "above" else ()
    return StateSpace(
        observed, tuple(choice(name, actions) for name in ("own_action", *above)), n_own=1
    )
