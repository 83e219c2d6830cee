"""What is predicted beside what is then sensed: state variables mean one thing.

Predictions need not come true, so that of most scenarios no more can be said than by how much they
are off. But one that is predicted exactly (``with_exact_prediction``) must sense what was
predicted. What differs then is a variable that is computed in two ways.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.scenario import Scenario
from ...core.numerics.arrays import FloatArray, IntArray
from .frames import at
from .variables import apart

TOLERANCE = 1e-6
"""Difference of sensed and predicted variables that rounding may make, relative to their range."""


class MetVariable(NamedTuple):
    """What was met of a variable, or of the reward, beside what is said of it."""

    name: str
    """Of the variable, or ``reward``."""
    unit: str
    """In words of the SI."""
    claimed: tuple[float, float] | None
    """Its range; the reward has none."""
    met: tuple[float, float]
    """The least and the greatest value that was sensed."""
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
        Decisions that predictions look ahead; after each joint action all are neutral for the rest.
    """
    steps, paid = [], 0.0
    states = np.array(scenario.reset(world_seed(seed, episode), episode))
    for action in joint_actions:
        prediction = scenario.predict()
        rewards = getattr(prediction, "rewards", None)
        foretold = [prediction.states(i, action[None])[0] for i in range(len(action))]
        before = _with_reward(states, paid)
        predicted = _with_reward(foretold, np.nan if rewards is None else rewards(action[None])[0])
        for joint in [action, *[np.full_like(action, scenario.action_set.neutral)] * (ahead - 1)]:
            transition = scenario.step(joint)
            states, paid = np.array(transition.states), float(np.mean(transition.reward))
            if transition.terminated or transition.truncated:
                break
        steps.append([before, predicted, _with_reward(states, paid)])
        if transition.terminated or transition.truncated:
            break
    return np.array(steps)


def _with_reward(states: FloatArray | list[FloatArray], reward: float) -> FloatArray:
    return np.column_stack([np.asarray(states), np.full(len(states), reward)])


def fault_of_sensing(scenario: Scenario, steps: FloatArray) -> str | None:
    """Return which variable is not sensed as it was predicted, or None.

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
    late = (off > 1).any(axis=(1, 2))
    if not late.any():
        return None
    step = int(late.argmax())
    i, j = np.unravel_index(off[step].argmax(), off[step].shape)
    return (
        f"{variables[j].name} of agent {i} is {after[step, i, j]:.6g}, predicted "
        f"{predicted[step, i, j]:.6g}, {at(step + 1)}"
    )


def met_variables(scenario: Scenario, steps: FloatArray) -> tuple[MetVariable, ...]:
    """Return what was met of every variable, and of the reward, in steps ``(m, 3, n, d + 1)``."""
    before, predicted, after = np.moveaxis(steps, 1, 0)
    error, persistence = (
        np.sqrt((apart(scenario, after, guess) ** 2).mean(axis=(0, 1)))
        for guess in (predicted, before)
    )
    met = zip(after.min(axis=(0, 1)), after.max(axis=(0, 1)), strict=True)
    claims = [(v.name, v.unit, (v.low, v.high)) for v in scenario.state_space.variables]
    rows = zip([*claims, ("reward", "1", None)], met, error, persistence, strict=True)
    return tuple(MetVariable(*claim, *numbers) for claim, *numbers in rows)
