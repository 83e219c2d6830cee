"""Repeated games of many agents with a joint payoff, in which a step is one play.

- *polymatrix*: agents are nodes of a graph. The payoff of an edge depends on the actions of its two
  agents and is drawn uniformly from 0 to 1; the joint payoff is the mean over edges. Variable
  elimination finds the optimum.
- *permutation* (Fu et al. 2022): n agents have n actions, and receive 1 if all actions differ.
- *landmarks*: n agents and n landmarks have random positions in a square, new in every play. Each
  agent chooses a landmark. The payoff is the fraction of chosen landmarks minus `distance_cost`
  times the mean distance. An agent observes its distances from the landmarks only.

In polymatrix and permutation games an agent observes nothing, or its number. All agents have the
same role, so agents that share weights can act differently only by observation and communication.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ...core.interface.measures import Measure
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet, StateSpace, Variable, choice
from ...core.numerics import FloatArray, IntArray, nx, optimize
from ...core.plugins.settings import NonNegative, ScenarioSettings
from ...core.search.coordination_graphs import Elimination, Shape, build_shape
from .scenario import OPTIMALITY, GameEnvironments

SHARE_OF_BEST = Measure(
    "share_of_best", "payoff over the best", gathering="mean", better="higher", greatest=1.0
)
Entropy = int | Sequence[int] | None
"""Entropy of a seed."""
PLAY = Variable("play", "1", 0.0, 1.0, centers=(0.0, 1.0))
"""Constant observation of agents that observe nothing."""


class TeamGameSettings(ScenarioSettings):
    """A repeated game of many agents with a joint payoff."""

    kind: Literal["team-game"] = "team-game"
    factory: ClassVar[str] = f"{__name__}:TeamGame"
    game: Literal["polymatrix", "permutation", "landmarks"] = "polymatrix"
    """The game, see `nested_agents.scenarios.matrix_games.team_games`."""
    players: Annotated[int, Field(ge=2, le=64)] = 8
    """Number of agents."""
    actions: Annotated[int, Field(ge=2, le=26)] = 3
    """Number of actions in a polymatrix game; in others it is the number of agents."""
    shape: Shape = "ring"
    """Graph of a polymatrix game, as in the topology ``coordination-graph``."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """Seed of the payoffs of a polymatrix game. By default that of the trial, so that every seed
    of a study plays another game."""
    numbered: bool = False
    """Whether agents observe their number."""
    distance_cost: NonNegative = 0.5
    """Cost of a distance of 1, the side of the square."""


class TeamGame(Scenario):
    """A game of many agents without predictions.

    Parameters
    ----------
    settings
        See `TeamGameSettings`.

    Examples
    --------
    >>> game = TeamGameSettings(game="permutation", players=3).build()
    >>> _ = game.reset(0)
    >>> game.step(np.array([0, 2, 1])).reward, game.step(np.array([0, 2, 2])).reward
    (1.0, 0.0)
    """

    measures = (*OPTIMALITY, SHARE_OF_BEST)

    def __init__(self, settings: TeamGameSettings) -> None:
        self.settings = settings
        n = settings.players
        self.agents = tuple(f"agent{i + 1}" for i in range(n))
        self.roles = ("player",) * n
        k = settings.actions if settings.game == "polymatrix" else n
        names = tuple(f"a{action + 1}" for action in range(k))
        self.action_set = ActionSet(names, (0.0,) * k, (0.0,) * k, neutral=0)
        observed: tuple[Variable, ...] = (PLAY,)
        if settings.game == "landmarks":
            observed = tuple(Variable(f"distance{j + 1}", "1", 0.0, 1.0) for j in range(n))
        number = (choice("number", self.agents),) if settings.numbered else ()
        self.state_space = StateSpace(settings.game, (*observed, *number))
        is_sparse = settings.game == "polymatrix"
        edges = build_shape(settings.shape, n) if is_sparse else nx.complete_graph(n)
        self.interactions: list[tuple[int, int]] = sorted(tuple(sorted(e)) for e in edges.edges)
        self._numbers = np.arange(float(n))[:, None][:, : len(number)]
        self.best = 1.0
        """Maximum payoff."""
        self._drawn: Entropy = None
        TeamGame.reset(self, 0)

    def payoffs(self, states: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(W,)`` of joint actions ``(W, n)`` in states ``(W, n, d)``."""
        if self.settings.game == "polymatrix":
            first, second = np.array(self.interactions).T
            edges = np.arange(len(first))
            return self._tables[edges, joint_actions[:, first], joint_actions[:, second]].mean(1)
        n = joint_actions.shape[1]
        distinct = 1 + (np.diff(np.sort(joint_actions, axis=1), axis=1) > 0).sum(axis=1)
        if self.settings.game == "permutation":
            return (distinct == n).astype(float)
        rows = np.arange(len(states))[:, None]
        far = states[rows, np.arange(n), joint_actions].mean(axis=1)
        return distinct / n - self.settings.distance_cost * far

    def is_optimal(self, joint_action: IntArray) -> bool:
        """Return whether a joint action has the maximum payoff, except for rounding.

        While the distance cost times the diagonal is below 1, a free landmark costs more than any
        distance, so that the optimum is a permutation.
        """
        if self.settings.game == "landmarks":
            return len(set(joint_action.tolist())) == len(joint_action)
        return bool(self.payoffs(self.present[None], joint_action[None])[0] >= self.best - 1e-12)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode."""
        s = self.settings
        entropy = seed.entropy if isinstance(seed, np.random.SeedSequence) else seed
        if s.game == "polymatrix" and entropy != self._drawn:
            rng = np.random.default_rng(entropy if s.seed is None else s.seed)
            self._tables = rng.random((len(self.interactions), s.actions, s.actions))
            graph = Elimination(self.interactions, s.players, s.actions)
            optimum = graph.best(list(self._tables))
            self.best = float(self.payoffs(np.zeros(0), optimum[None])[0])
        self._drawn = entropy
        self.rng = np.random.default_rng(seed)
        constant = np.zeros((s.players, self.state_space.n_variables - self._numbers.shape[1]))
        self.present = self._next([self.rng], np.hstack([constant, self._numbers])[None])[0]
        return self.present

    def _next(self, rngs: Sequence[np.random.Generator], states: FloatArray) -> FloatArray:
        """Return the states ``(W, n, d)`` of the next play, with new positions of landmarks."""
        if self.settings.game != "landmarks":
            return states
        n = states.shape[1]
        agents, places = np.moveaxis(np.stack([rng.random((2, n, 2)) for rng in rngs]), 1, 0)
        distances = np.linalg.norm(agents[:, :, None] - places[:, None], axis=3)
        return np.concatenate([distances, states[:, :, n:]], axis=2)

    def play(
        self, rngs: Sequence[np.random.Generator], states: FloatArray, joint_actions: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the next states ``(W, n, d)`` and the payoffs ``(W,)`` of ``W`` environments."""
        return self._next(rngs, states), self.payoffs(states, joint_actions)

    def step(self, joint_action: IntArray) -> Transition:
        """Play once."""
        best = self.best
        if self.settings.game == "landmarks":
            assigned = optimize.linear_sum_assignment(self.present[:, : len(self.agents)])[1]
            best = float(self.payoffs(self.present[None], assigned[None])[0])
        optimal = float(self.is_optimal(joint_action))
        states, payoffs = self.play([self.rng], self.present[None], joint_action[None])
        self.present = states[0]
        payoff = float(payoffs[0])
        info = {"optimal": optimal, "share_of_best": payoff / best}
        return Transition(self.present, payoff, False, False, info)

    def draw(self, path: Path | str) -> None:
        """Draw the agents and the edges of the payoff to a picture file."""
        from matplotlib.figure import Figure

        from ..movies import save_picture

        figure = Figure(figsize=(4.0, 4.0), layout="constrained")
        axes = figure.subplots()
        graph = nx.Graph(self.interactions)
        nx.draw_networkx(
            graph, nx.circular_layout(graph), ax=axes, labels=dict(enumerate(self.agents))
        )
        axes.set(title=f"{self.settings.game}, {len(self.action_set)} actions each")
        axes.axis("off")
        save_picture(figure, path)

    def environments(self, count: int) -> GameEnvironments:
        """Return many environments that are stepped in one call."""
        return GameEnvironments(self, count)
