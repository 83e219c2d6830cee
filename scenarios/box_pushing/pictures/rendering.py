"""Pictures of box pushing, drawn from recordings: one moment, an episode as GIF or MP4, a page.

A recording is a mapping of arrays: ``robot_poses (T + 1, M, 3)``, ``box_pose (T + 1, 3)``,
``goal_pose (3,)``, ``wheel_speeds (T + 1, n)``, ``contact (T + 1, M)``, ``reward (T,)`` or
``(T, n)``, optionally ``failed (T + 1, n)`` and ``messages_fail (T + 1, n)``; and constants of no
dimension: ``robot`` and ``box`` by name or described, ``dt`` [s], optionally ``infrared``
described.

A white nose shows the heading of a robot, and lines show the commanded wheel speeds. Robots in
contact are solid. Failed wheels are crossed out; a dashed ring marks failing messages. The
dashed outline is the goal pose; it and the box point ahead. Trails show where all have been. With
``sensors`` rays are drawn as far as infrared sensors see; those that meet something are violet and
end there, the wider the stronger the reading. Robots too small to show wheels show a line ahead,
always solid, and are never drawn smaller than a few pixels.

For a page an episode is packed small for the canvas that ``player.js`` draws. A packed episode is a
zlib stream in base64. It holds, one whole column of ``T + 1`` moments after the other: as 16-bit
differences from moment to moment x, y, heading of the box and of every robot; then as bytes the
commanded speed of every wheel, contact of every robot, failure of every wheel, and whether messages
of each agent fail, if they ever are to. Lengths are in units of `scale` metres, headings in 1/32768
of half a turn, which wraps by itself, wheel speeds in 1/127 of the greatest one.
"""

import base64
import zlib
from collections.abc import Mapping
from math import pi
from pathlib import Path
from typing import TypedDict

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle, Patch, PathPatch, Polygon, Rectangle
from matplotlib.path import Path as Curve
from matplotlib.transforms import Affine2D

from ....core.numerics import BoolArray, FloatArray
from ...movies import Pixels, Scene, film, save_picture
from ..world.boxes import BoxSpec, box_for
from ..world.geometry import InfraredSensors, infrared_readings
from ..world.robots import robot_for, sensor_directions
from ..world.settings import InfraredSettings, RobotSettings

Recording = Mapping[str, FloatArray]

SIDES = (800, 480)
"""Width and height of a picture in pixels: multiples of 16, as video codecs want them."""
AXES = (0.09, 0.11, 0.89, 0.81)
"""Left, bottom, width and height of the axes as fractions of the picture."""
LEAST_RADIUS = 3.5
"""Radius of a robot in pixels, at least."""
WHEELS_FROM = 6.0
"""Radius of a robot in pixels from which on its wheels are drawn."""
MARGIN = 0.04
"""Margin around the drawing, as a fraction of its size."""
# Colour-blind-safe (Okabe and Ito 2008).
ROBOT_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
BOX_COLOUR = "#E69F00"
GOAL_COLOUR = "#555555"
FAILED_COLOUR = "#B00020"
RAY_COLOUR = "#BBBBBB"
HIT_COLOUR = "#6A3D9A"


def _pointer(box: BoxSpec) -> FloatArray:
    """Return an arrow ``(k, 2)`` from the centre of a box ahead, in its frame [m]."""
    size = 0.3 * np.sqrt(box.area)
    return size * np.array([[-0.6, 0.0], [0.6, 0.0], [0.3, 0.2], [0.6, 0.0], [0.3, -0.2]])


class _BoxScene(Scene):
    """A figure on which any moment of a recording can be drawn."""

    def __init__(self, recording: Recording, *, sensors: bool = False) -> None:
        super().__init__(SIDES, AXES)
        self.recording = recording
        self.robot: RobotSettings = robot_for(str(recording["robot"]))
        robots = recording["robot_poses"].shape[1]
        self.box = box_for(str(recording["box"]), robots)
        described = str(recording.get("infrared", "{}"))
        self.infrared = InfraredSettings.model_validate_json(described) if sensors else None
        low, high = self._extent()
        # One metre is as long both ways: widen what is too narrow for the picture.
        room = np.array([SIDES[0] * AXES[2], SIDES[1] * AXES[3]])
        metres_per_pixel = float(((high - low) / room).max()) * (1 + 2 * MARGIN)
        half = 0.5 * metres_per_pixel * room
        middle = 0.5 * (low + high)
        across, along = np.stack([middle - half, middle + half], axis=1)
        self.axes.set(xlim=across, ylim=along, axisbelow=True)
        self.axes.grid(color="#eeeeee")
        # Robots that would be dots are drawn larger than they are.
        self.pixels_of_robot = max(self.robot.radius / metres_per_pixel, LEAST_RADIUS)
        self.radius = self.pixels_of_robot * metres_per_pixel
        goal = recording["goal_pose"]
        line = {"fill": False, "lw": 1.5, "ec": GOAL_COLOUR, "zorder": 3}
        self._patch(PathPatch(curve(self.box), ls="--", **line), goal)
        self._patch(Polygon(_pointer(self.box), closed=False, **line), goal)
        self._moving = []  # these stay

    def _extent(self) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest coordinates ``(2,)`` of all that is ever drawn."""
        poses = np.vstack([self.recording["box_pose"], self.recording["goal_pose"]])
        cos = np.cos(poses[:, 2])
        sin = np.sin(poses[:, 2])
        turns = np.array([[cos, -sin], [sin, cos]])
        corners = np.einsum("ijt,kj->tki", turns, self.box.rings[0]) + poses[:, None, :2]
        robots = self.recording["robot_poses"][..., :2].reshape(-1, 2)
        places = np.vstack(
            [corners.reshape(-1, 2), robots - self.robot.radius, robots + self.robot.radius]
        )
        return places.min(axis=0), places.max(axis=0)

    def _add(self, step: int) -> None:
        box = self.recording["box_pose"]
        fill = to_rgba(BOX_COLOUR, 0.75)
        self._patch(PathPatch(curve(self.box), fc=fill, ec="black", zorder=1), box[step])
        pointer = Polygon(_pointer(self.box), closed=False, fill=False, lw=1.5, zorder=1)
        self._patch(pointer, box[step])
        self._trail(box, step, BOX_COLOUR)
        if self.infrared is not None:
            self._rays(step, self.infrared)
        wheels = len(self.robot.wheels)
        for r in range(self.recording["robot_poses"].shape[1]):
            self._robot(r, step, slice(r * wheels, (r + 1) * wheels))
        goal = self.recording["goal_pose"]
        gap = float(np.hypot(*(box[step, :2] - goal[:2])))
        silent = ", ".join(str(r + 1) for r in np.flatnonzero(self._silent(step)))
        self.axes.set_title(
            f"step {step}, {step * float(self.recording['dt']):.1f} s: box {100 * gap:.0f} cm "
            f"from the goal{f'; messages of robots {silent} fail' * bool(silent)}",
            loc="left",
            fontsize=11,
        )

    def _silent(self, step: int) -> BoolArray:
        """Return of which robots ``(M,)`` messages fail."""
        robots = self.recording["robot_poses"].shape[1]
        fail = self.recording.get("messages_fail", np.zeros((step + 1, robots)))
        return fail[step].reshape(robots, -1).any(axis=1)

    def _robot(self, r: int, step: int, wheels: slice) -> None:
        poses = self.recording["robot_poses"][:, r]
        colour = ROBOT_COLOURS[r % len(ROBOT_COLOURS)]
        touching = bool(self.recording["contact"][step, r])
        speeds = self.recording["wheel_speeds"][step, wheels]
        none = np.zeros_like(self.recording["wheel_speeds"])
        failed = self.recording.get("failed", none)[step, wheels]
        radius = self.radius
        scale = min(1.0, self.pixels_of_robot / 20)
        self._trail(poses, step, colour)
        small = self.pixels_of_robot < WHEELS_FROM
        fill = to_rgba(colour, 0.9 if touching or small else 0.4)
        self._patch(Circle((0, 0), radius, fc=fill, ec=colour, lw=scale), poses[step])
        if self._silent(step)[r]:
            ring = Circle((0, 0), 1.3 * radius, fill=False, ec=FAILED_COLOUR, ls="--", lw=1)
            self._patch(ring, poses[step])
        if small:
            edge = FAILED_COLOUR if failed.any() else "black"
            line = [(0.0, 0.0), (radius, 0.0)]  # no longer, or a row of robots looks like a comb
            self._patch(Polygon(line, closed=False, fill=False, ec=edge, lw=0.8), poses[step])
            return
        nose = [(radius, 0), (0.4 * radius, 0.35 * radius), (0.4 * radius, -0.35 * radius)]
        self._patch(Polygon(nose, fc="white", ec=colour, lw=scale), poses[step])
        length = 0.5 * radius
        width = 0.16 * radius
        for wheel, speed, broken in zip(self.robot.wheels, speeds, failed, strict=True):
            corner = (wheel.x - length / 2, wheel.y - width / 2)
            paint = FAILED_COLOUR if broken else "black"
            self._patch(Rectangle(corner, length, width, fc=paint, ec="none"), poses[step])
            ahead = wheel.x + 1.2 * radius * float(speed) / self.robot.max_speed
            shaft = [(wheel.x, wheel.y), (ahead, wheel.y)]
            self._patch(Polygon(shaft, closed=False, fill=False, ec=paint, lw=scale), poses[step])
            if broken:
                ends = _at(poses[step]).transform([(wheel.x, wheel.y)])
                self._moving += self.axes.plot(
                    *ends.T, "x", color=FAILED_COLOUR, ms=9 * scale, mew=2 * scale
                )

    def _rays(self, step: int, infrared: InfraredSettings) -> None:
        poses = self.recording["robot_poses"][step]
        box = self.recording["box_pose"][step]
        outline = self.box.outline
        radius = self.robot.radius
        directions = sensor_directions([self.robot] * len(poses))
        radii = np.full(len(poses), radius)
        # Linear readings tell distances.
        sensors = InfraredSensors(radii, directions, infrared.reach, infrared.decay, 1)
        readings = infrared_readings(poses, box, outline.edges, outline.rounding, sensors)
        linear = readings.max(axis=0)
        distances = infrared.reach * (1.0 - linear)
        angles = poses[:, 2:] + directions
        along = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        eyes = poses[:, None, :2] + radius * along
        segments = np.stack([eyes, eyes + distances[..., None] * along], axis=2)
        hits = linear > 0
        widths = 0.8 + 2.2 * infrared.reading(distances[hits])
        for shown, colour, width in ((~hits, RAY_COLOUR, 0.6), (hits, HIT_COLOUR, widths)):
            rays = LineCollection(segments[shown], colors=colour, linewidths=width, zorder=1.5)
            self._moving.append(self.axes.add_collection(rays, autolim=False))

    def _patch(self, patch: Patch, pose: FloatArray) -> None:
        patch.set_transform(_at(pose) + self.axes.transData)
        self._moving.append(self.axes.add_patch(patch))

    def _trail(self, poses: FloatArray, step: int, colour: str) -> None:
        past = poses[: step + 1, :2].T
        self._moving += self.axes.plot(*past, color=colour, lw=1, alpha=0.7, zorder=0.9)


def _at(pose: FloatArray) -> Affine2D:
    return Affine2D().rotate(float(pose[2])).translate(float(pose[0]), float(pose[1]))


def curve(box: BoxSpec) -> Curve:
    """Return a path along the rings of a box, against each other, so that holes stay open."""
    return Curve.make_compound_path(*(Curve(ring, closed=True) for ring in box.rings))


def picture(recording: Recording, step: int, *, sensors: bool = False) -> Pixels:
    """Return the moment after `step` steps as ``(height, width, 3)`` bytes."""
    return _BoxScene(recording, sensors=sensors).pixels(step)


def snapshot(recording: Recording, step: int, path: Path | str, *, sensors: bool = False) -> None:
    """Draw the moment after `step` steps (negative: from the end) to a picture file."""
    scene = _BoxScene(recording, sensors=sensors)
    scene.draw(range(len(recording["box_pose"]))[step])
    save_picture(scene.figure, path)


def animate(recording: Recording, path: Path, speed: float = 4.0, *, sensors: bool = False) -> None:
    """Draw an episode as an animation, GIF or MP4 by the suffix of `path`.

    Parameters
    ----------
    recording
        The episode.
    path
        Where to write; an unfinished animation never bears this name.
    speed
        How many times faster than real time it plays; thinned-out episodes play faster still.
    sensors
        Whether rays of infrared sensors are drawn.

    Raises
    ------
    ValueError
        If the suffix is neither ``.gif`` nor ``.mp4``.
    """
    scene = _BoxScene(recording, sensors=sensors)
    film(scene.pixels, len(recording["box_pose"]) - 1, float(recording["dt"]) / speed, path)


SCRIPT = Path(__file__).with_name("player.js")
"""Script that draws an episode in a browser."""
NEEDED = (
    "robot_poses",
    "box_pose",
    "wheel_speeds",
    "contact",
    "failed",
    "goal_pose",
    "dt",
    "robot",
    "box",
)
"""Arrays of a recording that the canvas draws."""
LEAST_SCALE = 1e-4
"""Positions are kept to a tenth of a millimetre, or coarser where they reach beyond 3 m [m]."""


class Shapes(TypedDict):
    """Shapes that the canvas draws; lengths in meters."""

    radius: float
    """Radius of a robot."""
    speed: float
    """Greatest speed of a wheel [m/s]."""
    wheels: list[list[float]]
    """Positions of the wheels of a robot."""
    agents: list[str]
    """Names of all wheels."""
    rings: list[list[list[float]]]
    """Outline of the box and of its holes; of a disc none."""
    disc: float
    """Radius of a box that is a disc, else 0."""
    reach: float
    """Distance from the centre within which all of the box lies."""


def scene_of(recording: Recording) -> Shapes:
    """Return the shapes of an episode [m] and the names of the wheels.

    They are equal for episodes of equal bodies.

    Raises
    ------
    ValueError
        If the recording does not hold what is drawn.
    """
    missing = [name for name in NEEDED if name not in recording]
    if missing:
        raise ValueError(f"the recording holds no {missing[0]}")
    robots = recording["robot_poses"].shape[1]
    robot = robot_for(str(recording["robot"]))
    box = box_for(str(recording["box"]), robots)
    return {
        "radius": robot.radius,
        "speed": robot.max_speed,
        "wheels": [[wheel.x, wheel.y] for wheel in robot.wheels],
        "agents": [f"robot{r + 1}.{name}" for r in range(robots) for name in robot.wheel_names],
        "rings": [] if box.radius else [ring[:-1].round(5).tolist() for ring in box.rings],
        "disc": round(box.radius, 5),
        "reach": round(box.reach, 5),
    }


def pack(recording: Recording, scene: Shapes) -> dict[str, object]:
    """Return an episode packed, with what is needed to unpack it.

    Parameters
    ----------
    recording
        The episode.
    scene
        The shapes that `scene_of` gives for it.
    """
    box = recording["box_pose"]
    robots = recording["robot_poses"]
    poses = np.concatenate([box[:, None], robots], axis=1)
    scale = max(LEAST_SCALE, float(np.abs(poses[..., :2]).max()) / 32767)
    whole = np.empty(poses.shape, dtype=np.int64)
    whole[..., :2] = np.round(poses[..., :2] / scale)
    whole[..., 2] = np.round(poses[..., 2] * (32768 / pi))
    columns = whole.reshape(len(whole), -1).T
    steps = np.diff(columns, axis=1, prepend=0)
    speeds = np.round(np.clip(recording["wheel_speeds"] / scene["speed"], -1, 1) * 127)
    # astype to 16 bits keeps the low ones: a difference of headings across the cut wraps.
    silent = recording.get("messages_fail", np.zeros((len(whole), 0)))
    parts = [
        (steps & 0xFFFF).astype("<u2"),
        speeds.T.astype(np.int8),
        recording["contact"].T.astype(np.uint8),
        recording["failed"].T.astype(np.uint8),
        silent.T.astype(np.uint8),
    ]
    content = zlib.compress(b"".join(np.ascontiguousarray(p).tobytes() for p in parts), 9)
    return {
        "steps": len(box) - 1,
        "robots": robots.shape[1],
        "talking": silent.shape[1],
        "scale": round(scale, 9),
        "dt": float(recording["dt"]),
        "goal": recording["goal_pose"].round(5).tolist(),
        "data": base64.b64encode(content).decode("ascii"),
    }
