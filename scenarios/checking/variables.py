"""Whether agents share the variables that they are said to share, and own their own."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.interface.scenario import Scenario, groups_of
from ...core.numerics.arrays import BoolArray, FloatArray, IntArray

CLOSE = 1e-9
"""Difference of predicted numbers, relative to 1 or to their size, that rounding may make."""


def apart(scenario: Scenario, states: FloatArray, others: FloatArray) -> FloatArray:
    """Return the difference of states ``(..., d)``, of periodic variables the shorter way round."""
    differences = states - others
    for j, variable in enumerate(scenario.state_space.variables):
        if variable.periodic:
            period = variable.high - variable.low
            differences[..., j] -= period * np.round(differences[..., j] / period)
    return differences


def is_close(differences: FloatArray, expected: FloatArray) -> Any:
    """Return which differences from what is expected rounding may make."""
    return np.abs(differences) <= CLOSE * np.maximum(1.0, np.abs(expected))


def differs(scenario: Scenario, states: FloatArray, expected: FloatArray) -> BoolArray:
    """Return which numbers of states ``(..., d)`` differ beyond rounding."""
    wrong: BoolArray = ~is_close(apart(scenario, np.asarray(states), expected), expected)
    return wrong


def fault_of_sharing(scenario: Scenario, states: FloatArray) -> str | None:
    """Return which variable agents are said to share and do not, in states ``(n, ..., d)``.

    Agents of a group share all that is not their own, and all agents what is ``common``.
    """
    space = scenario.state_space
    names = [variable.name for variable in space.variables]
    shared = [(group, names[space.n_own :], "shared by a group") for group in groups_of(scenario)]
    for agents, claimed, claim in [*shared, (range(len(states)), space.common, "common")]:
        first, columns = agents[0], [names.index(name) for name in claimed]
        wrong = differs(scenario, states[list(agents)], states[[first]])[..., columns]
        if wrong.any():
            where = tuple(np.argwhere(wrong)[0])
            i, here = agents[where[0]], (*where[1:-1], columns[where[-1]])
            return (
                f"{names[here[-1]]}, said to be {claim}, is {states[i][here]:.6g} of agent {i} and "
                f"{states[first][here]:.6g} of agent {first}"
            )
    return None


def own_variable_moved(
    scenario: Scenario, joint_actions: IntArray, rng: np.random.Generator
) -> str | None:
    """Return which own variable is predicted to change by what other groups do, or None.

    Predicted are joint actions ``(m, n)``, and then the same with other actions of the others.
    """
    prediction, space = scenario.predict(), scenario.state_space
    drawn = rng.integers(len(scenario.action_set), size=joint_actions.shape)
    for group in groups_of(scenario) if space.n_own else ():
        changed = drawn.copy()
        changed[:, list(group)] = joint_actions[:, list(group)]
        for agent in group:
            before, after = (prediction.states(agent, a) for a in (joint_actions, changed))
            moved = differs(scenario, after, before)[:, : space.n_own].any(axis=0)
            if moved.any():
                name = space.variables[int(moved.argmax())].name
                return (
                    f"{name} of agent {agent} changes with the actions of others, n_own = "
                    f"{space.n_own} says it does not"
                )
    return None
