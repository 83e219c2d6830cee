"""Map of a trained team's policy over the positions of a robot around the box.

The goal is 60 cm ahead of the box. One robot stands at the points of a grid around the box, at rest
and facing it, and the other robots stay behind the box. The team decides greedily, and the
predictor gives the motion of the robot in the decision period.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import ceil, radians

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch

from ....core.interface.abilities import PolicyMap
from ....core.interface.prediction import Prediction
from ....core.numerics import FloatArray, IntArray, wrap
from ..prediction.prediction import BoxPrediction
from ..world.boxes import BoxSpec
from ..world.geometry import distances
from ..world.starts import place
from ..world.world import World
from .rendering import BOX_COLOR, curve

GOAL_DISTANCE_M = 0.6
"""Distance from the box to the goal."""
GRID_MARGIN_M = 0.25
"""Distance by which the grid extends beyond the box."""
GRID_POINTS = 17
"""Number of grid points along a side."""
MIN_MOTION_M = 0.002
"""Displacement below which a robot does not move."""
MIN_TURN = radians(3.0)
"""Turn below which a robot does not turn [rad]."""
MAX_ROBOTS = 4
"""Maximum number of robots in a map."""
COLORS = {"to the box": "#0072B2", "away": "#D55E00", "turns": "#009E73", "rests": "#999999"}
"""Colors of the kinds of motion."""


@dataclass(frozen=True)
class MotionField:
    """Predicted motion of one robot from each point around the box, in the frame of the box."""

    points: FloatArray
    """``(m, 3)`` poses of the robot."""
    motions: FloatArray
    """``(m, 3)`` predicted displacements [m] and turns [rad]."""
    others: FloatArray
    """``(M - 1, 2)`` positions of the other robots."""

    @property
    def kinds(self) -> list[str]:
        """Kind of the motion from every point, a key of `COLORS`."""
        dx, dy, turn = self.motions.T
        heading = self.points[:, 2]
        forward = np.cos(heading) * dx + np.sin(heading) * dy > 0
        resting = np.where(np.abs(turn) >= MIN_TURN, "turns", "rests")
        moving = np.where(forward, "to the box", "away")
        return np.where(np.hypot(dx, dy) >= MIN_MOTION_M, moving, resting).tolist()


@dataclass(frozen=True)
class BoxPolicyMap(PolicyMap):
    """Motion fields of the first `MAX_ROBOTS` robots of a team."""

    fields: tuple[MotionField, ...]
    """One field for each robot."""
    box: BoxSpec
    """The box."""
    radius: float
    """Radius of the robots [m]."""

    def lines(self) -> Iterator[str]:
        """Yield the frequency of each kind of motion by robot."""
        yield "Predicted motion of a robot at rest that faces the box, the goal 60 cm ahead"
        yield "of the box, the other robots behind it."
        yield ""
        yield f"{'robot':<7}{'places':>7}{''.join(kind.rjust(12) for kind in COLORS)}"
        for number, field in enumerate(self.fields, 1):
            counts = Counter(field.kinds)
            shares = (f"{counts[kind] / len(field.kinds):.0%}".rjust(12) for kind in COLORS)
            yield f"{number:<7}{len(field.kinds):>7}{''.join(shares)}"

    def figure(self) -> Figure:
        """Draw the motion of each robot from every point."""
        columns = min(2, len(self.fields))
        rows = ceil(len(self.fields) / columns)
        figure = Figure(figsize=(4.1 * columns, 4.3 * rows + 0.9), layout="constrained")
        reach = self.box.reach + 1.2 * GRID_MARGIN_M
        for number, field in enumerate(self.fields, 1):
            axes = figure.add_subplot(rows, columns, number)
            axes.set(xlim=(-reach, reach), ylim=(-reach, reach), box_aspect=1.0)
            axes.set(xlabel="along the course to the goal [m]", title=f"robot {number}")
            axes.add_patch(PathPatch(curve(self.box), fc=BOX_COLOR, ec="black", alpha=0.75))
            for x, y in field.others:
                axes.add_patch(Circle((x, y), self.radius, fc="#bbbbbb", ec="#777777"))
            colors = [COLORS[kind] for kind in field.kinds]
            x, y, _ = field.points.T
            axes.scatter(x, y, s=6, c=colors)
            axes.quiver(x, y, *field.motions[:, :2].T, color=colors, angles="xy")
        handles = [
            Line2D([], [], ls="", marker="o", ms=6, color=color, label=kind)
            for kind, color in COLORS.items()
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
        return figure


def policy_of(
    choose: Callable[[Prediction], IntArray], prediction: object, world: World
) -> BoxPolicyMap:
    """Return the policy map of a team.

    Parameters
    ----------
    choose
        Returns a joint action, given a prediction.
    prediction
        A prediction of the scenario, which provides the goal, the wheels and the model.
    world
        Robots and box.

    Raises
    ------
    ValueError
        If the predictor can predict from the current state of the simulation only.
    """
    if type(prediction) is not BoxPrediction:
        raise ValueError("predictions by simulation start in the present state only")
    situation = prediction.situation
    box_pose = situation.goal - [GOAL_DISTANCE_M, 0.0, 0.0]
    poses = _poses_behind(world, box_pose)
    fields = []
    for robot in range(min(len(poses), MAX_ROBOTS)):
        others = np.delete(poses, robot, axis=0) - box_pose
        points = _grid(world.box, world.robots[robot].radius, others)
        motions = []
        for point in points:
            placed = poses.copy()
            placed[robot] = point + box_pose
            imagined = replace(
                situation, robots=placed, box=box_pose, speeds=np.zeros_like(situation.speeds)
            )
            start = BoxPrediction(imagined, prediction.model, prediction.settings)
            after = start.poses(choose(start)[None])
            motions.append(after.robots[robot, :, 0] - placed[robot])
        fields.append(MotionField(points, np.array(motions), others[:, :2]))
    return BoxPolicyMap(tuple(fields), world.box, world.robots[0].radius)


def _poses_behind(world: World, box_pose: FloatArray) -> FloatArray:
    """Return poses ``(M, 3)`` of robots behind the box, or around it if they do not fit."""
    try:
        poses, was, _ = place("medium", np.random.default_rng(0), world.robots, world.box)
    except ValueError:
        poses, was, _ = place("hard", np.random.default_rng(0), world.robots, world.box)
    turn = box_pose[2] - was[2]
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    places = box_pose[:2] + (poses[:, :2] - was[:2]) @ rotation.T
    return np.column_stack([places, wrap(poses[:, 2] + turn)])


def _grid(box: BoxSpec, radius: float, others: FloatArray) -> FloatArray:
    """Return poses ``(m, 3)`` that face the center of the box, where there is room for a robot."""
    line = np.linspace(-1, 1, GRID_POINTS) * (box.reach + GRID_MARGIN_M)
    x, y = (axis.ravel() for axis in np.meshgrid(line, line))
    apart = np.hypot(x[:, None] - others[:, 0], y[:, None] - others[:, 1])
    free = (distances(x, y, box.shape) > radius) & (apart > 2 * radius).all(axis=1)
    return np.stack([x, y, np.arctan2(-y, -x)], axis=1)[free]
