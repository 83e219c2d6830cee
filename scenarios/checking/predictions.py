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
from ...core.numerics.arrays import FloatArray, IntArray

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
    each = [prediction.states(i, joint_actions) for i in range(n)]
    wanted: dict[str, tuple[Any, tuple[int, ...]]] = {
        f"states of agent {i}": (states, (m, d)) for i, states in enumerate(each)
    }
    if hasattr(prediction, "rewards"):
        wanted["rewards"] = prediction.rewards(joint_actions), (m,)
    if hasattr(prediction, "states_of_all"):
        wanted["states of all agents"] = prediction.states_of_all(joint_actions), (n, m, d)
    groups, n_own = groups_of(scenario), scenario.state_space.n_own
    own, shared = states_by_group(prediction, joint_actions, groups, n_own)
    wanted["own variables of all agents"] = own, (n, m, n_own)
    wanted["shared variables of all groups"] = shared, (len(groups), m, d - n_own)
    for name, (value, shape) in wanted.items():
        if np.shape(value) != shape:
            return f"predicted {name} of shape {np.shape(value)}, must be {shape}"
        if not np.isfinite(value).all():
            return f"predicted {name} are not finite"
    body = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    by_group = np.concatenate([np.asarray(own), np.asarray(shared)[body]], axis=2)
    grouped = hasattr(prediction, "states_by_group")
    sources = {"states_by_group" if grouped else "shared variables of a group": by_group}
    if hasattr(prediction, "states_of_all"):
        together = np.asarray(wanted["states of all agents"][0])
        sources = {"states_of_all": together, **sources}
    for source, states in sources.items():
        wrong = ~_close(apart(scenario, states, np.array(each)), np.array(each))
        if wrong.any():
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
            blocks = prediction.blocks(agent)
            fault = _misshapen(
                blocks, n_actions ** len(group), count, n_actions**behind, scenario
            ) or _contradicted(
                blocks, indices, joint_actions, prediction.states(agent, joint_actions), scenario
            )
            if fault is not None:
                return f"blocks of agent {agent}: {fault}"
    if hasattr(prediction, "rewards"):
        return _wrong_rewards(prediction, count, indices, joint_actions)
    return None


def _misshapen(
    blocks: Blocks, n_own_rows: int, n_shared_rows: int, divisor: int, scenario: Scenario
) -> str | None:
    """Return what would have a kernel read the wrong row, or none."""
    n_own, d = scenario.state_space.n_own, scenario.state_space.n_variables
    if blocks.divisor != divisor:
        return f"divisor = {blocks.divisor}, must be {divisor}"
    for name, table, rows, width, count in (
        ("own", blocks.own, blocks.own_rows, n_own, n_own_rows),
        ("shared", blocks.shared, blocks.shared_rows, d - n_own, n_shared_rows),
    ):
        for part, array, kinds, axes in (
            (name, table, "f", 2), (f"{name}_rows", rows, "iu", 1),
        ):  # fmt: skip
            kind = "floats" if kinds == "f" else "integers"
            if not isinstance(array, np.ndarray) or array.dtype.kind not in kinds:
                return f"{part} is {_type(array)}, must be an array of {kind}"
            if array.ndim != axes:
                return f"{part} of shape {array.shape}, must have {axes} axes"
        if table.shape[1] != width or not len(table):
            return f"{name} of shape {table.shape}, must be (rows, {width})"
        if not np.isfinite(table).all():
            return f"{name} is not finite"
        nothing = name == "own" and not width and len(table) == 1
        if not len(rows) and len(table) != count and not nothing:
            return f"{name} has {len(table)} rows and no {name}_rows, must have {count} rows"
        if len(rows) and len(rows) != count:
            return f"{name}_rows has {len(rows)} entries, must have {count}"
        if len(rows) and not 0 <= rows.min() <= rows.max() < len(table):
            return (
                f"{name}_rows names rows {rows.min()} to {rows.max()}, {name} has {len(table)} rows"
            )
    return None


def _contradicted(
    blocks: Blocks,
    indices: IntArray,
    joint_actions: IntArray,
    expected: FloatArray,
    scenario: Scenario,
) -> str | None:
    """Return where blocks and states differ, or none; own variables as if alone may."""
    space = scenario.state_space
    expected, found = np.asarray(expected), blocks.states(indices)
    wrong = ~_close(apart(scenario, found, expected), expected)
    if blocks.alone:
        wrong[:, : space.n_own] = False
    if not wrong.any():
        return None
    row, j = np.argwhere(wrong)[0]
    return (
        f"{space.variables[j].name} = {found[row, j]:.6g} after joint action "
        f"{joint_actions[row].tolist()}, states has {expected[row, j]:.6g}"
    )


def _wrong_rewards(
    prediction: Any, count: int, indices: IntArray, joint_actions: IntArray
) -> str | None:
    table = prediction.reward_table()
    if np.shape(table) != (count,):
        return f"reward_table of shape {np.shape(table)}, must be {(count,)}"
    expected, found = np.asarray(prediction.rewards(joint_actions)), np.asarray(table)[indices]
    wrong = np.flatnonzero(~_close(found - expected, expected))
    if not len(wrong):
        return None
    row = wrong[0]
    return (
        f"reward_table: {found[row]:.6g} after joint action {joint_actions[row].tolist()}, "
        f"rewards has {expected[row]:.6g}"
    )


def _close(differences: FloatArray, expected: FloatArray) -> Any:
    return np.abs(differences) <= CLOSE * np.maximum(1.0, np.abs(expected))


def _type(array: Any) -> str:
    return f"{array.dtype}" if isinstance(array, np.ndarray) else type(array).__name__
