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


def fault_of_sensing(
    scenario: Scenario, seed: int, episode: int, joint_actions: IntArray, *, at_rest: bool = False
) -> str | None:
    """Return which variable is not sensed as it was predicted, or None.

    Parameters
    ----------
    scenario
        Played; modified.
    seed, episode
        As in the control loop.
    joint_actions
        ``(steps, n)``; the episode may end earlier.
    at_rest
        Whether only steps count in which nothing changes.
    """
    before = scenario.reset(world_seed(seed, episode), episode)
    for step, action in enumerate(joint_actions, 1):
        prediction = scenario.predict()
        predicted = np.stack([prediction.states(i, action[None])[0] for i in range(len(action))])
        transition = scenario.step(action)
        states = transition.states
        if not at_rest or _difference(scenario, states, before) is None:
            fault = _difference(scenario, states, predicted)
            if fault is not None:
                return f"{fault} {at(step)} of seed {seed}{', at rest' if at_rest else ''}"
        if transition.terminated or transition.truncated:
            break
        before = states
    return None


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
