"""The compiled loop of `nested_agents.scenarios.matrix_games.plays`.

It follows `Team.act`, the explorers and the learners statement by statement; random numbers are
drawn in the same order. ``n`` agents, ``A`` actions; joint actions are joint-action indices.
"""

from typing import NamedTuple

import numpy as np

from ...core.numerics.arrays import FloatArray, IntArray
from ...core.numerics.compiling import njit

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


class Exploring(NamedTuple):
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
def play(  # type: ignore[no-untyped-def]
    rng, world, plays: int, payoffs: FloatArray, optimal: FloatArray, theta: FloatArray,
    rows: IntArray, deciding: Deciding, exploring: Exploring, clock: FloatArray,
    learning: Learning, seen: FloatArray, given: FloatArray, joints: IntArray, paid: FloatArray,
):  # fmt: skip
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
def _value(i, joint, theta, places, deciding, seen, given, values) -> None:  # type: ignore[no-untyped-def]
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
def _choose(values, exploring, clock, rng) -> int:  # type: ignore[no-untyped-def]
    """Return the action that an explorer chooses."""
    if exploring.kind == GREEDY:
        return _greatest(values, rng)
    temperature = 1.0 + exploring.max_temperature * np.exp(-exploring.decay * clock)
    if exploring.kind == DECREASING:
        rate = exploring.epsilon * (temperature - 1.0) / (exploring.max_temperature - 1.0)
        if rng.random() < min(1.0, rate):
            return rng.integers(0, len(values))
        return _greatest(values, rng)
    ladder = np.exp((values - values.max()) / temperature)
    ladder /= ladder.sum()
    ladder = ladder.cumsum()
    ladder /= ladder[-1]
    return np.searchsorted(ladder, rng.random(), side="right")


@njit(cache=True)
def _greatest(values, rng) -> int:  # type: ignore[no-untyped-def]
    """Return the greatest value's place, see `nested_agents.core.numerics.ties.greatest`."""
    top = values.max()
    best = np.flatnonzero(values >= top - 1e-12 * max(1.0, abs(top)))
    return best[0] if len(best) == 1 else best[rng.integers(0, len(best))]


@njit(cache=True)
def _learn(theta, rows, cells, joint, places, reward, learning) -> None:  # type: ignore[no-untyped-def]
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
