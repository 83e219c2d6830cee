"""What a trained team does, by where a robot stands around the box.

The box lies turned as at the goal, the goal 60 cm ahead of it. One robot is put on the points of a
grid around it, at rest and looking at the box, the others stay behind the box; the team decides
greedily, and the predictor tells how the robot would move in the decision period.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from shapely.geometry import Point, Polygon

from ...core.agents.team import Team
from ...core.numerics.arrays import FloatArray
from ...scenarios.box_pushing.prediction.prediction import BoxPrediction
from ...scenarios.box_pushing.prediction.situation import Situation
from ...scenarios.box_pushing.scenario import BoxPushing
from ...scenarios.box_pushing.world.geometry import surface, wrap
from ...scenarios.box_pushing.world.starts import place

AHEAD = 0.6
"""From the box to the goal [m]."""
AROUND = 0.25
"""How far beyond the box the grid reaches [m]."""
POINTS = 17
"""Of the grid, along a side."""
LEAST_WAY = 0.002
"""A shorter way is called none [m]."""
LEAST_TURN = radians(3.0)
"""A smaller turn is called none [rad]."""
MOST_ROBOTS = 4
"""Robots whose fields are computed."""
SIDES = ("behind", "right", "ahead", "left")
"""Where a robot may stand, seen along the course from box to goal; counter-clockwise."""
MOVES = ("to the box", "away", "turns", "rests")


@dataclass(frozen=True)
class Field:
    """What one robot does from each point around the box.

    Attributes
    ----------
    robot
        Its number, from 0.
    points
        ``(m, 3)`` its poses in the frame of the box.
    ways
        ``(m, 2)`` how far it is predicted to move, in the frame of the box [m].
    turns
        ``(m,)`` how far it is predicted to turn [rad].
    others
        ``(M - 1, 2)`` places of the others.
    """

    robot: int
    points: FloatArray
    ways: FloatArray
    turns: FloatArray
    others: FloatArray

    @property
    def moves(self) -> list[str]:
        """The kind of move from every point, one of `MOVES`."""
        headings = np.stack([np.cos(self.points[:, 2]), np.sin(self.points[:, 2])], axis=1)
        onward = (self.ways * headings).sum(axis=1)
        far = np.hypot(*self.ways.T) >= LEAST_WAY
        still = np.where(np.abs(self.turns) >= LEAST_TURN, MOVES[2], MOVES[3])
        return [str(m) for m in np.where(far, np.where(onward > 0, MOVES[0], MOVES[1]), still)]

    @property
    def sides(self) -> list[str]:
        """The side of the box of every point, one of `SIDES`."""
        quarter = np.round((np.arctan2(self.points[:, 1], self.points[:, 0]) + np.pi) * 2 / np.pi)
        return [SIDES[int(q) % 4] for q in quarter]


def fields(team: Team, scenario: BoxPushing) -> list[Field]:
    """Return what each of the first `MOST_ROBOTS` robots does; the scenario is modified.

    Raises
    ------
    ValueError
        If the scenario's predictor needs a world that has really come to be as it predicts from.
    """
    scenario.reset(0)
    prediction = team.predict(scenario)
    if type(prediction) is not BoxPrediction:
        raise ValueError("its predictions play the world itself, and cannot begin anywhere")
    goal = prediction.situation.goal
    box = np.array([goal[0] - AHEAD, goal[1], goal[2]])
    robots = _behind(scenario, box)
    found = []
    for robot in range(min(len(robots), MOST_ROBOTS)):
        others = np.delete(robots, robot, axis=0)
        points = _grid(scenario, others - box)
        situation = replace(prediction.situation, box=box, speeds=0 * prediction.situation.speeds)
        moved = [_moved(team, prediction, situation, robots, robot, p + box) for p in points]
        ways, turns = (np.array(column) for column in zip(*moved, strict=True))
        found.append(Field(robot, points, ways, turns, (others - box)[:, :2]))
    return found


def _moved(
    team: Team,
    prediction: BoxPrediction,
    situation: Situation,
    robots: FloatArray,
    robot: int,
    pose: FloatArray,
) -> tuple[FloatArray, float]:
    """Return way and turn after the team's decision with a robot at a pose."""
    placed = robots.copy()
    placed[robot] = pose
    here = BoxPrediction(replace(situation, robots=placed), prediction.model, prediction.premises)
    view = here.poses(team.act(here, explore=False)[None])
    after = view.robots[0, robot]
    return (after - pose)[:2], float(wrap(after[2:] - pose[2:])[0])


def _behind(scenario: BoxPushing, box: FloatArray) -> FloatArray:
    """Return poses ``(M, 3)`` behind a box, or if they do not fit there as at a start."""
    robots = [scenario.robot] * scenario.settings.robots
    try:
        poses, at, _ = place("medium", np.random.default_rng(0), robots, scenario.box)
    except ValueError:
        start = scenario.settings.start
        poses, at, _ = place(start, np.random.default_rng(0), robots, scenario.box)
    turn = box[2] - at[2]
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    places = box[:2] + (poses[:, :2] - at[:2]) @ rotation.T
    return np.column_stack([places, wrap(poses[:, 2] + turn)])


def _grid(scenario: BoxPushing, others: FloatArray) -> FloatArray:
    """Return poses ``(m, 3)`` around the box, looking at its centre, where there is room."""
    radius, outline, polygon = scenario.robot.radius, scenario.box.outline, scenario.box.polygon
    holes = [] if polygon is None else [Polygon(ring) for ring in polygon.interiors]
    line = np.linspace(-1, 1, POINTS) * (scenario.box.reach + AROUND)
    found = []
    for y in line:
        for x in line:
            clear = surface(outline.edges, outline.rounding, x, y)[0] > radius
            apart = np.hypot(others[:, 0] - x, others[:, 1] - y)
            reached = not any(hole.contains(Point(x, y)) for hole in holes)
            if clear and reached and (apart > 2 * radius).all():
                found.append((x, y, np.arctan2(-y, -x)))
    return np.array(found)


def table(found: list[Field]) -> Iterator[str]:
    """Yield, by robot and side of the box, how often it makes which move."""
    head = "".join(move.rjust(12) for move in MOVES)
    yield f"{'robot':<7}{'side':<8}{'places':>7}{head}"
    for field in found:
        for side in SIDES:
            here = [i for i, at in enumerate(field.sides) if at == side]
            if not here:
                continue
            counted = Counter(field.moves[i] for i in here)
            shares = "".join(f"{100 * counted[move] / len(here):.0f} %".rjust(12) for move in MOVES)
            yield f"{field.robot + 1:<7}{side:<8}{len(here):>7}{shares}"
