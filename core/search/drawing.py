"""Compiled tie-breaking and exploration, equal to `greatest` and `Bursts.choose`."""

import numpy as np

from ..interface.prediction import Exploring
from ..numerics import SAME, FloatArray, IntArray, njit


@njit(cache=True)
def draw(worths: FloatArray, rng: np.random.Generator) -> int:
    """Return the action of greatest value, as `greatest`; -1 if a value is not a number."""
    top = worths[0]
    for worth in worths:
        top = worth if worth > top else top
    least = top - SAME * max(1.0, abs(top))
    ties = 0
    for worth in worths:
        ties += 1 if worth >= least else 0
    place = rng.integers(0, ties) if ties > 1 else 0
    for a in range(len(worths)):
        if worths[a] >= least:
            if place == 0:
                return a
            place -= 1
    return -1


@njit(cache=True)
def choose_action(
    agent: int, values: FloatArray, exploring: Exploring, rng: np.random.Generator
) -> int:
    """Return the agent's action: its held random action, a new one, or the greedy one.

    It equals that of `Bursts.choose` and modifies ``exploring.memory``; -1 if a value is NaN.
    """
    memory, chance, stop = exploring
    at = 1 + 2 * agent
    if chance >= 0.0:
        if memory[at] > 0.0:
            memory[at] -= 1.0
            return int(memory[at + 1])
        if rng.random() < chance:
            action = rng.integers(0, len(values))
            memory[at] = rng.geometric(stop) - 1
            memory[at + 1] = action
            return action  # type: ignore[return-value]  # compiled: an int
    return draw(values, rng)


@njit(cache=True)
def choose_among_equal(
    order: IntArray, n_actions: int, exploring: Exploring, rng: np.random.Generator
) -> IntArray:
    """Return random actions ``(n,)``, held or not, because all actions have the same value."""
    joint = np.empty_like(order)
    values = np.zeros(n_actions)
    for agent in order:
        joint[agent] = choose_action(agent, values, exploring, rng)
    return joint
