"""Initial poses of robots, box and goal.

The goal pose is always (1 m, 0, 0): one meter away in the easier starts' mean direction, unless
distances are in units of the box. *Bearing* is the direction from box to goal, *behind* the back of
the box (its -x side). A further distribution is one `Start` and one line in `STARTS`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, radians, sin

import numpy as np

from ....core.numerics import FloatArray, optimize, wrap
from .boxes import BoxSpec
from .geometry import distances, surface
from .settings import RobotSettings

GOAL = (1.0, 0.0, 0.0)
"""Goal pose of the box [m, m, rad]."""
ATTEMPTS = 500
"""Draws of one robot's place before the robots are refused as not fitting."""
CLEARANCE = 0.002
"""Least gap between two robots [m]."""
GRID = 64
"""Points of a ray at which the surface of the box is looked for."""
PRECISION = 1e-9
"""Precision of the gap to the box [m]."""


@dataclass(frozen=True)
class Start:
    """A start distribution; all quantities uniform and independent."""

    distance: float
    """Distance from the box to the goal [m]."""
    bearing: float
    """Greatest absolute bearing of the goal from the box [rad]; pi: any."""
    angle: float
    """Greatest absolute angle of the box [rad]; pi: any."""
    heading: float
    """Greatest absolute heading of a robot relative to the box [rad]; pi: any."""
    gaps: tuple[float, float]
    """Least and greatest distance between a robot's surface and the box's [m]."""
    around: bool = False
    """Whether robots stand anywhere around the box, or side by side behind it."""
    spread: float = 1.0
    """Fraction of the free space behind the box that is distributed randomly between robots."""


STARTS: dict[str, Start] = {
    "fixed": Start(1.0, 0.0, 0.0, 0.0, (0.025, 0.025), spread=0.0),
    "easy": Start(0.6, radians(10), radians(10), radians(10), (0.005, 0.045)),
    "medium": Start(1.0, radians(25), radians(25), radians(20), (0.005, 0.045)),
    "hard": Start(1.0, pi, pi, pi, (0.01, 0.15), around=True),
}
"""Start distributions by the name that specs use."""


def place(
    start: str,
    rng: np.random.Generator,
    robots: Sequence[RobotSettings],
    box: BoxSpec,
    unit: float = 1.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Draw the start of an episode.

    Parameters
    ----------
    start
        Name of the distribution.
    rng
        Random numbers.
    robots, box
        Robots and box to place.
    unit
        Multiplies the distance from the box to the goal; robots are as near to the box as ever,
        since they do not grow.

    Returns
    -------
    robot_poses, box_pose, goal_pose : FloatArray
        ``(M, 3)``, ``(3,)`` and ``(3,)`` [m, m, rad].

    Raises
    ------
    ValueError
        If the robots do not fit.

    Examples
    --------
    >>> from nested_agents.scenarios.box_pushing.world.boxes import BOXES
    >>> from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
    >>> pair = [ROBOTS["e-puck"]] * 2
    >>> robots, box, goal = place("easy", np.random.default_rng(0), pair, BOXES["square"])
    >>> round(float(np.hypot(*(goal - box)[:2])), 9), bool((robots[:, 0] < box[0]).all())
    (0.6, True)
    """
    spec = STARTS[start]
    bearing = rng.uniform(-spec.bearing, spec.bearing)
    angle = rng.uniform(-spec.angle, spec.angle)
    goal = np.array(GOAL)
    away = unit * spec.distance * np.array([cos(bearing), sin(bearing)])
    box_pose = np.array([*(goal[:2] - away), angle])
    local = _around(spec, rng, robots, box) if spec.around else _behind(spec, rng, robots, box)
    turn = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    poses = np.column_stack([box_pose[:2] + local[:, :2] @ turn.T, wrap(local[:, 2] + angle)])
    return poses, box_pose, goal


def approach(
    box: BoxSpec, origin: tuple[float, float], azimuth: float, gap: float
) -> tuple[float, float]:
    """Return the point of a ray out of the box that is `gap` from its surface.

    If there are several, as in a hollow, it is the outermost; if there is none, the origin.
    """
    dx = cos(azimuth)
    dy = sin(azimuth)

    def excess(t: float) -> float:
        return float(surface(box.shape, origin[0] + t * dx, origin[1] + t * dy)[0]) - gap

    steps = np.linspace(0.0, 2 * (box.reach + gap), GRID)
    gaps = distances(origin[0] + steps * dx, origin[1] + steps * dy, box.shape)
    near = np.flatnonzero(gaps < gap)
    if not len(near):
        return origin
    t = optimize.brentq(excess, steps[near[-1]], steps[near[-1] + 1], xtol=PRECISION)
    return origin[0] + t * dx, origin[1] + t * dy


def _behind(
    spec: Start, rng: np.random.Generator, robots: Sequence[RobotSettings], box: BoxSpec
) -> FloatArray:
    """Return poses ``(M, 3)`` side by side behind the box, first robot leftmost, in its frame."""
    least, most = box.width
    spans = np.array([2 * robot.radius + CLEARANCE for robot in robots])
    room = most - least - spans.sum()
    if room < 0:
        raise ValueError(
            f"robots: {len(robots)} of {spans.sum():.3f} m in all do not fit side by side behind "
            f"box {box.name!r} of {most - least:.3f} m"
        )
    # Sorted uniform numbers distribute the free space evenly between and around the robots.
    even = room * np.arange(1, len(robots) + 1) / (len(robots) + 1)
    free = even + spec.spread * (np.sort(rng.uniform(0, room, len(robots))) - even)
    offsets = most - free - np.cumsum(spans) + spans / 2
    poses = np.empty((len(robots), 3))
    for r, robot in enumerate(robots):
        gap = robot.radius + rng.uniform(*spec.gaps)
        x, y = approach(box, (0.0, float(offsets[r])), pi, gap)
        poses[r] = x, y, rng.uniform(-spec.heading, spec.heading)
    return poses


def _around(
    spec: Start, rng: np.random.Generator, robots: Sequence[RobotSettings], box: BoxSpec
) -> FloatArray:
    """Return poses ``(M, 3)`` anywhere around the box, in its frame."""
    poses = np.empty((len(robots), 3))
    for r, robot in enumerate(robots):
        for _ in range(ATTEMPTS):
            gap = robot.radius + rng.uniform(*spec.gaps)
            x, y = approach(box, (0.0, 0.0), rng.uniform(-pi, pi), gap)
            radii = np.array([other.radius for other in robots[:r]])
            apart = np.hypot(poses[:r, 0] - x, poses[:r, 1] - y)
            if (apart > radii + robot.radius + CLEARANCE).all():
                break
        else:
            raise ValueError(
                f"robots: {len(robots)} do not fit around box {box.name!r}: robot {r + 1} found no "
                f"free place in {ATTEMPTS} draws"
            )
        poses[r] = x, y, rng.uniform(-spec.heading, spec.heading)
    return poses
