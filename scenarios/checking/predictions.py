"""Checks of a prediction: shapes, shared and own variables, and tables of all joint actions.

Shared variables must be equal for all agents that share them, and own variables must not depend on
the actions of other agents. Compiled kernels read the tables of a prediction without checking their
sizes, so a missing row would be read from elsewhere in memory.
"""

from collections.abc import Iterator

import numpy as np

from ...core.interface.prediction import Blocks, Prediction, Tables, states_by_group
from ...core.interface.scenario import Scenario
from ...core.numerics import BoolArray, FloatArray, IntArray

MAX_JOINT_ACTIONS = 4**8
"""Maximum number of joint actions for which tables are requested, to limit memory."""
MAX_COMPARED = 1024
"""Maximum number of joint actions that are compared; of more a sample is drawn."""
TOLERANCE = 1e-9
"""Allowed difference of predicted numbers, relative to the larger of 1 and their size."""


def faults_of_prediction(
    scenario: Scenario, joint_actions: IntArray, rng: np.random.Generator
) -> Iterator[str]:
    """Yield the faults of a scenario's prediction from its present state.

    Parameters
    ----------
    scenario
        The scenario.
    joint_actions
        ``(m, n)`` joint actions to predict.
    rng
        Draws the joint actions for which large tables are compared.
    """
    prediction = scenario.predict()
    if prediction is None:
        return
    unchanged = joint_actions.copy()
    faults = [*_misformed(scenario, prediction, joint_actions)]
    if not np.array_equal(joint_actions, unchanged):
        yield "the joint actions that are to be predicted are changed"
    yield from faults
    states = np.array([prediction.states(i, unchanged) for i in range(len(scenario.agents))])
    for i in range(len(states)):
        if differs(scenario, prediction.states(i, unchanged[-1:])[0], states[i, -1]).any():
            yield f"states of agent {i} after a joint action depend on those predicted with it"
    yield from faults_of_sharing(scenario, states)
    yield from _wrong_groups(scenario, prediction, unchanged, states)
    tables = prediction.tables()
    if tables is not None and tables.rewarded:
        yield from _wrong_tables(scenario, prediction, tables, rng)
    else:
        yield from _own_variable_moved(scenario, prediction, unchanged, rng)


def too_many_joint_actions(scenario: Scenario) -> str:
    """Return why the tables of a scenario are not checked; empty if they are."""
    count = len(scenario.action_set) ** len(scenario.agents)
    return f"more than {MAX_JOINT_ACTIONS:,} joint actions" if count > MAX_JOINT_ACTIONS else ""


def _misformed(
    scenario: Scenario, prediction: Prediction, joint_actions: IntArray
) -> Iterator[str]:
    """Yield predictions with a wrong shape, or that are not finite."""
    n = len(scenario.agents)
    m = len(joint_actions)
    d = scenario.state_space.n_variables
    groups = scenario.groups
    n_own = scenario.state_space.n_own
    wanted: dict[str, tuple[FloatArray, tuple[int, ...]]] = {
        f"states of agent {i}": (prediction.states(i, joint_actions), (m, d)) for i in range(n)
    }
    own, shared = states_by_group(prediction, joint_actions, groups, n_own)
    wanted["own variables of all agents"] = own, (n, m, n_own)
    wanted["shared variables of all groups"] = shared, (len(groups), m, d - n_own)
    rewards = prediction.rewards(joint_actions)
    if rewards is not None:
        wanted["rewards"] = rewards, (m,)
    for name, (value, shape) in wanted.items():
        if np.shape(value) != shape:
            yield f"predicted {name} of shape {np.shape(value)}, must be {shape}"
        if not np.isfinite(value).all():
            yield f"predicted {name} are not finite"


def _wrong_groups(
    scenario: Scenario, prediction: Prediction, joint_actions: IntArray, states: FloatArray
) -> Iterator[str]:
    """Yield differences between the predictions of all agents and of each agent."""
    groups = scenario.groups
    own, shared = states_by_group(prediction, joint_actions, groups, scenario.state_space.n_own)
    body = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    wrong = differs(scenario, np.concatenate([own, shared[body]], axis=2), states)
    for agent, _, j in np.argwhere(wrong):
        name = scenario.state_space.variables[j].name
        yield f"states_by_group and states differ in {name} of agent {agent}"


def _wrong_tables(
    scenario: Scenario, prediction: Prediction, tables: Tables, rng: np.random.Generator
) -> Iterator[str]:
    """Yield differences between the tables and the predicted states."""
    n = len(scenario.agents)
    n_actions = len(scenario.action_set)
    count = n_actions**n
    if too_many_joint_actions(scenario):
        return
    indices = np.sort(rng.choice(count, min(count, MAX_COMPARED), replace=False))
    joint_actions = np.stack(np.unravel_index(indices, (n_actions,) * n), axis=-1)
    for group in scenario.groups:
        divisor = n_actions ** (n - 1 - group[-1])
        for agent in group:
            blocks = tables.blocks(agent)
            which = f"blocks of agent {agent}:"
            if blocks.divisor != divisor:
                yield f"{which} divisor = {blocks.divisor}, must be {divisor}"
            for fault in _misshapen(blocks, n_actions ** len(group), count, scenario):
                yield f"{which} {fault}"
            expected = prediction.states(agent, joint_actions)
            actual = blocks.states(indices)
            wrong = differs(scenario, actual, np.asarray(expected))
            if blocks.alone:
                wrong[:, : scenario.state_space.n_own] = False
            for row, j in np.argwhere(wrong):
                yield (
                    f"{which} {scenario.state_space.variables[j].name} = {actual[row, j]:.6g} "
                    f"after joint action {joint_actions[row].tolist()}, "
                    f"states has {expected[row, j]:.6g}"
                )
    yield from _wrong_rewards(prediction, tables, indices, joint_actions, count)


def _misshapen(blocks: Blocks, n_own_rows: int, count: int, scenario: Scenario) -> Iterator[str]:
    """Yield wrong shapes of blocks, which would make a kernel read a wrong row."""
    n_own = scenario.state_space.n_own
    d = scenario.state_space.n_variables
    for name, table, rows, width, n_rows in (
        ("own", blocks.own, blocks.own_rows, n_own, n_own_rows),
        ("shared", blocks.shared, blocks.shared_rows, d - n_own, count),
    ):
        if np.shape(table)[1:] != (width,) or not len(table):
            yield f"{name} of shape {np.shape(table)}, must be (rows, {width})"
        if not np.isfinite(table).all():
            yield f"{name} is not finite"
        nothing = name == "own" and not width and len(table) == 1
        if not len(rows) and len(table) != n_rows and not nothing:
            yield f"{name} has {len(table)} rows and no {name}_rows, must have {n_rows} rows"
        if len(rows) and len(rows) != n_rows:
            yield f"{name}_rows has {len(rows)} entries, must have {n_rows}"
        if len(rows) and not 0 <= rows.min() <= rows.max() < len(table):
            named = f"{name}_rows names rows {rows.min()} to {rows.max()}"
            yield f"{named}, {name} has {len(table)} rows"


def _wrong_rewards(
    prediction: Prediction,
    tables: Tables,
    indices: IntArray,
    joint_actions: IntArray,
    count: int,
) -> Iterator[str]:
    rewards = prediction.rewards(joint_actions)
    if rewards is None:
        return
    table = tables.reward_table()
    expected = np.asarray(rewards)
    if np.shape(table) != (count,):
        yield f"reward_table of shape {np.shape(table)}, must be {(count,)}"
    actual = np.asarray(table)[indices]
    for row in np.flatnonzero(~is_close(actual - expected, expected)):
        yield (
            f"reward_table: {actual[row]:.6g} after joint action {joint_actions[row].tolist()}, "
            f"rewards has {expected[row]:.6g}"
        )


def state_differences(scenario: Scenario, states: FloatArray, others: FloatArray) -> FloatArray:
    """Return differences of states ``(..., d)``; those of periodic variables are wrapped."""
    differences = states - others
    for j, variable in enumerate(scenario.state_space.variables):
        if variable.periodic:
            period = variable.high - variable.low
            differences[..., j] -= period * np.round(differences[..., j] / period)
    return differences


def is_close(differences: FloatArray, expected: FloatArray) -> BoolArray:
    """Return whether differences from expected values are within rounding."""
    close: BoolArray = np.abs(differences) <= TOLERANCE * np.maximum(1.0, np.abs(expected))
    return close


def differs(scenario: Scenario, states: FloatArray, expected: FloatArray) -> BoolArray:
    """Return whether states ``(..., d)`` differ by more than rounding."""
    return ~is_close(state_differences(scenario, np.asarray(states), expected), expected)


def faults_of_sharing(scenario: Scenario, states: FloatArray) -> Iterator[str]:
    """Yield shared variables that differ between agents in states ``(n, ..., d)``.

    Agents of a group share all variables except their own; all agents share ``common`` ones.
    """
    space = scenario.state_space
    names = [variable.name for variable in space.variables]
    shared = [(group, names[space.n_own :], "shared by a group") for group in scenario.groups]
    for agents, claimed, claim in [*shared, (range(len(states)), space.common, "common")]:
        first = agents[0]
        columns = [names.index(name) for name in claimed]
        wrong = differs(scenario, states[list(agents)], states[[first]])[..., columns]
        for member, *where, column in np.argwhere(wrong):
            i = agents[member]
            here = (*where, columns[column])
            yield (
                f"{names[here[-1]]}, said to be {claim}, is {states[i][here]:.6g} of agent {i} and "
                f"{states[first][here]:.6g} of agent {first}"
            )


def _own_variable_moved(
    scenario: Scenario, prediction: Prediction, joint_actions: IntArray, rng: np.random.Generator
) -> Iterator[str]:
    """Yield own variables of which predictions depend on the actions of other groups.

    Joint actions ``(m, n)`` are predicted twice, with different actions of the other groups.
    """
    space = scenario.state_space
    drawn = rng.integers(len(scenario.action_set), size=joint_actions.shape)
    for group in scenario.groups if space.n_own else ():
        changed = drawn.copy()
        changed[:, list(group)] = joint_actions[:, list(group)]
        for agent in group:
            before = prediction.states(agent, joint_actions)
            after = prediction.states(agent, changed)
            moved = differs(scenario, after, before)[:, : space.n_own].any(axis=0)
            for j in np.flatnonzero(moved):
                yield (
                    f"{space.variables[j].name} of agent {agent} changes with the actions of "
                    f"others, n_own = {space.n_own} says it does not"
                )
