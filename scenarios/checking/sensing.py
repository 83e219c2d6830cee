"""Comparison of predicted states with those that follow, variable by variable.

Predictions may have errors, which are reported. Only scenarios that offer exact predictions
(``with_exact_prediction``) must sense what they predicted; a difference means that a variable is
computed in two ways.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core.agents.loop import world_seed
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario
from ...core.numerics import FloatArray, IntArray
from .episodes import when
from .predictions import state_differences

TOLERANCE = 1e-6
"""Allowed difference of sensed and predicted variables relative to their range."""
MIN_REWARDS = 20
"""Minimum number of steps from which the correlation of rewards is judged."""
MAX_OPPOSITION = -0.5
"""Correlation of predicted and received rewards from which on their signs are opposite."""


class VariableSummary(NamedTuple):
    """Declared range and observed values of a variable, or of the reward."""

    name: str
    """Name of the variable, or ``reward``."""
    unit: str
    """SI unit."""
    low: float
    """Lower end of the range; NaN for the reward."""
    high: float
    """Upper end of the range; NaN for the reward."""
    min: float
    """Minimum of the observed values."""
    max: float
    """Maximum of the observed values."""
    error: float
    """Root mean square error of predictions; NaN without predictions."""
    persistence: float
    """Root mean square error of the prediction that nothing changes."""


def predicted_steps(
    scenario: Scenario, seed: int, episode: int, joint_actions: IntArray, ahead: int = 1
) -> FloatArray:
    """Return the states before, predicted for, and after each step ``(m, 3, n, d + 1)``.

    The last column is the mean reward of all agents: that of the previous step (0 at the start),
    that predicted (NaN if it is not), and that received.

    Parameters
    ----------
    scenario
        Scenario, which is modified.
    seed, episode
        Seed and number of the episode, as in the control loop.
    joint_actions
        ``(steps, n)``; the episode may end earlier.
    ahead
        Number of decisions that predictions look ahead. After each joint action the agents take the
        neutral action, or repeat theirs if the prediction ``repeats``.
    """
    steps = []
    reward = 0.0
    neutral: IntArray = np.full(len(scenario.agents), scenario.action_set.neutral)
    states = np.array(scenario.reset(world_seed(seed, episode), episode))
    for action in joint_actions:
        before = _with_reward(states, reward)
        prediction = scenario.predict()
        predicted = _predicted(prediction, action, before)
        following = action if prediction is not None and prediction.repeats else neutral
        for joint in [action, *[following] * (ahead - 1)]:
            transition = scenario.step(joint)
            states = np.array(transition.states)
            reward = float(np.mean(transition.reward))
            if transition.terminated or transition.truncated:
                break
        steps.append([before, predicted, _with_reward(states, reward)])
        if transition.terminated or transition.truncated:
            break
    return np.array(steps)


def _predicted(
    prediction: Prediction | None, joint_action: IntArray, before: FloatArray
) -> FloatArray:
    """Return the predicted states and reward of a joint action; NaN if they are not predicted."""
    if prediction is None:
        return np.full_like(before, np.nan)
    action = joint_action[None]
    states = [prediction.states(i, action)[0] for i in range(len(joint_action))]
    rewards = prediction.rewards(action)
    return _with_reward(states, np.nan if rewards is None else rewards[0])


def _with_reward(states: Sequence[FloatArray] | FloatArray, reward: float) -> FloatArray:
    return np.column_stack([np.asarray(states), np.full(len(states), reward)])


def faults_of_sensing(scenario: Scenario, steps: FloatArray) -> Iterator[str]:
    """Yield the variable with the largest difference from its prediction, for each wrong step.

    Parameters
    ----------
    scenario
        The scenario.
    steps
        ``(m, 3, n, d + 1)`` of an episode, see `predicted_steps`.
    """
    variables = scenario.state_space.variables
    _, predicted, after = np.moveaxis(steps[..., : len(variables)], 1, 0)
    allowed = TOLERANCE * np.array([variable.high - variable.low for variable in variables])
    off = np.abs(state_differences(scenario, after, predicted)) / allowed
    for step in np.flatnonzero((off > 1).any(axis=(1, 2))):
        i, j = np.unravel_index(off[step].argmax(), off[step].shape)
        yield (
            f"{variables[j].name} of agent {i} is {after[step, i, j]:.6g}, predicted "
            f"{predicted[step, i, j]:.6g}, {when(int(step) + 1)}"
        )


def fault_of_rewards(steps: FloatArray) -> str:
    """Return what is wrong if rewards fall where they are predicted to rise, else nothing.

    Parameters
    ----------
    steps
        ``(m, 3, n, d + 1)`` of several episodes, see `predicted_steps`.
    """
    _, predicted, after = steps[:, :, 0, -1].T
    if len(steps) < MIN_REWARDS or not np.isfinite(predicted).all():
        return ""
    if min(np.ptp(predicted), np.ptp(after)) <= TOLERANCE * np.abs(after).max():
        return ""
    correlation = float(np.corrcoef(predicted, after)[0, 1])
    if correlation > MAX_OPPOSITION:
        return ""
    return (
        f"predicted and received rewards have the correlation {correlation:.2f} over "
        f"{len(steps)} steps: is the sign of one of them wrong?"
    )


def summarize_variables(scenario: Scenario, steps: FloatArray) -> tuple[VariableSummary, ...]:
    """Summarize each variable and the reward over steps ``(m, 3, n, d + 1)``."""
    before, predicted, after = np.moveaxis(steps, 1, 0)
    squares = [state_differences(scenario, after, guess) ** 2 for guess in (predicted, before)]
    errors = np.sqrt(np.mean(squares, axis=(1, 2)))
    numbers = np.stack([after.min(axis=(0, 1)), after.max(axis=(0, 1)), *errors], axis=1)
    claims = [(v.name, v.unit, v.low, v.high) for v in scenario.state_space.variables]
    claims.append(("reward", "1", np.nan, np.nan))
    return tuple(VariableSummary(*c, *row) for c, row in zip(claims, numbers.tolist(), strict=True))
