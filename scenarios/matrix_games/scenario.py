"""Games as scenarios: a step is a play, and nothing but the joint action matters.

In a matrix game an agent's state is what it knows of the last play: the actions of all agents, its
own alone, or its own and those of the agents listed before it. Membership functions stand at the
actions, so that a rule base of full order is a table with one value for each of these combinations.

Plays are independent: what a joint action leads to does not depend on where the game stands. That
lets `nested_agents.scenarios.matrix_games.plays` run an episode in one compiled loop.

The games are those of Claus and Boutilier (1998) and of Kapetanakis and Kudenko (2002). All agents
receive the same payoff, and must find the joint action of the greatest expected one. Actions are
called a, b, c. Rows are the first agent's actions, columns the second one's::

    climbing    a    b    c        penalty     a    b    c
           a   11  -30    0               a   10    0    k
           b  -30    7    6               b    0    2    0
           c    0    0    5               c    k    0   10

Climbing punishes him who plays his part of the optimum, (a, a), while the other does not yet. The
penalty game has two optima, which must not be mixed up. In the stochastic games a joint action pays
one of two amounts, with equal probability; their means are those of climbing.

For three agents there is no game in these papers. Ours pays the least of what each pair of agents,
in their order, would be paid in climbing: 11 if all play a, 7 if all play b, 5 if all play c.

In the games of many agents, too, all are paid alike, at every play. There are three:

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
from collections.abc import Callable, Sequence
from itertools import combinations
from math import isfinite
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from ...core.agents.loop import EpisodeSummary
from ...core.agents.team import Team
from ...core.coordination.graphs import Elimination, Shape, shaped
from ...core.interface.scenario import SUCCESS, Measure, Transition
from ...core.interface.spaces import ActionSet, StateSpace, Variable, choice
from ...core.numerics import FloatArray, IntArray, nx, optimize
from ...core.plugins.settings import NonNegative, ScenarioSettings, closest

OF_OPTIMA = (
    Measure(SUCCESS.name, SUCCESS.title, source="optimal", better="higher", is_rate=True),
    Measure(
        "optimal_plays", "optimal plays", source="optimal", gathering="mean", better="higher",
        least=0.0, greatest=1.0,
    ),
)  # fmt: skip
"""What is measured of any game: success is that the last play of an episode was optimal."""
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
        A name in `GAMES`; ``"penalty:k"`` with a number k.

    Raises
    ------
    ValueError
        If there is no such game, or k is no finite number; one line.

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


def of_two(table: Sequence[Sequence[float | tuple[float, float]]]) -> FloatArray:
    """Return the payoffs ``(2, A, A)`` of a table whose entries are a number, or two.

    >>> of_two([[1, (0, 4)], [0, 3]]).mean(axis=0).tolist()
    [[1.0, 2.0], [0.0, 3.0]]
    """
    pairs = [[e if isinstance(e, tuple) else (e, e) for e in row] for row in table]
    return np.moveaxis(np.array(pairs, dtype=float), -1, 0).copy()


def optimal(payoffs: FloatArray) -> FloatArray:
    """Return which joint actions ``(A, ..., A)`` have the greatest expected payoff, as 0 or 1."""
    expected = payoffs.mean(axis=0)
    return (expected == expected.max()).astype(float)


def _penalty(argument: str) -> FloatArray:
    try:
        k = float(argument)
    except ValueError:
        raise ValueError(f"K = {argument!r}: must be a number") from None
    if not isfinite(k):
        raise ValueError(f"K = {argument}: must be finite")
    return of_two([[10, 0, k], [0, 2, 0], [k, 0, 10]])


def _three(argument: str) -> FloatArray:
    of_pair = np.array(CLIMBING, dtype=float)
    digits = np.indices((3, 3, 3))
    least = np.min([of_pair[digits[i], digits[j]] for i, j in combinations(range(3), 2)], axis=0)
    return np.stack([least, least])


GAMES: dict[str, Callable[[str], FloatArray]] = {
    "climbing": lambda _: of_two(CLIMBING),
    "penalty": _penalty,
    "partially-stochastic-climbing": lambda _: of_two(PARTIALLY_STOCHASTIC),
    "stochastic-climbing": lambda _: of_two(STOCHASTIC),
    "three-agents": _three,
}
"""Payoffs by name, given what follows the name."""


SHARE_OF_BEST = Measure(
    "share_of_best", "payoff over the best", gathering="mean", better="higher", greatest=1.0
)
MOST_ACTIONS = 26
"""Actions of an agent, which are called by letters."""


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
    """A matrix game; a `Scenario`, and its own `Prediction`.

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

    measures = (*OF_OPTIMA, Measure("payoff", "mean payoff", gathering="mean", better="higher"))

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

    def predict(self) -> MatrixGame:
        """Return this game: what joint actions lead to is the same at every play."""
        return self

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        return self.states_after(joint_actions)[:, agent]

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the expected payoffs ``(m,)`` of joint actions ``(m, n)``; for planners."""
        return self.payoffs.mean(axis=0)[tuple(joint_actions.T)]

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


PLAY = Variable("play", "1", 0.0, 1.0, centres=(0.0, 1.0))
"""What those see who see nothing: 0 always."""


class TeamGameSettings(ScenarioSettings):
    """A game of many agents who are paid alike, played again and again."""

    kind: Literal["team-game"] = "team-game"
    factory: ClassVar[str] = f"{__name__}:TeamGame"
    game: Literal["polymatrix", "permutation", "landmarks"] = "polymatrix"
    """Which game is played, see `nested_agents.scenarios.matrix_games.scenario`."""
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
    seen
        What the agents see ``(n, d)``.
    """

    best = 1.0
    """The greatest payoff."""

    def __init__(self, seen: FloatArray) -> None:
        self.seen = seen

    @abstractmethod
    def payoffs(self, joint_actions: IntArray) -> FloatArray:
        """Return the payoffs ``(m,)`` of joint actions ``(m, n)``."""

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
        n = len(self.seen)
        far = self.seen[np.arange(n), joint_actions].mean(axis=1)
        return distinct(joint_actions) / n - self._cost * far

    def is_optimal(self, joint_action: IntArray) -> bool:
        """Return whether every landmark is taken, by whomever."""
        return len(set(joint_action.tolist())) == len(joint_action)

    def advance(self, rng: np.random.Generator) -> None:
        """Draw other places, and find the assignment of least distance."""
        agents, landmarks = rng.random((2, len(self.seen), 2))
        self.seen = np.linalg.norm(agents[:, None] - landmarks, axis=2)
        assigned = optimize.linear_sum_assignment(self.seen)[1]
        self.best = float(self.payoffs(assigned[None])[0])


def distinct(joint_actions: IntArray) -> IntArray:
    """Return how many different actions there are in each joint action, ``(m,)``.

    >>> distinct(np.array([[0, 1, 2], [1, 1, 0]])).tolist()
    [3, 2]
    """
    return 1 + (np.diff(np.sort(joint_actions, axis=1), axis=1) > 0).sum(axis=1)


class TeamGame:
    """A game of many agents; a `Scenario`.

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
        self.settings, n = settings, settings.players
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
        edges = shaped(settings.shape, n) if settings.game == "polymatrix" else nx.complete_graph(n)
        self.interactions = sorted(tuple(sorted(edge)) for edge in edges.edges)
        """Pairs of agents whose actions matter to each other."""
        self._numbers = np.arange(float(n))[:, None][:, : len(number)]
        self._drawn: Any = None
        TeamGame.reset(self, 0)

    def _of_seed(self, seed: Any) -> Game:
        s = self.settings
        if s.game == "permutation":
            return Permutation(np.zeros((s.players, 1)))
        if s.game == "landmarks":
            return Landmarks(s.players, s.distance_cost)
        edges = self.interactions
        rng = np.random.default_rng(seed if s.seed is None else s.seed)
        return Polymatrix(edges, rng.random((len(edges), s.actions, s.actions)))

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Begin with the first play."""
        entropy = seed.entropy if isinstance(seed, np.random.SeedSequence) else seed
        if entropy != self._drawn:
            self.game, self._drawn = self._of_seed(entropy), entropy
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

    def _states(self) -> FloatArray:
        return np.hstack([self.game.seen, self._numbers])
