"""Checks of a prediction: shapes, shared and own variables, and equivalent actions.

Shared variables must be equal for all agents that share them, and own variables must not depend on
the actions of other agents. Actions that a prediction declares as equivalent must have one outcome,
because searches predict only the first of them.
"""

from collections.abc import Iterator

import numpy as np

from ...core.interface.prediction import Prediction, states_by_group
from ...core.interface.scenario import Scenario
from ...core.numerics import BoolArray, FloatArray, IntArray

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
        Draws the actions of other groups.
    """
    prediction = scenario.predict()
    if prediction is None:
        return
    given = joint_actions.copy()
    n, m = joint_actions.T.shape
    space, groups = scenario.state_space, scenario.groups
    each = [prediction.states(i, given) for i in range(n)]
    own, shared = states_by_group(prediction, given, groups, space.n_own)
    rewards = prediction.rewards(given)
    if not np.array_equal(joint_actions, given):
        yield "the joint actions that are to be predicted are changed"
    wanted: dict[str, tuple[FloatArray, tuple[int, ...]]] = {
        f"states of agent {i}": (each[i], (m, space.n_variables)) for i in range(n)
    }
    wanted["own variables of all agents"] = own, (n, m, space.n_own)
    n_shared = space.n_variables - space.n_own
    wanted["shared variables of all groups"] = shared, (len(groups), m, n_shared)
    wanted["rewards"] = np.zeros(m) if rewards is None else rewards, (m,)
    for name, (value, shape) in wanted.items():
        if np.shape(value) != shape:
            yield f"predicted {name} of shape {np.shape(value)}, must be {shape}"
        if not np.isfinite(value).all():
            yield f"predicted {name} are not finite"
    states = np.array(each)
    for i in range(n):
        if differs(scenario, prediction.states(i, joint_actions[-1:])[0], states[i, -1]).any():
            yield f"states of agent {i} after a joint action depend on those predicted with it"
    yield from faults_of_sharing(scenario, states)
    body = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    wrong = differs(scenario, np.concatenate([own, shared[body]], axis=2), states)
    for agent, _, j in np.argwhere(wrong):
        yield f"states_by_group and states differ in {space.variables[j].name} of agent {agent}"
    yield from _wrong_equivalents(scenario, prediction, joint_actions, states)
    yield from _own_variable_moved(scenario, prediction, joint_actions, rng)


def _wrong_equivalents(
    scenario: Scenario, prediction: Prediction, joint_actions: IntArray, states: FloatArray
) -> Iterator[str]:
    """Yield robot actions that are declared as equivalent and have other outcomes."""
    alike = prediction.alike
    if alike is None:
        return
    n_actions = len(scenario.action_set)
    shape = len(scenario.groups), n_actions ** max(map(len, scenario.groups))
    if np.shape(alike) != shape:
        yield f"alike of shape {np.shape(alike)}, must be {shape}"
        return
    replaced = joint_actions.copy()
    for group, equivalent in zip(scenario.groups, alike, strict=True):
        members = list(group)
        places = n_actions ** np.arange(len(members))[::-1]
        first = equivalent[: n_actions * places[0]]
        is_earlier = (first >= 0) & (first <= np.arange(len(first)))
        if not is_earlier.all() or (first[first] != first).any():
            yield "alike must hold the first equivalent robot-action index of each index"
            return
        actions = first[joint_actions[:, members] @ places]
        replaced[:, members] = actions[:, None] // places % n_actions
    for agent, expected in enumerate(states):
        wrong = differs(scenario, prediction.states(agent, replaced), expected)
        for row, j in np.argwhere(wrong):
            yield (
                f"{scenario.state_space.variables[j].name} of agent {agent} differs after joint "
                f"actions {joint_actions[row].tolist()} and {replaced[row].tolist()}, which alike "
                "declares as equivalent"
            )


def state_differences(scenario: Scenario, states: FloatArray, others: FloatArray) -> FloatArray:
    """Return differences of states ``(..., d)``; those of periodic variables are wrapped."""
    differences = states - others
    for j, variable in enumerate(scenario.state_space.variables):
        if variable.periodic:
            period = variable.high - variable.low
            differences[..., j] -= period * np.round(differences[..., j] / period)
    return differences


def differs(scenario: Scenario, states: FloatArray, expected: FloatArray) -> BoolArray:
    """Return whether states ``(..., d)`` differ by more than rounding."""
    differences = np.abs(state_differences(scenario, np.asarray(states), expected))
    far: BoolArray = ~(differences <= TOLERANCE * np.maximum(1.0, np.abs(expected)))
    return far


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
                    f"others, n_own = {space.n_own} says it does not; list it after the own "
                    "variables and lower n_own"
                )
