"""A scripted controller: the proof that box pushing can be solved with the agents' own actions.

It picks a side at which to push the box towards the goal, gives every robot a slot along it, drives
the robots that are not at their slot there (a short search over sequences of actions of one robot,
around the box and clear of the others), and once all are, pushes: it tries the joint actions on the
push predictor and takes the one after which the box is nearest to the goal and best aligned, with
the robots still at their slots. Three robots and more push a convex box in another way, see
`research.scripted.crowd`. It knows the whole situation and remembers nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import atan2, cos, prod, sin
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from nested_agents import BoxPushing
from nested_agents.boxes import CLEARANCE, Drivers, paths, push, wrap

from .. import FloatArray, IntArray
from .crowd import SLOT_GAP, Crowd
from .sides import SPREAD, Side, behind, is_concave, sides_of

CROWD = 3
"""Robots, all alike, from which on a convex box with sides is pushed as by a `Crowd`."""
WIDEST_JOINT = 300
"""Joint actions tried at once; above, robots choose in turn."""


class ScriptedController:
    """Drives robots to push a box to its goal.

    Parameters
    ----------
    scenario
        What is in the world, and what robots can do in a decision period.
    """

    def __init__(self, scenario: BoxPushing) -> None:
        self.robots, self.box = robots, box = scenario.world.robots, scenario.box
        self._radii: FloatArray = np.array([robot.radius for robot in robots])
        self._drivers = Drivers(scenario)
        self._model, self.seconds = self._drivers.model, self._drivers.seconds
        self._sides = sides_of(box, len(robots), float(self._radii.max()) + CLEARANCE)
        self._hollow = is_concave(box)
        alike = len(set(self.robots)) == 1
        crowded = len(self.robots) >= CROWD and alike and self._sides and not self._hollow
        self._crowd = Crowd(self._drivers, self._sides) if crowded else None
        self._backs: dict[tuple[float, float, float], float] = {}

    def act(self, measurements: Mapping[str, Any]) -> IntArray:
        """Return the joint action ``(n,)`` in a situation.

        Parameters
        ----------
        measurements
            ``robot_poses`` (M, 3), ``box_pose`` (3,), ``goal_pose`` (3,) and commanded
            ``wheel_speeds`` (n,), as `BoxPushing.measure` returns them.
        """
        robots, box = measurements["robot_poses"], measurements["box_pose"]
        goal, speeds = measurements["goal_pose"], measurements["wheel_speeds"]
        if self._crowd is not None:
            return self._joint(self._crowd.choose(robots, box, goal, speeds))
        side, slots = self._plan(robots, box, goal)
        heading = box[2] + side.direction
        away = [r for r, pose in enumerate(robots) if not self._at_slot(pose, slots[r], heading)]
        local = [
            self._drivers.drive(r, robots, box, speeds, np.array([*slots[r], heading]))
            if r in away
            else self._drivers.rest(r, speeds)
            for r in range(len(robots))
        ]
        # With steps as coarse as the actions' a robot may find no better place than it has.
        stuck = not any(speeds) and not any(
            self._drivers.next(speeds[w][None])[0][0, k].any()
            for w, k in zip(self._drivers.wheels, local, strict=True)
        )
        if stuck or not away:
            local = self._push(robots, box, goal, speeds, side, slots)
        return self._joint(local)

    def _joint(self, local: Sequence[int]) -> IntArray:
        """Return the joint action ``(n,)`` of robot actions."""
        return self._drivers.choices[np.array(local)].ravel()

    def _plan(
        self, robots: FloatArray, box: FloatArray, goal: FloatArray
    ) -> tuple[Side, FloatArray]:
        """Return the side to push at and each robot's slot ``(M, 2)`` in the world."""
        course = atan2(goal[1] - box[1], goal[0] - box[0]) - box[2]
        sides = self._sides or [Side(course, self.box.reach, 0.0, 0.6 * self.box.reach)]
        best = None
        for side in sides:
            error = float(wrap(course - side.direction))
            slots = self._slots(side, box, error)
            costs = np.array(
                [
                    paths(pose[None], slot, box, self.box, radius + CLEARANCE)[0]
                    for pose, radius in zip(robots, self._radii, strict=True)
                    for slot in slots
                ]
            ).reshape(len(robots), -1)
            rows, columns = linear_sum_assignment(costs)
            # Past a right angle pushing leads away from the goal.
            steer = abs(error) + 4.0 * max(abs(error) - 1.2, 0.0)
            cost = steer + costs[rows, columns].mean() / 0.3
            if best is None or cost < best[0]:
                best = cost, side, slots[columns]
        assert best is not None
        return best[1], best[2]

    def _spread(self, side: Side) -> float:
        """Return how far from the middle of a side the outermost slots are [m]."""
        least = (len(self.robots) - 1) * (float(self._radii.max()) + CLEARANCE)
        return max(SPREAD * side.half, least)

    def _slots(self, side: Side, box: FloatArray, error: float) -> FloatArray:
        """Return the slots ``(M, 2)`` along a side, evenly spread, in the world.

        `error` is the angle from the side's direction to the goal [rad].
        """
        n = len(self.robots)
        offsets = np.linspace(1, -1, n) * self._spread(side)
        if n == 1:  # steers by where it pushes
            offsets = -0.5 * side.half * np.clip([2.0 * error], -1, 1)
        angle = box[2] + side.direction
        ahead, left = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
        slots = []
        for offset, radius in zip(offsets, self._radii, strict=True):
            back = self._back(side, float(side.middle + offset), float(radius))
            if not self._sides:
                back = np.sqrt((self.box.reach + radius + SLOT_GAP) ** 2 - offset**2)
            slots.append(box[:2] - back * ahead + (side.middle + offset) * left)
        return np.array(slots)

    def _back(self, side: Side, aside: float, radius: float) -> float:
        """Return how far behind the box's center a robot waits [m]."""
        if not self._hollow:
            return side.depth + radius + SLOT_GAP
        key = side.direction, aside, radius + SLOT_GAP
        if key not in self._backs:
            self._backs[key] = behind(self.box, *key)[0]
        return self._backs[key]

    def _at_slot(self, pose: FloatArray, slot: FloatArray, heading: float) -> bool:
        dx, dy = pose[:2] - slot
        along, aside = cos(heading) * dx + sin(heading) * dy, cos(heading) * dy - sin(heading) * dx
        allowed = 0.03 if along < 0 else 0.045  # once it pushes, it is left alone for longer
        turn = abs(wrap(pose[2] - heading))
        return bool(-0.05 < along < 0.04 and abs(aside) < allowed and turn < 0.7)

    def _push(
        self,
        robots: FloatArray,
        box: FloatArray,
        goal: FloatArray,
        speeds: FloatArray,
        side: Side,
        slots: FloatArray,
    ) -> list[int]:
        """Return the robot actions that push best, as far as the push predictor can tell."""
        tables = [self._drivers.next(speeds[w][None])[1][0] for w in self._drivers.wheels]
        twists = np.zeros((len(tables), max(map(len, tables)), 3))
        for r, table in enumerate(tables):
            twists[r, : len(table)] = table
        cos_, sin_ = cos(box[2] + side.direction), sin(box[2] + side.direction)
        aside = cos_ * (slots[:, 1] - box[1]) - sin_ * (slots[:, 0] - box[0])

        def best(options: IntArray) -> IntArray:
            choices = np.ascontiguousarray(options.T)
            pushed = push(robots, box, twists, choices, self.seconds, self._model)
            after, boxes, gaps = (np.moveaxis(each, -1, 0) for each in pushed)
            costs = self._cost(after, boxes, gaps, goal, side, aside)
            costs[[not twists[range(len(o)), o].any() for o in options]] += 1.0  # never rest
            return options[int(costs.argmin())]

        sizes = [range(len(table)) for table in tables]
        if prod(map(len, sizes)) <= WIDEST_JOINT:
            return list(best(np.array(list(product(*sizes)))))
        # Coordinate ascent: everyone ahead at first, then each improves on the others' choice.
        choice = np.array([int(table[:, 0].argmax()) for table in tables])
        for _ in range(3):
            for r, size in enumerate(sizes):
                options = np.repeat(choice[None], len(size), axis=0)
                options[:, r] = size
                choice = best(options)
        return list(choice)

    def _cost(
        self,
        robots: FloatArray,
        box: FloatArray,
        gaps: FloatArray,
        goal: FloatArray,
        side: Side,
        aside: FloatArray,
    ) -> FloatArray:
        """Return how bad ``m`` predicted situations are [m]."""
        ahead = goal[:2] - box[:, :2]
        distance = np.hypot(ahead[:, 0], ahead[:, 1])
        heading = box[:, 2] + side.direction
        cost = distance.copy()
        if self._sides:
            error = wrap(np.arctan2(ahead[:, 1], ahead[:, 0]) - heading)
            steer = 2.2 * self._spread(side) * np.abs(error)
            cost += steer * np.minimum(1.0, distance / 0.2)
        for r in range(robots.shape[1]):
            dx, dy = robots[:, r, 0] - box[:, 0], robots[:, r, 1] - box[:, 1]
            off = np.cos(heading) * dy - np.sin(heading) * dx - aside[r]
            cost += 0.3 * np.maximum(gaps[:, r], 0.0) + 3.0 * off**2
            cost += 0.02 * wrap(robots[:, r, 2] - heading) ** 2
        return cost


def decisions_to_goal(
    scenario: BoxPushing, seed: int | np.random.SeedSequence, steps: int
) -> int | None:
    """Return after how many decisions the controller has the box at the goal.

    Parameters
    ----------
    scenario
        What is played; modified.
    seed
        Of the world.
    steps
        Most decisions.

    Returns
    -------
    int or None
        None if the episode ends otherwise.
    """
    controller = ScriptedController(scenario)
    scenario.reset(seed)
    for step in range(1, steps + 1):
        transition = scenario.step(controller.act(scenario.measure()))
        if transition.terminated or transition.truncated:
            return step if transition.terminated else None
    return None
