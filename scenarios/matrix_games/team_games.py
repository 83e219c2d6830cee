"""Games of many agents: a step is a play, for which all are paid alike.

There are three:

- *polymatrix*: agents stand in a graph, and every edge pays by the actions of its two agents; all
  are paid the mean. The payoffs of an edge are drawn evenly from 0 to 1. The best joint action is
  found by variable elimination.
- *permutation* (Fu et al. 2022): n agents have n actions, and are paid 1 if no two do the same.
- *landmarks*: n agents and n landmarks are at random places of a square, new at every play. All
  choose a landmark, and are paid for the share of landmarks that somebody has chosen, less
  `distance_cost` times the mean distance. An agent sees how far it is from every landmark, and
  nothing of the others.

Of polymatrix and permutation an agent sees nothing, or which one it is. Agents are of one role, so
that those who share weights can act differently only by what they see and are told.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ...core.coordination.graphs import Elimination, Shape, build_shape
from ...core.interface.environments import Transitions
from ...core.interface.measures import Measure
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import ActionSet, StateSpace, Variable, choice
from ...core.interface.stacked import StackedEnvironments
from ...core.numerics import FloatArray, IntArray, nx, optimize
from ...core.plugins.settings import NonNegative, ScenarioSettings
from .scenario import OF_OPTIMA

SHARE_OF_BEST = Measure(
    "share_of_best", "payoff over the best", gathering="mean", better="higher", greatest=1.0
)
Entropy = int | Sequence[int] | None
"""Of a seed."""
PLAY = Variable("play", "1", 0.0, 1.0, centres=(0.0, 1.0))
"""What those see who see nothing: 0 always."""


class TeamGameSettings(ScenarioSettings):
    """A game of many agents who are paid alike, played again and again."""

    kind: Literal["team-game"] = "team-game"
    factory: ClassVar[str] = f"{__name__}:TeamGame"
    game: Literal["polymatrix", "permutation", "landmarks"] = "polymatrix"
    """Which game is played, see `nested_agents.scenarios.matrix_games.team_games`."""
    players: Annotated[int, Field(ge=2, le=64)] = 8
    """Number of agents."""
    actions: Annotated[int, Field(ge=2, le=26)] = 3
    """Actions of an agent in a polymatrix game; in others there are as many as agents."""
    shape: Shape = "ring"
    """Who plays with whom in a polymatrix game, as of the topology ``coordination-graph``."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """Of what a polymatrix game pays; none: that of the trial, so that every seed of a study plays
    a game of its own."""
    numbered: bool = False
    """Whether agents see which one they are."""
    distance_cost: NonNegative = 0.5
    """What a landmark at a distance of 1, the side of the square, costs."""


class Game(ABC):
    """What is paid for a joint action, and what it could be at best.

    Parameters
    ----------
    states
        What the agents see ``(n, d)``.
    """

    best = 1.0
    """The greatest payoff."""

    def __init__(self, states: FloatArray) -> None:
        self.states = states

    @abstractmethod
    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(m,)`` of joint actions ``(m, n)``."""

    def payoffs_of_worlds(self, states: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(W,)`` of joint actions ``(W, n)`` in worlds of these states."""
        return self.payoffs(joint_actions)

    def is_optimal(self, joint_action: IntArray) -> bool:
        """Return whether nothing pays more, but for rounding."""
        return bool(self.payoffs(joint_action[None])[0] >= self.best - 1e-12)

    def advance(self, rng: np.random.Generator) -> None:  # noqa: B027 - most games do not change
        """Go on to the next play, which is the same game."""


class Polymatrix(Game):
    """A sum of tables, one for each edge of a graph.

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
        """Return the mean over the edges."""
        edges = np.arange(len(self._tables))
        both = joint_actions[:, self._first], joint_actions[:, self._second]
        return self._tables[edges, *both].mean(axis=1)


class Permutation(Game):
    """A game that pays 1 if no two agents do the same."""

    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return 1 or 0."""
        return (distinct(joint_actions) == joint_actions.shape[1]).astype(float)


class Landmarks(Game):
    """A game that pays for landmarks that are taken, and less for far ones.

    Two agents at one landmark leave another free, which costs more than any way to it as long as
    `cost` times the diagonal is below 1: then the best is a permutation.
    """

    def __init__(self, players: int, cost: float) -> None:
        super().__init__(np.zeros((players, players)))
        self._cost = cost

    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return the share of landmarks that are taken, less the cost of the mean distance."""
        return self.payoffs_of_worlds(self.states[None], joint_actions)

    def payoffs_of_worlds(self, states: FloatArray, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(W,)`` of joint actions ``(W, n)`` by distances ``(W, n, ...)``."""
        n = joint_actions.shape[1]
        rows = np.arange(len(states))[:, None]
        far = states[rows, np.arange(n), joint_actions].mean(axis=1)
        return distinct(joint_actions) / n - self._cost * far

    def is_optimal(self, joint_action: IntArray) -> bool:
        """Return whether every landmark is taken, by whomever."""
        return len(set(joint_action.tolist())) == len(joint_action)

    def advance(self, rng: np.random.Generator) -> None:
        """Draw other places, and find the assignment of least distance."""
        self.states = self.drawn([rng.random((2, len(self.states), 2))])[0]
        assigned = optimize.linear_sum_assignment(self.states)[1]
        self.best = float(self.payoffs(assigned[None])[0])

    @staticmethod
    def drawn(draws: Sequence[FloatArray]) -> FloatArray:
        """Return the distances ``(W, n, n)`` of agents from landmarks at places ``(2, n, 2)``."""
        agents, landmarks = np.moveaxis(np.stack(draws), 1, 0)
        return np.linalg.norm(agents[:, :, None] - landmarks[:, None], axis=3)


def distinct(joint_actions: IntArray) -> IntArray:
    """Return how many different actions there are in each joint action, ``(m,)``.

    >>> distinct(np.array([[0, 1, 2], [1, 1, 0]])).tolist()
    [3, 2]
    """
    return 1 + (np.diff(np.sort(joint_actions, axis=1), axis=1) > 0).sum(axis=1)


class TeamGame(Scenario):
    """A game of many agents, which is not predicted.

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

    measures = (*OF_OPTIMA, SHARE_OF_BEST)

    def __init__(self, settings: TeamGameSettings) -> None:
        self.settings = settings
        n = settings.players
        self.agents = tuple(f"agent{i + 1}" for i in range(n))
        self.roles = ("player",) * n
        k = settings.actions if settings.game == "polymatrix" else n
        names = tuple(f"a{action + 1}" for action in range(k))
        self.action_set = ActionSet(names, (0.0,) * k, (0.0,) * k, neutral=0)
        seen: tuple[Variable, ...] = (PLAY,)
        if settings.game == "landmarks":
            seen = tuple(Variable(f"distance{j + 1}", "1", 0.0, 1.0) for j in range(n))
        number = (choice("number", self.agents),) if settings.numbered else ()
        self.state_space = StateSpace(settings.game, (*seen, *number))
        is_sparse = settings.game == "polymatrix"
        edges = build_shape(settings.shape, n) if is_sparse else nx.complete_graph(n)
        self._edges: list[tuple[int, int]] = sorted(tuple(sorted(edge)) for edge in edges.edges)
        self.interactions = self._edges
        self._numbers = np.arange(float(n))[:, None][:, : len(number)]
        self._drawn: Entropy = None
        TeamGame.reset(self, 0)

    def _of_seed(self, seed: Entropy) -> Game:
        """Return the game that is played; only a polymatrix game depends on the seed."""
        s = self.settings
        if s.game == "permutation":
            return Permutation(np.zeros((s.players, 1)))
        if s.game == "landmarks":
            return Landmarks(s.players, s.distance_cost)
        edges = self._edges
        rng = np.random.default_rng(seed if s.seed is None else s.seed)
        return Polymatrix(edges, rng.random((len(edges), s.actions, s.actions)))

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Begin with the first play."""
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

    def environments(self, count: int) -> TeamGameEnvironments:
        """Return many environments, stepped in one call."""
        return TeamGameEnvironments(self, count)

    def _states(self) -> FloatArray:
        return np.hstack([self.game.states, self._numbers])


class TeamGameEnvironments(StackedEnvironments[TeamGame]):
    """Many environments of one game; all seeds that begin their episodes are of one trial."""

    def allocate(self, scenario: TeamGame, count: int) -> None:
        """Allocate the state of all environments."""
        self._generators = [scenario._rng] * count
        self._states = np.stack([scenario._states()] * count)

    def store(self, index: int, scenario: TeamGame) -> None:
        """Keep the generator of an environment and its first states."""
        self._generators[index] = scenario._rng
        self._states[index] = scenario._states()

    def step(self, joint_actions: IntArray) -> Transitions:
        """Play once in every environment."""
        game = self.scenario.game
        payoffs = game.payoffs_of_worlds(self._states, joint_actions)
        if isinstance(game, Landmarks):
            n = joint_actions.shape[1]
            self._states = self._states.copy()
            self._states[:, :, :n] = game.drawn([g.random((2, n, 2)) for g in self._generators])
        never = np.zeros(self.count, dtype=bool)
        paid = np.broadcast_to(payoffs[:, None], joint_actions.shape)
        return Transitions(self._states, paid, never, never)
