"""How three robots and more push a convex box: together, from one side or from two.

Everyone who stands behind its side pushes where it stands; who does not is driven to a slot, and
once enough stand, nobody waits for the rest. A wide box turns slowly: per meter of way by about the
lever of the robots over the square of the box's friction radius, which falls as one over the number
of robots. What turning cannot do in the way that is left, robots do by pushing obliquely, within
the friction cone, and what that cannot do by pushing from a second side as well.

A joint action is searched for in time cubic in the number of robots, with a small constant: first
among patterns, in which the robots to either side of a cut, and those of the second side, go at one
speed each, then by best responses, robot by robot. One robot of many moves the box little, so what
concerns the box counts as much as what concerns all robots together; otherwise nobody would slow
down to steer.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import atan2, cos, pi, sin
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from nested_agents.boxes import CLEARANCE, Drivers, paths, push, wrap

from .. import BoolArray, FloatArray, IntArray
from .sides import SPREAD, Side

SLOT_GAP = 0.015
"""Gap to the box at which a robot waits at its slot [m]."""
CONE = 0.25
"""How far off its side's direction a robot pushes [rad]; within the friction cone of 0.29."""
LEVER = 0.43
"""Lever of the half of a team that pushes to turn the box, as a fraction of the side's half."""
MISSED = 0.04, 0.015
"""By how much the box would miss the goal [m] for a second side to be called for, and kept."""
ENOUGH = 0.6
"""Fraction of the robots of a side that must stand behind it for the pushing to begin: a third of
them can move the box."""
SWEEPS = 2
"""Best responses of each robot to all others."""
SPEEDS = 1.0, 0.5, 0.0
"""Speeds of the patterns, as fractions of the greatest."""
LEAST_ADVANCE = 0.02
"""By how much the box should come ahead per decision [m]; without it turning is put off by not
pushing at all."""


class PushPlan(NamedTuple):
    """Where everyone is to push; ``M`` robots."""

    side: FloatArray
    """``(M, 4)`` the `Side` of each robot."""
    slots: FloatArray
    """``(M, 3)`` the pose in which it would wait there."""
    course: float
    """Direction from the box to the goal, world frame [rad]."""
    error: float
    """The course as seen from the main side [rad]."""
    oblique: float
    """Direction in which robots should push, as seen from their side [rad]."""
    second: BoolArray
    """``(M,)`` who pushes from the second side."""


class Crowd:
    """Pushes a convex box with sides by many robots.

    Parameters
    ----------
    drivers
        What robots can do in the world, and what is believed of it.
    sides
        At which the box may be pushed.
    """

    def __init__(self, drivers: Drivers, sides: Sequence[Side]) -> None:
        self.box, self.sides = drivers.box, tuple(sides)
        self._model, self._drivers = drivers.model, drivers
        self._radius = drivers.robot.radius
        self._n = len(drivers.wheels)

    def choose(
        self, robots: FloatArray, box: FloatArray, goal: FloatArray, speeds: FloatArray
    ) -> list[int]:
        """Return the robot action of each robot; the arguments as of `ScriptedController.act`."""
        plan = self._plan(robots, box, goal)
        stands = self._stands(robots, box, plan)
        drivers = self._drivers
        local = np.array(
            [
                drivers.rest(r, speeds)
                if stands[r]
                else drivers.drive(r, robots, box, speeds, plan.slots[r])
                for r in range(self._n)
            ]
        )
        tables = [drivers.next(speeds[w][None]) for w in drivers.wheels]
        moves = any(after[0, k].any() for (after, _), k in zip(tables, local, strict=True))
        teams = [team for team in (plan.second, ~plan.second) if team.any()]
        ready = all(stands[team].mean() >= ENOUGH for team in teams)
        if ready or not (moves or speeds.any()):
            twists = np.array([table[0] for _, table in tables])
            local = self._push(robots, box, goal, plan, twists, local, stands)
        return [int(k) for k in local]

    def _plan(self, robots: FloatArray, box: FloatArray, goal: FloatArray) -> PushPlan:
        """Return where everyone is to push, the way there weighed against the way of the box."""
        course = atan2(goal[1] - box[1], goal[0] - box[0])
        distance = float(np.hypot(*(goal[:2] - box[:2])))
        best = None
        for side in self.sides:
            error = float(wrap(course - box[2] - side.direction))
            slots = self._slots(side, self._n, box)
            way, columns = self._assigned(robots, box, slots)
            # Past a right angle pushing leads away from the goal.
            steer = abs(error) + 4.0 * max(abs(error) - 1.2, 0.0)
            cost = steer + way / (0.15 * self._n)
            if best is None or cost < best[0]:
                best = cost, side, error, slots[columns]
        assert best is not None
        _, side, error, slots = best
        beyond = max(abs(error) - self._turns(side, distance), 0.0)
        oblique = float(np.copysign(min(beyond, CONE), error))
        one = PushPlan(
            np.tile(side, (self._n, 1)), slots, course, error, oblique, np.zeros(self._n, bool)
        )
        other = self._other(side, error)
        if other is None:
            return one
        two = self._both(robots, box, course, error, side, other)
        there = self._stands(robots, box, two)[two.second].mean() > 0.25
        missed = distance * sin(min(max(beyond - CONE, 0.0), pi / 2))
        return two if missed > MISSED[int(there)] else one

    def _turns(self, side: Side, distance: float) -> float:
        """Return by how much the course can be met by turning the box on its way [rad]."""
        return 0.5 * distance * LEVER * side.half / self.box.friction_radius**2

    def _other(self, side: Side, error: float) -> Side | None:
        """Return the side that pushes to where `side` cannot; None if there is none such."""
        turns = {float(wrap(s.direction - side.direction)): s for s in self.sides}
        possible = [t for t in turns if t * error > 0 and abs(error) < abs(t) < 2.4]
        return turns[min(possible, key=abs)] if possible else None

    def _both(
        self,
        robots: FloatArray,
        box: FloatArray,
        course: float,
        error: float,
        side: Side,
        other: Side,
    ) -> PushPlan:
        """Return the plan to push from two sides, in proportion to what each has to give."""
        between = abs(float(wrap(other.direction - side.direction)))
        mine, theirs = sin(between - abs(error)), sin(abs(error))
        count = min(max(round(self._n * theirs / (mine + theirs)), 1), self._n - 1)
        slots = np.vstack([self._slots(side, self._n - count, box), self._slots(other, count, box)])
        _, columns = self._assigned(robots, box, slots)
        second = columns >= self._n - count
        sides = np.where(second[:, None], np.array(other), np.array(side))
        return PushPlan(sides, slots[columns], course, error, 0.0, second)

    def _slots(self, side: Side, count: int, box: FloatArray) -> FloatArray:
        """Return poses ``(count, 3)`` spread evenly along a side, in the world."""
        span = 2.0 * (self._radius + CLEARANCE)
        spread = min(max(SPREAD * side.half, (count - 1) * span / 2), side.half - self._radius)
        offsets = side.middle + np.linspace(1, -1, count) * (spread if count > 1 else 0.0)
        heading = box[2] + side.direction
        ahead, left = _axes(heading)
        places = box[:2] - (side.depth + self._radius + SLOT_GAP) * ahead + offsets[:, None] * left
        return np.column_stack([places, np.full(count, heading)])

    def _assigned(
        self, robots: FloatArray, box: FloatArray, slots: FloatArray
    ) -> tuple[float, IntArray]:
        """Return the mean way to slots [m] and the slot of each robot, the ways being shortest."""
        margin = self._radius + CLEARANCE
        ways = [paths(robots, slot[:2], box, self.box, margin) for slot in slots]
        costs = np.stack(ways, axis=1)
        rows, columns = linear_sum_assignment(costs)
        return float(costs[rows, columns].mean()), columns

    def _stands(self, robots: FloatArray, box: FloatArray, plan: PushPlan) -> BoolArray:
        """Return who stands behind its side, facing it, ``(M,)``."""
        direction, depth, middle, half = plan.side.T
        heading = box[2] + direction
        dx, dy = robots[:, 0] - box[0], robots[:, 1] - box[1]
        behind = np.cos(heading) * dx + np.sin(heading) * dy + depth + self._radius
        aside = np.cos(heading) * dy - np.sin(heading) * dx - middle
        turned = np.abs(wrap(robots[:, 2] - heading))
        at: BoolArray = (
            (behind > -0.12) & (behind < 0.03) & (np.abs(aside) < half - 0.01) & (turned < 0.9)
        )
        return at

    def _push(
        self,
        robots: FloatArray,
        box: FloatArray,
        goal: FloatArray,
        plan: PushPlan,
        twists: FloatArray,
        driven: IntArray,
        free: BoolArray,
    ) -> IntArray:
        """Return the robot actions ``(M,)`` that push best, as the push predictor has it.

        `twists` ``(M, K, 3)`` are what they may do; who is not `free` does as it is `driven`.
        """

        def best(options: IntArray) -> IntArray:
            choices = np.ascontiguousarray(options.T)
            pushed = push(robots, box, twists, choices, self._drivers.seconds, self._model)
            after, boxes, gaps = (np.moveaxis(each, -1, 0) for each in pushed)
            costs = self._cost(after, boxes, gaps, box, goal, plan)
            best: IntArray = options[int(costs.argmin())]
            return best

        patterns = self._patterns(robots, box, plan, twists)
        patterns[:, ~free] = driven[~free]
        choice = best(patterns)
        distinct = [np.unique(t.round(9), axis=0, return_index=True)[1] for t in twists]
        for _ in range(SWEEPS):
            before = choice
            for r in np.flatnonzero(free):
                options = np.repeat(choice[None], len(distinct[r]) + 1, axis=0)
                options[1:, r] = distinct[r]  # behind what is, which stays if none is better
                choice = best(options)
            if np.array_equal(before, choice):
                break
        return choice

    def _patterns(
        self, robots: FloatArray, box: FloatArray, plan: PushPlan, twists: FloatArray
    ) -> IntArray:
        """Return robot actions ``(m, M)``: one speed left of a cut, one right, one at the side."""
        heading = box[2] + plan.side[:, 0]
        turned = wrap(robots[:, 2] - heading)[:, None] + twists[:, :, 2] * self._drivers.seconds
        fastest = np.abs(twists[:, :, 0]).max(axis=1, keepdims=True)
        off = 0.5 * np.abs(turned - plan.oblique)
        at = [(np.abs(twists[:, :, 0] / fastest - v) + off).argmin(axis=1) for v in SPEEDS]
        aside = (robots[:, :2] - box[:2]) @ _axes(box[2] + plan.side[~plan.second][0, 0])[1]
        thirds = at if plan.second.any() else at[:1]
        rows = [
            np.where(plan.second, third, np.where(aside <= cut, right, left))
            for cut, right, left, third in product(aside[~plan.second], at, at, thirds)
        ]
        return np.array(rows)

    def _cost(
        self,
        robots: FloatArray,
        boxes: FloatArray,
        gaps: FloatArray,
        box: FloatArray,
        goal: FloatArray,
        plan: PushPlan,
    ) -> FloatArray:
        """Return how bad ``m`` predicted situations are, a sum over robots [m]."""
        ahead = goal[:2] - boxes[:, :2]
        distance = np.hypot(ahead[:, 0], ahead[:, 1])
        direction, _, middle, half = plan.side.T
        main = float(direction[~plan.second][0])
        off = np.abs(wrap(np.arctan2(ahead[:, 1], ahead[:, 0]) - boxes[:, 2] - main))
        spread = SPREAD * float(half[~plan.second][0])
        way = plan.course if plan.second.any() else box[2] + main
        if plan.second.any():
            off = np.abs(wrap(boxes[:, 2] - box[2]))
        steer = 6.0 * spread * off * np.minimum(1.0, distance / 0.2)
        advance = (boxes[:, :2] - box[:2]) @ _axes(way)[0]
        shared = distance + steer + 10.0 * np.maximum(LEAST_ADVANCE - advance, 0.0)
        cost = 0.5 * self._n * shared + 0.3 * np.maximum(gaps, 0.0).sum(axis=1)
        heading = boxes[:, 2:] + direction
        turned = wrap(robots[:, :, 2] - heading) - plan.oblique
        cost += 0.05 * (turned**2).sum(axis=1)
        dx, dy = robots[:, :, 0] - boxes[:, :1], robots[:, :, 1] - boxes[:, 1:2]
        aside = np.cos(heading) * dy - np.sin(heading) * dx - middle
        cost += 10.0 * np.maximum(np.abs(aside) - half + 0.03, 0.0).sum(axis=1)
        for team in (plan.second, ~plan.second):  # neighbors keep clear of each other
            order = np.flatnonzero(team)[np.argsort(aside[0, team])]
            apart = np.hypot(*np.diff(robots[:, order, :2], axis=1).transpose(2, 0, 1))
            close = 2.0 * self._radius + CLEARANCE - apart
            cost += 10.0 * np.maximum(close, 0.0).sum(axis=1)
        return cost


def _axes(heading: float) -> tuple[FloatArray, FloatArray]:
    """Return the unit vectors ahead and to the left."""
    return np.array([cos(heading), sin(heading)]), np.array([-sin(heading), cos(heading)])
