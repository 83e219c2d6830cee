"""Map of a trained team's policy over the positions of a robot around the box.

The box lies turned as at the goal, the goal 60 cm ahead of it. One robot is put on the points of a
grid around it, at rest and looking at the box, the others stay behind the box; the team decides
greedily, and the predictor tells how the robot would move in the decision period.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import ceil, radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch
from shapely.geometry import Point, Polygon

from ....core.interface.prediction import Prediction
from ....core.interface.scenario import PolicyMap
from ....core.numerics import FloatArray, IntArray, wrap
from ..prediction.prediction import BoxPrediction
from ..world.boxes import BoxSpec
from ..world.geometry import surface
from ..world.settings import RobotSettings
from ..world.starts import place
from .rendering import BOX_COLOUR, curve

AHEAD = 0.6
"""Distance from the box to the goal [m]."""
AROUND = 0.25
"""Distance by which the grid extends beyond the box [m]."""
POINTS = 17
"""Number of grid points along a side."""
LEAST_WAY = 0.002
"""Displacement below which a robot counts as resting [m]."""
LEAST_TURN = radians(3.0)
"""Turn below which a robot counts as resting [rad]."""
MOST_ROBOTS = 4
"""Maximum number of robots for which a field is computed."""
SIDES = ("behind", "right", "ahead", "left")
"""Sides of the box, seen along the course from box to goal; counter-clockwise."""
MOVES = ("to the box", "away", "turns", "rests")
COLOURS = dict(zip(MOVES, ("#0072B2", "#D55E00", "#009E73", "#999999"), strict=True))
SHOWN = """\
What a robot does that stands at rest around the box and looks at it, the goal
60 cm ahead of the box, the other robots behind it.
"""


@dataclass(frozen=True)
class Field:
    """Predicted motion of one robot from each point around the box."""

    robot: int
    """Index of the robot."""
    points: FloatArray
    """``(m, 3)`` poses of the robot in the frame of the box."""
    ways: FloatArray
    """``(m, 2)`` predicted displacements in the frame of the box [m]."""
    turns: FloatArray
    """``(m,)`` predicted turns [rad]."""
    others: FloatArray
    """``(M - 1, 2)`` positions of the other robots."""

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


@dataclass(frozen=True)
class BoxPolicyMap(PolicyMap):
    """Fields of the first `MOST_ROBOTS` robots of a team."""

    fields: tuple[Field, ...]
    """One field per robot."""
    box: BoxSpec
    """The box that they push."""
    robot: RobotSettings
    """The robots, which are all alike."""

    def lines(self) -> Iterator[str]:
        """Yield the frequency of each move, by robot and side of the box."""
        yield from SHOWN.splitlines()
        yield ""
        head = "".join(move.rjust(12) for move in MOVES)
        yield f"{'robot':<7}{'side':<8}{'places':>7}{head}"
        for field in self.fields:
            for side in SIDES:
                here = [i for i, at in enumerate(field.sides) if at == side]
                if not here:
                    continue
                counted = Counter(field.moves[i] for i in here)
                shares = (f"{100 * counted[move] / len(here):.0f} %".rjust(12) for move in MOVES)
                yield f"{field.robot + 1:<7}{side:<8}{len(here):>7}{''.join(shares)}"
        left = len(self.fields[0].others) + 1 - len(self.fields)
        if left:
            yield f"{left} more robots are not shown."

    def figure(self) -> Figure:
        """Draw the motion of each robot from every point."""
        columns = min(2, len(self.fields))
        rows = ceil(len(self.fields) / columns)
        figure = Figure(figsize=(4.1 * columns, 4.3 * rows + 0.9), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, field in zip(panels, self.fields, strict=False):
            _draw(axes, field, self.box, self.robot.radius)
        for axes in panels[len(self.fields) :]:
            axes.set_visible(False)
        handles = [
            Line2D([], [], ls="", marker="o", ms=6, color=colour, label=move)
            for move, colour in COLOURS.items()
        ]
        figure.legend(
            handles=handles,
            loc="outside lower center",
            ncols=4,
            frameon=False,
            title="what a robot at rest, looking at the box, does next; grey discs: the others",
        )
        return figure


def policy_of(
    choose: Callable[[Prediction], IntArray],
    prediction: object,
    box: BoxSpec,
    robots: list[RobotSettings],
    start: str,
) -> BoxPolicyMap:
    """Return the policy map of a team.

    Parameters
    ----------
    choose
        Returns a joint action, given a prediction.
    prediction
        A prediction of the scenario, from which goal, wheels and model are taken.
    box, robots
        Of the scenario.
    start
        The start distribution by which robots stand behind the box if those of ``medium`` do not.

    Raises
    ------
    ValueError
        If the predictor can predict from the current state of the simulation only.
    """
    if type(prediction) is not BoxPrediction:
        raise ValueError("its predictions are of one place only, and cannot begin anywhere")
    goal = prediction.situation.goal
    at = np.array([goal[0] - AHEAD, goal[1], goal[2]])
    poses = _behind(at, box, robots, start)
    situation = replace(prediction.situation, box=at, speeds=0 * prediction.situation.speeds)
    fields = []
    for robot in range(min(len(poses), MOST_ROBOTS)):
        others = np.delete(poses, robot, axis=0) - at
        points = _grid(box, robots[robot].radius, others)
        moved = []
        for point in points:
            placed = poses.copy()
            placed[robot] = point + at
            seen = replace(situation, robots=placed)
            here = BoxPrediction(seen, prediction.model, prediction.premises)
            after = here.poses(choose(here)[None])
            moved.append(after.robots[robot, :, 0] - placed[robot])
        ways, turns = np.split(np.array(moved), [2], axis=1)
        fields.append(Field(robot, points, ways, wrap(turns[:, 0]), others[:, :2]))
    return BoxPolicyMap(tuple(fields), box, robots[0])


def _behind(at: FloatArray, box: BoxSpec, robots: list[RobotSettings], start: str) -> FloatArray:
    """Return poses ``(M, 3)`` behind a box, or if they do not fit there as at a start."""
    try:
        poses, was, _ = place("medium", np.random.default_rng(0), robots, box)
    except ValueError:
        poses, was, _ = place(start, np.random.default_rng(0), robots, box)
    turn = at[2] - was[2]
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    places = at[:2] + (poses[:, :2] - was[:2]) @ rotation.T
    return np.column_stack([places, wrap(poses[:, 2] + turn)])


def _grid(box: BoxSpec, radius: float, others: FloatArray) -> FloatArray:
    """Return poses ``(m, 3)`` around the box, looking at its centre, where there is room."""
    outline = box.outline
    polygon = box.polygon
    holes = [] if polygon is None else [Polygon(ring) for ring in polygon.interiors]
    line = np.linspace(-1, 1, POINTS) * (box.reach + AROUND)
    points = []
    for y in line:
        for x in line:
            clear = surface(outline.edges, outline.rounding, x, y)[0] > radius
            apart = np.hypot(others[:, 0] - x, others[:, 1] - y)
            reached = not any(hole.contains(Point(x, y)) for hole in holes)
            if clear and reached and (apart > 2 * radius).all():
                points.append((x, y, np.arctan2(-y, -x)))
    return np.array(points)


def _draw(axes: Axes, field: Field, box: BoxSpec, radius: float) -> None:
    reach = box.reach + AROUND
    spacing = 2 * reach / 16
    moves = np.array(field.moves)
    colours = [COLOURS[move] for move in moves]
    longest = max(float(np.hypot(*field.ways.T).max()), 1e-9)
    ways = 0.9 * spacing * field.ways / longest
    axes.add_patch(PathPatch(curve(box), fc=BOX_COLOUR, ec="black", alpha=0.75))
    for spot in field.others:
        axes.add_patch(Circle((spot[0], spot[1]), radius, fc="#bbbbbb", ec="#777777"))
    axes.quiver(
        *field.points[:, :2].T,
        *ways.T,
        color=colours,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        width=0.006,
        headwidth=4,
        headlength=4.5,
    )
    for move, marker, size, here in (
        ("turns", r"$\circlearrowleft$", 7, field.turns > 0),
        ("turns", r"$\circlearrowright$", 7, field.turns < 0),
        ("rests", ".", 3, True),
    ):
        places = field.points[(moves == move) & here, :2]
        axes.plot(*places.T, marker=marker, ms=size, color=COLOURS[move], ls="")
    axes.arrow(0, 0, 0.6 * box.reach, 0, width=0.004, head_width=0.02, color="black")
    axes.text(0.25 * box.reach, 0.03, "to the goal", ha="center", fontsize=7)
    ends = -reach - spacing, reach + spacing
    # A box aspect of 1 gives equal lengths; an aspect would cut the title off.
    axes.set(xlim=ends, ylim=ends, box_aspect=1.0, xlabel="along the course to the goal [m]")
    axes.set_title(f"robot {field.robot + 1}; longest arrow {1000 * longest:.0f} mm", loc="left")
