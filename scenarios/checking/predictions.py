"""Whether a prediction has the right shapes, and its tables say what it says itself.

Where few agents are free, decisions are not made by `Prediction.states` and `rewards`, but by its
tables over all joint actions, `blocks` and `reward_table`. Compiled kernels read them without
looking at their sizes: a row too few is read from somewhere else in memory.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.interface.prediction import Blocks, states_by_group
from ...core.interface.scenario import Scenario, groups_of
from ...core.numerics.arrays import BoolArray, FloatArray, IntArray

MOST_JOINT_ACTIONS = 4**8
"""Joint actions beyond which no tables are asked for: they might not fit into memory."""
SAMPLED = 1024
"""Joint actions that are compared, at most; if there are more they are drawn."""
CLOSE = 1e-9
"""Difference of predicted numbers, relative to 1 or to their size, that rounding may make."""


def fault_of_prediction(
    scenario: Scenario, joint_actions: IntArray, rng: np.random.Generator
) -> str | None:
    """Return what is wrong with what a scenario predicts from its present state, or None.

    Parameters
    ----------
    scenario
        Asked to predict.
    joint_actions
        ``(m, n)`` what to predict.
    rng
        Draws the joint actions for which tables are compared, where there are many.
    """
    prediction: Any = scenario.predict()
    n, m, d = len(scenario.agents), len(joint_actions), scenario.state_space.n_variables
    groups, n_own = groups_of(scenario), scenario.state_space.n_own
    each = [prediction.states(i, joint_actions) for i in range(n)]
    own, shared = states_by_group(prediction, joint_actions, groups, n_own)
    wanted: dict[str, tuple[Any, tuple[int, ...]]] = {
        f"states of agent {i}": (states, (m, d)) for i, states in enumerate(each)
    }
    wanted["own variables of all agents"] = own, (n, m, n_own)
    wanted["shared variables of all groups"] = shared, (len(groups), m, d - n_own)
    if hasattr(prediction, "rewards"):
        wanted["rewards"] = prediction.rewards(joint_actions), (m,)
    for name, (value, shape) in wanted.items():
        if np.shape(value) != shape:
            return f"predicted {name} of shape {np.shape(value)}, must be {shape}"
        if not np.isfinite(value).all():
            return f"predicted {name} are not finite"
    body = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    by_group = np.concatenate([np.asarray(own), np.asarray(shared)[body]], axis=2)
    wrong = _differs(scenario, by_group, np.array(each))
    if wrong.any():
        grouped = hasattr(prediction, "states_by_group")
        source = "states_by_group" if grouped else "shared variables of a group"
        agent, _, j = np.argwhere(wrong)[0]
        name = scenario.state_space.variables[j].name
        return f"{source} and states differ in {name} of agent {agent}"
    if hasattr(prediction, "blocks") and hasattr(prediction, "reward_table"):
        return _wrong_tables(scenario, prediction, rng)
    return None


def apart(scenario: Scenario, states: FloatArray, others: FloatArray) -> FloatArray:
    """Return the difference of states ``(..., d)``, of periodic variables the shorter way round."""
    differences = states - others
    for j, variable in enumerate(scenario.state_space.variables):
        if variable.periodic:
            period = variable.high - variable.low
            differences[..., j] -= period * np.round(differences[..., j] / period)
    return differences


def _differs(scenario: Scenario, states: FloatArray, expected: FloatArray) -> BoolArray:
    """Return which numbers of states ``(..., d)`` differ beyond rounding."""
    return ~_is_close(apart(scenario, np.asarray(states), expected), expected)


def _is_close(differences: FloatArray, expected: FloatArray) -> Any:
    return np.abs(differences) <= CLOSE * np.maximum(1.0, np.abs(expected))


def _wrong_tables(scenario: Scenario, prediction: Any, rng: np.random.Generator) -> str | None:
    """Return where the tables differ from the prediction, whose states are taken to be right."""
    n, n_actions = len(scenario.agents), len(scenario.action_set)
    count = n_actions**n
    if count > MOST_JOINT_ACTIONS:
        return None
    indices: IntArray = np.arange(count)
    if count > SAMPLED:
        indices = np.sort(rng.choice(count, SAMPLED, replace=False))
    joint_actions = np.stack(np.unravel_index(indices, (n_actions,) * n), axis=-1)
    behind = n
    for group in groups_of(scenario):
        behind -= len(group)
        for agent in group:
            blocks, divisor = prediction.blocks(agent), n_actions**behind
            if blocks.divisor != divisor:
                return f"blocks of agent {agent}: divisor = {blocks.divisor}, must be {divisor}"
            fault = _misshapen(blocks, n_actions ** len(group), count, scenario)
            if fault is not None:
                return f"blocks of agent {agent}: {fault}"
            expected, actual = prediction.states(agent, joint_actions), blocks.states(indices)
            wrong = _differs(scenario, actual, np.asarray(expected))
            if blocks.alone:
                wrong[:, : scenario.state_space.n_own] = False
            if wrong.any():
                row, j = np.argwhere(wrong)[0]
                return (
                    f"blocks of agent {agent}: {scenario.state_space.variables[j].name} = "
                    f"{actual[row, j]:.6g} after joint action {joint_actions[row].tolist()}, "
                    f"states has {expected[row, j]:.6g}"
                )
    return _wrong_rewards(prediction, indices, joint_actions, count)


def _misshapen(blocks: Blocks, n_own_rows: int, count: int, scenario: Scenario) -> str | None:
    """Return what would have a kernel read the wrong row, or none."""
    n_own, d = scenario.state_space.n_own, scenario.state_space.n_variables
    for name, table, rows, width, n_rows in (
        ("own", blocks.own, blocks.own_rows, n_own, n_own_rows),
        ("shared", blocks.shared, blocks.shared_rows, d - n_own, count),
    ):
        if np.shape(table)[1:] != (width,) or not len(table):
            return f"{name} of shape {np.shape(table)}, must be (rows, {width})"
        if not np.isfinite(table).all():
            return f"{name} is not finite"
        nothing = name == "own" and not width and len(table) == 1
        if not len(rows) and len(table) != n_rows and not nothing:
            return f"{name} has {len(table)} rows and no {name}_rows, must have {n_rows} rows"
        if len(rows) and len(rows) != n_rows:
            return f"{name}_rows has {len(rows)} entries, must have {n_rows}"
        if len(rows) and not 0 <= rows.min() <= rows.max() < len(table):
            return (
                f"{name}_rows names rows {rows.min()} to {rows.max()}, {name} has {len(table)} rows"
            )
    return None


def _wrong_rewards(
    prediction: Any, indices: IntArray, joint_actions: IntArray, count: int
) -> str | None:
    if not hasattr(prediction, "rewards"):
        return None
    table, expected = prediction.reward_table(), np.asarray(prediction.rewards(joint_actions))
    if np.shape(table) != (count,):
        return f"reward_table of shape {np.shape(table)}, must be {(count,)}"
    actual = np.asarray(table)[indices]
    wrong = ~_is_close(actual - expected, expected)
    if not wrong.any():
        return None
    row = wrong.argmax()
    return (
        f"reward_table: {actual[row]:.6g} after joint action {joint_actions[row].tolist()}, "
        f"rewards has {expected[row]:.6g}"
    )
