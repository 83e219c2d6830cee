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

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ...core.interface.environments import Transitions
from ...core.interface.measures import Measure
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet, StateSpace, Variable, choice
from ...core.interface.stacked import StackedEnvironments
from ...core.numerics import FloatArray, IntArray, nx, optimize
from ...core.plugins.settings import NonNegative, ScenarioSettings
from ...core.search.coordination_graphs import Elimination, Shape, build_shape
from .scenario import OPTIMALITY

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


class Game(ABC):
    """Payoffs of joint actions, and the maximum payoff.

    Parameters
    ----------
    states
        Observations of the agents ``(n, d)``.
    """

    best = 1.0
    """Maximum payoff."""

    def __init__(self, states: FloatArray) -> None:
        self.states = states

    @abstractmethod
    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(m,)`` of joint actions ``(m, n)``."""

    def payoffs_in(self, states: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(W,)`` of joint actions ``(W, n)`` in environments with states."""
        return self.payoffs(joint_actions)

    def is_optimal(self, joint_action: IntArray) -> bool:
        """Return whether a joint action has the maximum payoff, except for rounding."""
        return bool(self.payoffs(joint_action[None])[0] >= self.best - 1e-12)

    def advance(self, rng: np.random.Generator) -> None:  # noqa: B027 - most games do not change
        """Prepare the next play."""


class Polymatrix(Game):
    """Mean of payoff tables, one for each edge of a graph.

    Examples
    --------
    >>> pair = Polymatrix([(0, 1)], np.array([[[0.25, 0.5], [1.0, 0.0]]]))
    >>> pair.best, pair.payoffs(np.array([[0, 1], [1, 0]])).tolist()
    (1.0, [0.5, 1.0])
    """

    def __init__(self, edges: list[tuple[int, int]], tables: FloatArray) -> None:
        n = 1 + int(np.max(edges))
        super().__init__(np.zeros((n, 1)))
        self._first, self._second = np.array(edges).T
        self._tables = tables
        optimum = Elimination(edges, n, tables.shape[1]).best(list(tables))
        self.best = float(self.payoffs(optimum[None])[0])

    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return the mean payoff over the edges."""
        edges = np.arange(len(self._tables))
        both = joint_actions[:, self._first], joint_actions[:, self._second]
        return self._tables[edges, *both].mean(axis=1)


class Permutation(Game):
    """Game that pays 1 if all actions differ."""

    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return 1 or 0."""
        return (distinct(joint_actions) == joint_actions.shape[1]).astype(float)


class Landmarks(Game):
    """Game that pays for chosen landmarks and charges for distances.

    While `cost` times the diagonal is below 1, a free landmark costs more than any distance, so
    that the optimum is a permutation.
    """

    def __init__(self, players: int, cost: float) -> None:
        super().__init__(np.zeros((players, players)))
        self._cost = cost

    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return the fraction of chosen landmarks minus the cost of the mean distance."""
        return self.payoffs_in(self.states[None], joint_actions)

    def payoffs_in(self, states: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(W,)`` of joint actions ``(W, n)`` by distances ``(W, n, ...)``."""
        n = joint_actions.shape[1]
        rows = np.arange(len(states))[:, None]
        far = states[rows, np.arange(n), joint_actions].mean(axis=1)
        return distinct(joint_actions) / n - self._cost * far

    def is_optimal(self, joint_action: IntArray) -> bool:
        """Return whether every landmark is chosen."""
        return len(set(joint_action.tolist())) == len(joint_action)

    def advance(self, rng: np.random.Generator) -> None:
        """Draw new positions, and find the assignment with the minimum distance."""
        self.states = self.drawn([rng.random((2, len(self.states), 2))])[0]
        assigned = optimize.linear_sum_assignment(self.states)[1]
        self.best = float(self.payoffs(assigned[None])[0])

    @staticmethod
    def drawn(draws: Sequence[FloatArray]) -> FloatArray:
        """Return distances ``(W, n, n)`` of agents from landmarks for positions ``(2, n, 2)``."""
        agents, landmarks = np.moveaxis(np.stack(draws), 1, 0)
        return np.linalg.norm(agents[:, :, None] - landmarks[:, None], axis=3)


def distinct(joint_actions: IntArray) -> IntArray:
    """Return the number of different actions in each joint action ``(m,)``.

    >>> distinct(np.array([[0, 1, 2], [1, 1, 0]])).tolist()
    [3, 2]
    """
    return 1 + (np.diff(np.sort(joint_actions, axis=1), axis=1) > 0).sum(axis=1)


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
        self._edges: list[tuple[int, int]] = sorted(tuple(sorted(edge)) for edge in edges.edges)
        self.interactions = self._edges
        self._numbers = np.arange(float(n))[:, None][:, : len(number)]
        self._drawn: Entropy = None
        TeamGame.reset(self, 0)

    def _of_seed(self, seed: Entropy) -> Game:
        """Return the game of a seed, on which only polymatrix games depend."""
        s = self.settings
        if s.game == "permutation":
            return Permutation(np.zeros((s.players, 1)))
        if s.game == "landmarks":
            return Landmarks(s.players, s.distance_cost)
        edges = self._edges
        rng = np.random.default_rng(seed if s.seed is None else s.seed)
        return Polymatrix(edges, rng.random((len(edges), s.actions, s.actions)))

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode."""
        entropy = seed.entropy if isinstance(seed, np.random.SeedSequence) else seed
        if entropy != self._drawn:
            self.game = self._of_seed(entropy)
            self._drawn = entropy
        self._rng = np.random.default_rng(seed)
        self.game.advance(self._rng)
        return self._states()

    def step(self, joint_action: IntArray) -> Transition:
        """Play once."""
        payoff = float(self.game.payoffs(joint_action[None])[0])
        info = {
            "optimal": float(self.game.is_optimal(joint_action)),
            "share_of_best": payoff / self.game.best,
        }
        self.game.advance(self._rng)
        return Transition(self._states(), payoff, False, False, info)

    def draw(self, path: Path | str) -> None:
        """Draw the agents and the edges of the payoff to a picture file."""
        from matplotlib.figure import Figure

        from ..movies import save_picture

        figure = Figure(figsize=(4.0, 4.0), layout="constrained")
        axes = figure.subplots()
        graph = nx.Graph(self._edges)
        nx.draw_networkx(
            graph, nx.circular_layout(graph), ax=axes, labels=dict(enumerate(self.agents))
        )
        axes.set(title=f"{self.settings.game}, {len(self.action_set)} actions each")
        axes.axis("off")
        save_picture(figure, path)

    def environments(self, count: int) -> TeamGameEnvironments:
        """Return many environments that are stepped in one call."""
        return TeamGameEnvironments(self, count)

    def _states(self) -> FloatArray:
        return np.hstack([self.game.states, self._numbers])


class TeamGameEnvironments(StackedEnvironments[TeamGame]):
    """Many environments of one game, within one trial."""

    def allocate(self, scenario: TeamGame, count: int) -> None:
        """Allocate the state of all environments."""
        self._generators = [scenario._rng] * count
        self._states = np.stack([scenario._states()] * count)

    def store(self, index: int, scenario: TeamGame) -> None:
        """Store the generator and the initial states of an environment."""
        self._generators[index] = scenario._rng
        self._states[index] = scenario._states()

    def step(self, joint_actions: IntArray) -> Transitions:
        """Play once in every environment."""
        game = self.scenario.game
        payoffs = game.payoffs_in(self._states, joint_actions)
        if isinstance(game, Landmarks):
            n = joint_actions.shape[1]
            self._states = self._states.copy()
            self._states[:, :, :n] = game.drawn([g.random((2, n, 2)) for g in self._generators])
        never = np.zeros(self.count, dtype=bool)
        rewards = np.broadcast_to(payoffs[:, None], joint_actions.shape)
        return Transitions(self._states, rewards, never, never)
