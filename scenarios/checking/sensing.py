"""Whether what is predicted is what is then sensed: state variables mean one thing.

Predictions need not come true, so that of most scenarios nothing can be said. But one that is
predicted exactly (``with_exact_prediction``) must sense what was predicted, and where nothing
moves, so must any predictor. What differs then is a variable that is computed in two ways.
"""

from __future__ import annotations

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.scenario import Scenario
from ...core.numerics.arrays import FloatArray, IntArray
from .frames import at
from .predictions import apart

TOLERANCE = 1e-6
"""Difference of sensed and predicted variables that rounding may make, relative to their range."""
LEAST_STEPS_AT_REST = 3
"""Steps that are waited for a scenario to be at rest."""


def fault_of_exact(exact: Scenario, seed: int, episode: int, joint_actions: IntArray) -> str | None:
    """Return which variable of an exactly predicted scenario is not sensed as predicted, or None.

    Parameters
    ----------
    exact
        Played; modified.
    seed, episode
        As in the control loop.
    joint_actions
        ``(steps, n)``; the episode may end earlier.
    """
    exact.reset(world_seed(seed, episode), episode)
    for step, action in enumerate(joint_actions, 1):
        predicted = _predicted(exact, action)
        transition = exact.step(action)
        fault = _difference(exact, transition.states, predicted)
        if fault is not None:
            return f"{fault} {at(step)} of seed {seed}"
        if transition.terminated or transition.truncated:
            break
    return None


def fault_at_rest(scenario: Scenario, seed: int, episode: int) -> str | None:
    """Return which variable is predicted to change where nothing moves, or None.

    Parameters
    ----------
    scenario
        Played, all agents taking the neutral action; modified.
    seed, episode
        As in the control loop.
    """
    states = scenario.reset(world_seed(seed, episode), episode)
    neutral = np.full(len(scenario.agents), scenario.action_set.neutral)
    for step in range(1, LEAST_STEPS_AT_REST + 1):
        predicted = _predicted(scenario, neutral)
        transition = scenario.step(neutral)
        at_rest = _difference(scenario, transition.states, states) is None
        fault = _difference(scenario, transition.states, predicted) if at_rest else None
        if fault is not None:
            return f"{fault} {at(step)} of seed {seed}, at rest"
        states = transition.states
        if transition.terminated or transition.truncated:
            break
    return None


def _predicted(scenario: Scenario, joint_action: IntArray) -> FloatArray:
    prediction = scenario.predict()
    states = [prediction.states(i, joint_action[None])[0] for i in range(len(joint_action))]
    return np.array(states)


def _difference(scenario: Scenario, sensed: FloatArray, predicted: FloatArray) -> str | None:
    """Return where sensed and predicted states ``(n, d)`` differ beyond rounding, or None."""
    variables = scenario.state_space.variables
    ranges = np.array([variable.high - variable.low for variable in variables])
    off = np.abs(apart(scenario, np.asarray(sensed), predicted)) / ranges
    if not (off > TOLERANCE).any():
        return None
    i, j = np.unravel_index(off.argmax(), off.shape)
    return (
        f"{variables[j].name} of agent {i} is {sensed[i, j]:.6g}, predicted {predicted[i, j]:.6g},"
    )
