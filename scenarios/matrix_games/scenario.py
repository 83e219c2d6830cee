"""A matrix game as a scenario: a step is a play, and nothing but the joint action matters.

An agent's state is what it knows of the last play: the actions of all agents, its own alone, or its
own and those of the agents listed before it. Membership functions stand at the actions, so that a
rule base of full order is a table with one value for each of these combinations.

Plays are independent: what a joint action leads to does not depend on where the game stands. That
lets `nested_agents.scenarios.matrix_games.plays` run an episode in one compiled loop.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from ...core.agents.loop import EpisodeSummary
from ...core.agents.team import Team
from ...core.interface.measures import Measure
from ...core.interface.scenario import Transition
from ...core.interface.spaces import ActionSet, StateSpace, choice
from ...core.numerics.arrays import FloatArray, IntArray
from ...core.plugins.settings import ScenarioSettings
from .games import OF_OPTIMA, of_two, optimal, payoffs_of

MOST_ACTIONS = 26
"""Actions of an agent, which are called by letters."""

MEASURES = (*OF_OPTIMA, Measure("payoff", "mean payoff", gathering="mean", better="higher"))


def _known(game: str) -> str:
    payoffs_of(game)
    return game


Row = Annotated[tuple[float, ...], Field(min_length=2, max_length=MOST_ACTIONS)]


class MatrixGameSettings(ScenarioSettings):
    """A matrix game, played again and again."""

    kind: Literal["matrix-game"] = "matrix-game"
    game: Annotated[str, AfterValidator(_known)] = "climbing"
    """``climbing``, ``penalty:K`` with a number K, ``partially-stochastic-climbing``,
    ``stochastic-climbing`` or ``three-agents``."""
    payoffs: Annotated[tuple[Row, ...], Field(min_length=2, max_length=MOST_ACTIONS)] | None = None
    """A game of one's own for two agents, in place of `game`: a square table of payoffs."""
    observed: Literal["joint", "own", "above"] = "joint"
    """Whose actions an agent's state holds: those of all, its own, or its own and those of agents
    listed before it."""

    factory: ClassVar[str] = f"{__name__}:MatrixGame"


class MatrixGame:
    """A matrix game; a `Scenario`.

    Parameters
    ----------
    settings
        See `MatrixGameSettings`.

    Raises
    ------
    ValueError
        If a table of payoffs is not square.

    Examples
    --------
    >>> game = MatrixGameSettings(game="climbing").build()
    >>> _ = game.reset(0)
    >>> game.step(np.array([0, 0])).reward, game.step(np.array([0, 1])).reward
    (11.0, -30.0)
    """

    measures = MEASURES

    def __init__(self, settings: MatrixGameSettings) -> None:
        table = settings.payoffs
        if table is not None and any(len(row) != len(table) for row in table):
            lengths = ", ".join(str(len(row)) for row in table)
            raise ValueError(
                f"scenario.payoffs: {len(table)} rows of {lengths} numbers, must be square"
            )
        self.payoffs = payoffs_of(settings.game) if table is None else of_two(table)
        """``(2, A, ..., A)`` two equally probable payoffs of every joint action."""
        self.optimal = optimal(self.payoffs)
        self.is_stochastic = bool((self.payoffs[0] != self.payoffs[1]).any())
        n, n_actions = self.payoffs.ndim - 1, self.payoffs.shape[1]
        names = tuple("abcdefghijklmnopqrstuvwxyz"[:n_actions])
        self.agents = tuple(f"agent{i + 1}" for i in range(n))
        self.action_set = ActionSet(names, (0.0,) * n_actions, (0.0,) * n_actions, neutral=0)
        self.observed = settings.observed
        self.state_space = _state_space(self.agents, names, settings.observed)
        self.rng = np.random.default_rng(0)
        """What a play pays is drawn from it."""

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Begin after a random joint action."""
        self.rng = np.random.default_rng(seed)
        before = self.rng.integers(0, len(self.action_set), size=len(self.agents))
        return self.states_after(before)

    def step(self, joint_action: IntArray) -> Transition:
        """Play once."""
        drawn = int(self.rng.integers(0, 2)) if self.is_stochastic else 0
        payoff = float(self.payoffs[(drawn, *joint_action)])
        info = {"optimal": float(self.optimal[tuple(joint_action)]), "payoff": payoff}
        return Transition(self.states_after(joint_action), payoff, False, False, info)

    def predict(self) -> MatrixGamePrediction:
        """Predict what joint actions lead to, which is the same at every play."""
        return MatrixGamePrediction(self)

    def with_exact_prediction(self) -> MatrixGame:
        """Return this game: its predictions are exact."""
        return self

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

    def run_episode(
        self, team: Team, seed: np.random.SeedSequence, episode: int, steps: int, *, learn: bool
    ) -> EpisodeSummary | None:
        """Run an episode at once, see `nested_agents.core.agents.loop.EpisodeSummary`."""
        from .plays import parts_of, run  # the kernel takes its time to load

        parts = parts_of(self, team, learn=learn)
        if parts is None:
            return None
        self.reset(seed, episode)
        if learn:
            team.begin_episode()
        summary = run(self, team, parts, steps)
        if learn:
            team.end_episode()
        return summary


class MatrixGamePrediction:
    """What joint actions lead to; rewards, too."""

    def __init__(self, game: MatrixGame) -> None:
        self._game = game

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        return self._game.states_after(joint_actions)[:, agent]

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the expected payoffs ``(m,)`` of joint actions ``(m, n)``; for planners."""
        return self._game.payoffs.mean(axis=0)[tuple(joint_actions.T)]


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
