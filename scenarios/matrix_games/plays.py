"""An episode of a matrix game in one compiled loop, thousands of plays in a few milliseconds.

A play is a few table look-ups and a random number; in the control loop nearly all of its time goes
into passing it from part to part: compiled, an episode takes a 150th of it, and the study `games`
some minutes in place of four hours. `run` does the same as `control_loop`, by the same random
numbers in the same order, for teams made of parts that it knows; the control loop is the reference
that it is tested against. Games are those of `nested_agents.scenarios.matrix_games.scenario`.

It knows exact enumeration by an agent's own value, with all teammate models and hierarchies; tables
(rule bases of full order) that stay as they are, or are learned without discount by `TDLambda`,
`OptimisticTD` or `FMQ`; exploration by `Boltzmann`, and by `EpsilonDecreasingBoltzmann`
if that explores uniformly and else takes the greatest value.

The compiled loop follows `Team.act`, the explorers and the learners statement by statement. ``n``
agents, ``A`` actions; joint actions are joint-action indices.
"""

from typing import NamedTuple

import numpy as np

from ...core.agents.fuzzy import FuzzyAgents
from ...core.agents.loop import EpisodeSummary
from ...core.agents.team import Team
from ...core.decision.exploration import Boltzmann, EpsilonDecreasingBoltzmann, Explorer
from ...core.evaluators.enumeration import ExactEnumeration
from ...core.interface.scenario import Scenario
from ...core.learners.learner import Learner
from ...core.learners.td import FMQ, Frozen, Online, OptimisticTD, TDLambda
from ...core.numerics import FloatArray, IntArray, njit
from .scenario import MatrixGame

BEST, UNIFORM, EMPIRICAL, CONDITIONAL = range(4)
"""Teammate models."""
GREEDY, SAMPLED, DECREASING = range(3)
"""Explorations: none, Boltzmann, epsilon-decreasing Boltzmann."""


class Deciding(NamedTuple):
    """How a team decides."""

    order: IntArray  # (n,)
    below: IntArray  # (n, n) 1 where the second agent is below the first
    above: IntArray  # (n, n)
    teammates: int
    neutral: int
    cells: IntArray  # (n, A ** n) the rule that each agent's state fires after a joint action


class ExplorationParameters(NamedTuple):
    """How it explores; meanings of the fields are those of `PaperExploration`."""

    kind: int
    max_temperature: float
    decay: float
    epsilon: float


class Learning(NamedTuple):
    """How it learns."""

    learns: bool
    step_size: float
    falling: float  # over rising
    weight: float  # of FMQ's bonus
    weights: FloatArray  # FMQ's tables, without rows for other learners
    greatest: FloatArray
    hits: FloatArray
    visits: FloatArray


@njit(cache=True)
def play(
    rng: np.random.Generator,
    world: np.random.Generator,
    plays: int,
    payoffs: FloatArray,
    optimal: FloatArray,
    theta: FloatArray,
    rows: IntArray,
    deciding: Deciding,
    exploring: ExplorationParameters,
    clock: FloatArray,
    learning: Learning,
    seen: FloatArray,
    given: FloatArray,
    joints: IntArray,
    paid: FloatArray,
) -> tuple[float, float]:
    """Play, and learn from all plays but the last two.

    Parameters
    ----------
    rng, world
        Random numbers of the team and of the game.
    plays
        Their number.
    payoffs
        ``(2, A ** n)``, or ``(1, A ** n)`` if nothing is drawn.
    optimal
        ``(A ** n,)`` 1 for the best joint actions, else 0.
    theta
        ``(n_rows, n_rules)``, modified.
    rows
        ``(n,)`` the row of every agent.
    clock
        ``(1,)`` steps that the exploration has counted, modified.
    seen, given
        What `Team` counts, modified.
    joints, paid
        ``(2, n)`` and ``(2,)``: the last two joint actions and what they paid, modified.

    Returns
    -------
    tuple
        Sum of the payoffs, and the number of optimal plays.
    """
    n, n_actions = seen.shape
    places = n_actions ** np.arange(n - 1, -1, -1)
    values, total, optima = np.empty(n_actions), 0.0, 0.0
    for t in range(plays):
        if learning.learns and t >= 2:
            _learn(theta, rows, deciding.cells, joints[0], places, paid[0], learning)
        joints[0], paid[0] = joints[1], paid[1]
        joint = joints[1]
        joint[:] = deciding.neutral
        for i in deciding.order:
            _value(i, joint, theta[rows[i]], places, deciding, seen, given, values)
            joint[i] = _choose(values, exploring, clock[0], rng)
        if learning.learns:
            clock[0] += 1.0
            for i in range(n):
                seen[i, joint[i]] += 1.0
                if len(given):
                    for j in range(n):
                        given[i, joint[i], j, joint[j]] += 1.0
        index = (joint * places).sum()
        drawn = world.integers(0, 2) if len(payoffs) > 1 else 0
        paid[1] = payoffs[drawn, index]
        total += paid[1]
        optima += optimal[index]
    return total, optima


@njit(cache=True)
def _value(
    i: int,
    joint: IntArray,
    theta: FloatArray,
    places: IntArray,
    deciding: Deciding,
    seen: FloatArray,
    given: FloatArray,
    values: FloatArray,
) -> None:
    """Value each action of agent i over the joint actions of those below it."""
    n, n_actions = seen.shape
    fixed, combos = 0, 1
    for j in range(n):
        if deciding.below[i, j]:
            combos *= n_actions
        elif j != i:
            fixed += places[j] * (joint[j] if deciding.above[i, j] else deciding.neutral)
    for a in range(n_actions):
        best, mean, weight = -np.inf, 0.0, 0.0
        for combo in range(combos):
            index, rest, probability = fixed + a * places[i], combo, 1.0
            for j in range(n - 1, -1, -1):
                if not deciding.below[i, j]:
                    continue
                action = rest % n_actions
                rest //= n_actions
                index += action * places[j]
                if deciding.teammates == EMPIRICAL:
                    probability *= seen[j, action] / seen[j].sum()
                elif deciding.teammates == CONDITIONAL:
                    probability *= given[i, a, j, action] / given[i, a, j].sum()
            value = theta[deciding.cells[i, index]]
            best = max(best, value)
            mean += probability * value
            weight += probability
        values[a] = best if deciding.teammates == BEST else mean / weight


@njit(cache=True)
def _choose(
    values: FloatArray, exploring: ExplorationParameters, clock: float, rng: np.random.Generator
) -> int:
    """Return the action that an explorer chooses."""
    if exploring.kind == GREEDY:
        return _greatest(values, rng)
    temperature = 1.0 + exploring.max_temperature * np.exp(-exploring.decay * clock)
    if exploring.kind == DECREASING:
        rate = exploring.epsilon * (temperature - 1.0) / (exploring.max_temperature - 1.0)
        if rng.random() < min(1.0, rate):
            return rng.integers(0, len(values))  # type: ignore[return-value]  # compiled: an int
        return _greatest(values, rng)
    ladder = np.exp((values - values.max()) / temperature)
    ladder /= ladder.sum()
    ladder = ladder.cumsum()
    ladder /= ladder[-1]
    return np.searchsorted(ladder, rng.random(), side="right")  # type: ignore[return-value]  # compiled: an int


@njit(cache=True)
def _greatest(values: FloatArray, rng: np.random.Generator) -> int:
    """Return the greatest value's place, see `nested_agents.core.numerics.greatest`."""
    top = values.max()
    best = np.flatnonzero(values >= top - 1e-12 * max(1.0, abs(top)))
    return best[0] if len(best) == 1 else best[rng.integers(0, len(best))]


@njit(cache=True)
def _learn(
    theta: FloatArray,
    rows: IntArray,
    cells: IntArray,
    joint: IntArray,
    places: IntArray,
    reward: float,
    learning: Learning,
) -> None:
    """Learn from one play, as the learners do without discount."""
    index = (joint * places).sum()
    for i, row in enumerate(rows):
        cell = cells[i, index]
        if len(learning.weights) == 0:
            delta = reward - theta[row, cell]
            theta[row, cell] += learning.step_size * max(delta, learning.falling * delta)
            continue
        delta = reward - learning.weights[row, cell]
        learning.weights[row, cell] += learning.step_size * delta
        learning.visits[row, cell] += 1.0
        if reward > learning.greatest[row, cell]:
            learning.greatest[row, cell], learning.hits[row, cell] = reward, 0.0
        learning.hits[row, cell] += reward == learning.greatest[row, cell]
        often = learning.hits[row, cell] / learning.visits[row, cell]
        theta[row, cell] = (
            learning.weights[row, cell] + learning.weight * often * learning.greatest[row, cell]
        )


TEAMMATES = ("best-response", "uniform", "empirical", "conditional")
"""Teammate models in the order of the kernel."""
NONE: FloatArray = np.zeros((0, 0))
STILL = Learning(False, 0.0, 1.0, 0.0, NONE, NONE, NONE, NONE)
NO_EXPLORATION = ExplorationParameters(GREEDY, 0.0, 0.0, 0.0)


Parts = tuple[Deciding, ExplorationParameters, Learning]
"""A team as the kernel knows it."""


def whole_episode(
    scenario: Scenario,
    team: Team,
    seed: np.random.SeedSequence,
    episode: int,
    steps: int,
    *,
    learn: bool,
) -> EpisodeSummary | None:
    """Run an episode at once; or return None and change nothing, of a team that is not known.

    Scenario and team are left as `control_loop` would leave them.
    """
    (agents,) = team.parts
    if not isinstance(scenario, MatrixGame) or not isinstance(agents, FuzzyAgents):
        return None
    if team.messages.failures or agents.views is not None:
        return None
    parts = parts_of(scenario, agents, learn=learn)
    if parts is None:
        return None
    scenario.reset(seed, episode)
    if learn:
        team.begin_episode()
    summary = run(scenario, agents, parts, steps)
    if learn:
        agents.end_episode()
    return summary


def parts_of(game: MatrixGame, team: FuzzyAgents, *, learn: bool) -> Parts | None:
    """Return what agents are made of; None if they have a part that the kernel does not know."""
    if type(team.evaluator) is not ExactEnumeration or not _is_table(team.evaluator):
        return None
    if team.foresight.predictor is not None:
        return None
    learning = _learning(team.learner) if learn else STILL
    exploring = _exploring(team.explorer) if learn else NO_EXPLORATION
    if learning is None or exploring is None:
        return None
    return _deciding(game, team, team.evaluator), exploring, learning


def run(game: MatrixGame, team: FuzzyAgents, parts: Parts, plays: int) -> EpisodeSummary:
    """Run an episode that has begun."""
    deciding, exploring, learning = parts
    learner = team.learner
    n = len(team.hierarchy)
    joints, paid = np.zeros((2, n), dtype=np.int64), np.zeros(2)
    payoffs = game.payoffs.reshape(2, -1)[: 2 if game.is_stochastic else 1]
    total, optima = play(
        team.rng, game.rng, plays, payoffs, game.optimal.ravel(), learner.theta, team.rows,
        deciding, exploring, team.explorer.memory, learning, team.seen, team.given, joints, paid,
    )  # fmt: skip
    updates = 0
    if learning.learns:
        updates = max(0, plays - 2) * (1 + bool(len(learning.weights))) * learner.theta.size
        updates *= learning.step_size > 0.0
        # The learner is shown the last two plays, and is left as they leave it.
        for k in range(2)[-plays:]:
            updates += learner.observe(game.states_after(joints[k]), float(paid[k]), False)
    if team.evaluator is not None:
        counts, tried = team.evaluator.counts, team.hierarchy.joint_actions(len(team.action_set))
        counts.joint_actions += plays * tried
        counts.rule_evaluations += plays * tried * learner.theta.shape[1]
        counts.weight_updates += updates
    measures = {
        "success": bool(game.optimal[tuple(joints[1])]),
        "optimal_plays": optima / plays,
        "payoff": total / plays,
    }
    return EpisodeSummary(plays, measures, total)


def _is_table(evaluator: ExactEnumeration) -> bool:
    """Return whether agents decide by own values, and every state fires one rule alone."""
    rules, problem = evaluator.rules, evaluator.problem
    whole = tuple(range(len(rules.partitions)))
    actions = tuple(float(a) for a in range(evaluator.n_actions))
    at_actions = all(partition.centres == actions for partition in rules.partitions)
    requested = problem.rule, problem.value_of, problem.unseen
    own = requested == ("value", "own", "maintain")
    return own and rules.compact and at_actions and rules.terms == (whole,)


def _deciding(game: MatrixGame, team: FuzzyAgents, evaluator: ExactEnumeration) -> Deciding:
    n = len(team.hierarchy)
    a = evaluator.n_actions
    below, above = np.zeros((2, n, n), dtype=np.int64)
    for i in range(n):
        below[i, list(team.hierarchy.below(i))] = 1
        above[i, list(team.hierarchy.above(i))] = 1
    every = np.indices((a,) * n).reshape(n, -1).T
    states = game.states_after(every).astype(np.int64)  # (A ** n, n, d)
    places = a ** np.arange(states.shape[2] - 1, -1, -1, dtype=np.int64)
    cells: IntArray = np.ascontiguousarray((states @ places).T)
    teammates = TEAMMATES.index(evaluator.problem.teammates)
    order = np.array(team.hierarchy.order, dtype=np.int64)
    return Deciding(order, below, above, teammates, team.action_set.neutral, cells)


def _learning(learner: Learner) -> Learning | None:
    """Return how a learner learns; None if it is not known."""
    known = STILL._replace(learns=True)
    if type(learner) is Frozen:
        return known
    if not isinstance(learner, Online) or learner.discount > 0.0:
        return None
    s = learner.settings
    if type(learner) is TDLambda and s.averaging == 1 and s.reward_of == "left":
        return known._replace(step_size=s.step_size)
    if type(learner) is OptimisticTD:
        return known._replace(step_size=s.step_size, falling=s.falling)
    if type(learner) is FMQ:
        return Learning(
            learns=True,
            step_size=s.step_size,
            falling=1.0,
            weight=s.weight,
            weights=learner.weights,
            greatest=learner.greatest,
            hits=learner.hits,
            visits=learner.visits,
        )
    return None


def _exploring(explorer: Explorer) -> ExplorationParameters | None:
    """Return how an explorer explores; None if it is not known."""
    if type(explorer) is Boltzmann:
        s = explorer.settings
        return ExplorationParameters(SAMPLED, s.max_temperature, s.decay, 0.0)
    if type(explorer) is not EpsilonDecreasingBoltzmann:
        return None
    paper = explorer.paper
    if (paper.explore, paper.exploit) != ("uniform", "greatest"):
        return None
    return ExplorationParameters(DECREASING, paper.max_temperature, paper.decay, paper.epsilon)
