"""What is sensed after a step beside what was predicted of it, variable by variable.

Predictions need not come true, so that of most scenarios no more can be said than by how much they
are off. But one that is predicted exactly (``with_exact_prediction``) must sense what was
predicted. What differs then is a variable that is computed in two ways.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.scenario import Scenario
from ...core.numerics import FloatArray, IntArray
from .frames import at
from .predictions import apart

TOLERANCE = 1e-6
"""Difference of sensed and predicted variables that rounding may make, relative to their range."""


class MetVariable(NamedTuple):
    """The values met of a variable, or of the reward, beside what the scenario declares."""

    name: str
    """Of the variable, or ``reward``."""
    unit: str
    """In words of the SI."""
    low: float
    """Where its range begins; the reward has none: NaN."""
    high: float
    """Where it ends."""
    least: float
    """The least value that was sensed."""
    greatest: float
    """The greatest."""
    error: float
    """Root mean square error of what was predicted; NaN: it is not predicted."""
    persistence: float
    """The same, had it been predicted that all stays as it is."""


def predicted_steps(
    scenario: Scenario, seed: int, episode: int, joint_actions: IntArray, ahead: int = 1
) -> FloatArray:
    """Return states before some steps, as predicted, and after: ``(m, 3, n, d + 1)``.

    Behind the variables stands the reward, the mean of all agents: that of the step before, 0 at
    the start, that predicted, NaN if none is, and that received.

    Parameters
    ----------
    scenario
        Played; modified.
    seed, episode
        As in the control loop.
    joint_actions
        ``(steps, n)``; the episode may end earlier.
    ahead
        Decisions that predictions look ahead; after each joint action all are neutral for the rest,
        or do the same again in a scenario that ``repeats``.
    """
    steps = []
    paid = 0.0
    neutral: IntArray = np.full(len(scenario.agents), scenario.action_set.neutral)
    states = np.array(scenario.reset(world_seed(seed, episode), episode))
    for action in joint_actions:
        before = _with_reward(states, paid)
        predicted = _predicted(scenario, action, before)
        afterwards = action if scenario.repeats else neutral
        for joint in [action, *[afterwards] * (ahead - 1)]:
            transition = scenario.step(joint)
            states = np.array(transition.states)
            paid = float(np.mean(transition.reward))
            if transition.terminated or transition.truncated:
                break
        steps.append([before, predicted, _with_reward(states, paid)])
        if transition.terminated or transition.truncated:
            break
    return np.array(steps)


def _predicted(scenario: Scenario, joint_action: IntArray, before: FloatArray) -> FloatArray:
    """Return states and reward after a joint action, NaN where they are not predicted."""
    prediction = scenario.predict()
    if prediction is None:
        return np.full_like(before, np.nan)
    action = joint_action[None]
    states = [prediction.states(i, action)[0] for i in range(len(joint_action))]
    rewards = prediction.rewards(action)
    return _with_reward(states, np.nan if rewards is None else rewards[0])


def _with_reward(states: Sequence[FloatArray] | FloatArray, reward: float) -> FloatArray:
    return np.column_stack([np.asarray(states), np.full(len(states), reward)])


def faults_of_sensing(scenario: Scenario, steps: FloatArray) -> Iterator[str]:
    """Yield which variable is not sensed as it was predicted, step by step the farthest off.

    Parameters
    ----------
    scenario
        Whose steps they are.
    steps
        ``(m, 3, n, d + 1)`` of an episode, see `predicted_steps`.
    """
    variables = scenario.state_space.variables
    _, predicted, after = np.moveaxis(steps[..., : len(variables)], 1, 0)
    allowed = TOLERANCE * np.array([variable.high - variable.low for variable in variables])
    off = np.abs(apart(scenario, after, predicted)) / allowed
    for step in np.flatnonzero((off > 1).any(axis=(1, 2))):
        i, j = np.unravel_index(off[step].argmax(), off[step].shape)
        yield (
            f"{variables[j].name} of agent {i} is {after[step, i, j]:.6g}, predicted "
            f"{predicted[step, i, j]:.6g}, {at(int(step) + 1)}"
        )


def met_variables(scenario: Scenario, steps: FloatArray) -> tuple[MetVariable, ...]:
    """Return what was met of every variable, and of the reward, in steps ``(m, 3, n, d + 1)``."""
    before, predicted, after = np.moveaxis(steps, 1, 0)
    squares = [apart(scenario, after, guess) ** 2 for guess in (predicted, before)]
    errors = np.sqrt(np.mean(squares, axis=(1, 2)))
    numbers = np.stack([after.min(axis=(0, 1)), after.max(axis=(0, 1)), *errors], axis=1)
    claims = [(v.name, v.unit, v.low, v.high) for v in scenario.state_space.variables]
    claims.append(("reward", "1", np.nan, np.nan))
    return tuple(MetVariable(*c, *row) for c, row in zip(claims, numbers.tolist(), strict=True))
