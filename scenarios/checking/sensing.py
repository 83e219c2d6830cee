"""What is predicted beside what is then sensed: state variables mean one thing.

Predictions need not come true, so that of most scenarios no more can be said than by how much they
are off. But one that is predicted exactly (``with_exact_prediction``) must sense what was
predicted. What differs then is a variable that is computed in two ways.
"""

from collections.abc import Iterator, Mapping
from math import isnan
from typing import NamedTuple

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.scenario import Scenario
from ...core.numerics import FloatArray, IntArray
from .frames import at
from .predictions import apart

TOLERANCE = 1e-6
"""Difference of sensed and predicted variables that rounding may make, relative to their range."""
SMALL = 0.02
"""Error of prediction, in ranges of the variable, of which no word is lost."""
FAR = 10
"""Ranges beyond its own at which a variable looks as if it were in another unit."""


class MetVariable(NamedTuple):
    """What was met of a variable, or of the reward, beside what is said of it."""

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
    steps, paid = [], 0.0
    repeats = getattr(scenario, "repeats", False)
    neutral: IntArray = np.full(len(scenario.agents), scenario.action_set.neutral)
    states = np.array(scenario.reset(world_seed(seed, episode), episode))
    for action in joint_actions:
        before = _with_reward(states, paid)
        predicted = _predicted(scenario, action, before)
        for joint in [action, *[action if repeats else neutral] * (ahead - 1)]:
            transition = scenario.step(joint)
            states, paid = np.array(transition.states), float(np.mean(transition.reward))
            if transition.terminated or transition.truncated:
                break
        steps.append([before, predicted, _with_reward(states, paid)])
        if transition.terminated or transition.truncated:
            break
    return np.array(steps)


def _predicted(scenario: Scenario, joint_action: IntArray, before: FloatArray) -> FloatArray:
    """Return states and reward after a joint action, NaN where they are not predicted."""
    if not hasattr(scenario, "predict"):
        return np.full_like(before, np.nan)
    prediction, action = scenario.predict(), joint_action[None]
    states = [prediction.states(i, action)[0] for i in range(len(joint_action))]
    rewards = getattr(prediction, "rewards", None)
    return _with_reward(states, np.nan if rewards is None else rewards(action)[0])


def _with_reward(states: FloatArray | list[FloatArray], reward: float) -> FloatArray:
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
    error, persistence = (
        np.sqrt((apart(scenario, after, guess) ** 2).mean(axis=(0, 1)))
        for guess in (predicted, before)
    )
    numbers = np.stack([after.min(axis=(0, 1)), after.max(axis=(0, 1)), error, persistence], 1)
    claims = [(v.name, v.unit, v.low, v.high) for v in scenario.state_space.variables]
    claims.append(("reward", "1", np.nan, np.nan))
    return tuple(MetVariable(*c, *row) for c, row in zip(claims, numbers.tolist(), strict=True))


class Findings(NamedTuple):
    """What came of a check that found no fault."""

    passed: tuple[str, ...]
    """Names of the checks that were passed."""
    unchecked: Mapping[str, str]
    """Why something was not checked, by its name."""
    variables: tuple[MetVariable, ...]
    """What was met of every variable and of the reward."""

    def warnings(self) -> Iterator[str]:
        """Yield what is allowed and looks wrong, a line each."""
        for v in self.variables:
            width = v.greatest - v.least if isnan(v.low) else v.high - v.low
            if v.error >= max(v.persistence, SMALL * width) > 0:
                yield f"{v.name} is predicted no better than if it stayed as it is"
            if max(v.low - v.least, v.greatest - v.high) > FAR * width:
                yield f"{v.name} goes more than {FAR} times its range beyond it"
