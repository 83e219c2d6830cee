"""Best responses of all robots in one compiled call.

The value of a joint action is the same in both rounds: the values of a robot's actions are kept
until another robot's wheel commands change. Robots are evaluated in batches, which grow while
robots keep to the plan. The result and the random numbers equal those of `BestResponse`;
`tests/scenarios/box_pushing/prediction` compares the two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....core.interface.prediction import Exploring
from ....core.numerics import FloatArray, IntArray, njit
from ....core.search.drawing import choose_action, draw
from ....core.values.triangular import summed_values
from ..states.kernel import Columns, evaluate
from ..states.situations import SituationBatch
from .models import PushModel
from .push import push
from .wheel_commands import WheelCommands, robot_actions, speeds_of

MAX_BODIES_AHEAD = 4
"""Maximum number of robots evaluated in one batch while most of them keep to the plan."""


class Outlook(NamedTuple):
    """Present situation, model and value function."""

    robots: FloatArray
    """``(M, 3)`` present poses."""
    box: FloatArray
    """``(3,)`` pose."""
    goal: FloatArray
    """``(3,)`` pose."""
    seconds: float
    """Prediction horizon [s]."""
    periods: float
    """Prediction horizon in decision periods."""
    model: PushModel
    """Model of robots and box."""
    commands: WheelCommands
    """Commands of the robots."""
    columns: Columns
    """Columns of `evaluate`."""
    values: tuple[
        tuple[FloatArray, FloatArray, FloatArray],
        IntArray,
        IntArray,
        tuple[IntArray, IntArray, IntArray],
        FloatArray,
    ]
    """Arguments of `summed_values`, except the states."""


class _Plan(NamedTuple):
    """Plan of all robots."""

    actions: IntArray
    """``(M,)`` robot actions."""
    values: FloatArray
    """``(M, A ** w)`` last computed values of each robot's actions."""
    others: IntArray
    """``(M, M)`` actions of all robots at that time; -1 before."""


@njit(cache=True)
def _values_of(actions: IntArray, outlook: Outlook) -> FloatArray:
    """Return the mean value ``(m,)`` of robot actions ``(M, m)`` over the agents."""
    model, commands = outlook.model, outlook.commands
    robots, box, gaps = push(
        outlook.robots, outlook.box, commands.twists, actions, outlook.seconds, model
    )
    origins = np.expand_dims(outlook.box, 1)
    batch = SituationBatch(robots, box, gaps, outlook.goal, origins, outlook.periods, model.shape)
    shared = evaluate(batch, np.arange(len(actions)), outlook.columns)
    own = np.expand_dims(speeds_of(actions, commands.speeds), 2)
    weights, agents, firsts, terms, variables = outlook.values
    total = summed_values(weights, agents, firsts, terms, own, shared, variables)
    return total / len(agents)


@njit(cache=True)
def _is_valid(plan: _Plan, robot: int) -> bool:
    """Return whether the values of a robot's actions still hold."""
    for i in range(len(plan.actions)):
        if plan.others[robot, i] < 0 or (i != robot and plan.others[robot, i] != plan.actions[i]):
            return False
    return True


@njit(cache=True)
def _variations(robots: IntArray, plan: _Plan, alike: IntArray) -> IntArray:
    """Return robot actions ``(M, m)`` that differ from the plan in the command of one robot."""
    actions = np.empty((len(alike), len(robots) * alike.shape[1]), np.int64)
    m = 0
    for r in robots:
        for a in range(alike.shape[1]):
            if alike[r, a] == a != plan.actions[r]:
                for i in range(len(plan.actions)):  # a slice takes two seconds to compile
                    actions[i, m] = plan.actions[i]
                actions[r, m] = a
                m += 1
    return actions[:, :m].copy()


@njit(cache=True)
def _store(
    robots: IntArray, value: float, values: FloatArray, plan: _Plan, alike: IntArray
) -> None:
    """Store the values of robots' actions, given that of the plan and those of variations."""
    m = 0
    for r in robots:
        for i in range(len(plan.actions)):
            plan.others[r, i] = plan.actions[i]
        for a in range(alike.shape[1]):
            first = alike[r, a]
            if first == plan.actions[r]:
                plan.values[r, a] = value
            elif first == a:
                plan.values[r, a] = values[m]
                m += 1
            else:
                plan.values[r, a] = plan.values[r, first]


@njit(cache=True)
def _improve(values: FloatArray, alike: IntArray, rng: np.random.Generator) -> int:
    """Return the best action among those with different commands; -1 if there is none."""
    distinct = np.empty(len(values), np.int64)
    count = 0
    for a in range(len(values)):
        if alike[a] == a:
            distinct[count] = a
            count += 1
    best = draw(values[distinct[:count]], rng)
    return distinct[best] if best >= 0 else -1


@njit(cache=True)
def _decide(
    robot: int,
    values: FloatArray,
    joint: IntArray,
    n_actions: int,
    exploring: Exploring,
    rng: np.random.Generator,
) -> int:
    """Let the wheels of a robot decide in turn; return its action, -1 if no value is greatest."""
    wheels = len(joint)
    by_action = np.empty(n_actions)
    action = 0
    for j in range(wheels):
        places = n_actions ** (wheels - 1 - j)
        left = values[action * n_actions * places : (action + 1) * n_actions * places]
        if draw(left, rng) < 0:  # the action that the robot would finally take, for messages
            return -1
        for a in range(n_actions):
            by_action[a] = left[a * places : (a + 1) * places].max()
        joint[j] = choose_action(robot * wheels + j, by_action, exploring, rng)
        if joint[j] < 0:
            return -1
        action = action * n_actions + joint[j]
    return action


@njit(cache=True)
def respond(
    starts: IntArray,
    order: IntArray,
    n_actions: int,
    outlook: Outlook,
    exploring: Exploring,
    rng: np.random.Generator,
) -> IntArray:
    """Improve the best start by one round of best responses, then let all wheels decide.

    Parameters
    ----------
    starts
        ``(m, n)`` joint actions.
    order
        ``(M,)`` the robots in the order of decision.
    n_actions
        A.
    outlook
        Model and value function.
    exploring
        How agents explore.
    rng
        Source of randomness.

    Returns
    -------
    IntArray
        ``(n,)`` the joint action; empty if not all values are numbers.
    """
    alike = outlook.commands.alike
    n = len(alike)
    wheels = starts.shape[1] // n
    actions = robot_actions(starts, n, n_actions)
    values = _values_of(actions, outlook)
    best = draw(values, rng)
    joint = starts[best].copy()
    plan = _Plan(np.empty(n, np.int64), np.empty(alike.shape), np.full((n, n), -1))
    for r in range(n):
        plan.actions[r] = alike[r, actions[r, best]]
    value = values[best]
    reach = 0
    depth = 1
    for decides in (False, True):
        for k in range(n):
            if best < 0:
                return joint[:0]
            r = order[k]
            if not _is_valid(plan, r):
                depth = min(2 * depth, MAX_BODIES_AHEAD) if k == reach else 1
                reach = min(k + depth, n)
                ahead = order[k:reach]
                # Another kernel between this one and `_values_of` takes three seconds to compile.
                values = _values_of(_variations(ahead, plan, alike), outlook)
                _store(ahead, value, values, plan, alike)
            if decides:
                own = joint[r * wheels : (r + 1) * wheels]
                best = _decide(r, plan.values[r], own, n_actions, exploring, rng)
            else:
                best = _improve(plan.values[r], alike[r], rng)
            plan.actions[r] = alike[r, best]
            value = plan.values[r, best]
    return joint
