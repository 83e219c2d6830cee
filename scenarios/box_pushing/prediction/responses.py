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
from ....core.search.drawing import draw, explored
from ....core.values.triangular import summed_values
from ..states.situations import SituationBatch
from ..states.variables import evaluate
from ..world.geometry import BoxShape
from .push import PushModel, push
from .wheel_commands import choices_of, speeds_of

MAX_BODIES_AHEAD = 4
"""Maximum number of robots evaluated in one batch while most of them keep to the plan."""


class Outlook(NamedTuple):
    """Model and value function; M robots of w wheels with A actions each."""

    robots: FloatArray
    """``(M, 3)`` present poses."""
    box: FloatArray
    """``(3,)`` pose."""
    goal: FloatArray
    """``(3,)`` pose."""
    shape: BoxShape
    """Outline of the box."""
    seconds: float
    """Prediction horizon [s]."""
    periods: float
    """Prediction horizon in decision periods."""
    model: PushModel
    """Model of robots and box."""
    twists: FloatArray
    """``(M, K, 3)`` of every wheel command [m/s, m/s, rad/s]."""
    speeds: FloatArray
    """``(M, K, w)`` wheel speeds of every command [m/s]."""
    which: IntArray
    """``(M, A ** w)`` the wheel command of every robot action."""
    alike: IntArray
    """``(M, A ** w)`` the first robot action that gives the same."""
    every: IntArray
    """``(M,)`` numbers of all robots."""
    columns: IntArray
    """Columns of `evaluate`."""
    weights: tuple[FloatArray, FloatArray, FloatArray]
    """Consequent weights, see `summed_values`, as what follows."""
    agents: IntArray
    firsts: IntArray
    terms: tuple[IntArray, IntArray, IntArray]
    variables: FloatArray


class _Plan(NamedTuple):
    """Plan of all robots."""

    commands: IntArray
    """``(M,)`` wheel commands."""
    worths: FloatArray
    """``(M, A ** w)`` last computed values of each robot's actions."""
    around: IntArray
    """``(M, M)`` wheel commands of all robots at that time; -1 before."""


@njit(cache=True)
def _values_of(choices: IntArray, outlook: Outlook) -> FloatArray:
    """Return the mean value ``(m,)`` of wheel commands ``(M, m)`` over the agents."""
    robots, box, gaps = push(
        outlook.robots, outlook.box, outlook.twists, choices, outlook.seconds, outlook.model
    )
    origins = np.expand_dims(outlook.box, 1)
    batch = SituationBatch(robots, box, gaps, outlook.goal, origins, outlook.periods, outlook.shape)
    shared = evaluate(batch, outlook.every, outlook.columns)
    own = np.expand_dims(speeds_of(choices, outlook.speeds), 2)
    weights, agents, firsts = outlook.weights, outlook.agents, outlook.firsts
    total = summed_values(weights, agents, firsts, outlook.terms, own, shared, outlook.variables)
    return total / len(agents)


@njit(cache=True)
def _holds(plan: _Plan, robot: int) -> bool:
    """Return whether the values of a robot's actions are still valid."""
    around = plan.around[robot]
    same = around[robot] >= 0
    for i in range(len(around)):
        same = same and (i == robot or around[i] == plan.commands[i])
    return same


@njit(cache=True)
def _varied(robots: IntArray, plan: _Plan, outlook: Outlook) -> IntArray:
    """Return wheel commands ``(M, m)`` that differ from the plan in one of some robots."""
    n_actions = outlook.which.shape[1]
    who, commands = np.empty((2, len(robots) * n_actions), np.int64)
    m = 0
    for r in robots:
        for a in range(n_actions):
            if outlook.alike[r, a] == a and outlook.which[r, a] != plan.commands[r]:
                who[m], commands[m] = r, outlook.which[r, a]
                m += 1
    choices = np.empty((len(plan.commands), m), np.int64)
    for i in range(len(choices)):
        for c in range(m):
            choices[i, c] = commands[c] if who[c] == i else plan.commands[i]
    return choices


@njit(cache=True)
def _value(
    robots: IntArray, value: float, worths: FloatArray, plan: _Plan, outlook: Outlook
) -> None:
    """Store the values of robots' actions, given those of commands that differ from the plan."""
    m = 0
    for r in robots:
        plan.around[r] = plan.commands
        for a in range(outlook.which.shape[1]):
            first = outlook.alike[r, a]
            if outlook.which[r, a] == plan.commands[r]:
                plan.worths[r, a] = value
            elif first == a:
                plan.worths[r, a] = worths[m]
                m += 1
            else:
                plan.worths[r, a] = plan.worths[r, first]


@njit(cache=True)
def _improve(worths: FloatArray, alike: IntArray, rng: np.random.Generator) -> int:
    """Return the best action among those with different commands; -1 if there is none."""
    distinct = np.empty(len(worths), np.int64)
    count = 0
    for a in range(len(worths)):
        if alike[a] == a:
            distinct[count] = a
            count += 1
    best = draw(worths[distinct[:count]], rng)
    return distinct[best] if best >= 0 else -1


@njit(cache=True)
def _decide(
    robot: int,
    worths: FloatArray,
    joint: IntArray,
    n_actions: int,
    exploring: Exploring,
    rng: np.random.Generator,
) -> int:
    """Let the wheels of a robot decide in turn; return its action, -1 if no value is greatest."""
    wheels = len(joint)
    values = np.empty(n_actions)
    action = 0
    for j in range(wheels):
        places = n_actions ** (wheels - 1 - j)
        left = worths[action * n_actions * places : (action + 1) * n_actions * places]
        if draw(left, rng) < 0:  # what the robot would do in the end, which may be told
            return -1
        for a in range(n_actions):
            values[a] = left[a * places : (a + 1) * places].max()
        joint[j] = explored(robot * wheels + j, values, exploring, rng)
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
    n, n_indices = outlook.which.shape
    wheels = starts.shape[1] // n
    choices = choices_of(starts, outlook.which, n_actions)
    by_robot = np.empty(choices.shape[::-1], np.int64)
    for i in range(n):
        for c in range(len(choices)):
            by_robot[i, c] = choices[c, i]
    worths = _values_of(by_robot, outlook)
    best = draw(worths, rng)
    joint = starts[best].copy()
    plan = _Plan(choices[best], np.empty((n, n_indices)), np.full((n, n), -1))
    value = worths[best]
    reach = 0
    depth = 1
    for decides in (False, True):
        for k in range(n):
            if best < 0:
                return joint[:0]
            r = order[k]
            if not _holds(plan, r):
                depth = min(2 * depth, MAX_BODIES_AHEAD) if k == reach else 1
                reach = min(k + depth, n)
                ahead = order[k:reach]
                # A kernel more between this and `_values_of` would take three seconds to compile.
                worths = _values_of(_varied(ahead, plan, outlook), outlook)
                _value(ahead, value, worths, plan, outlook)
            if decides:
                own = joint[r * wheels : (r + 1) * wheels]
                best = _decide(r, plan.worths[r], own, n_actions, exploring, rng)
            else:
                best = _improve(plan.worths[r], outlook.alike[r], rng)
            plan.commands[r] = outlook.which[r, best]
            value = plan.worths[r, best]
    return joint
