"""Pictures of box pushing from recordings: one step, or an episode as GIF or MP4.

A recording is a mapping of arrays: ``robot_poses (T + 1, M, 3)``, ``box_pose (T + 1, 3)``,
``goal_pose (3,)``, ``wheel_speeds (T + 1, n)``, ``contact (T + 1, M)``, optionally
``failed (T + 1, n)`` and ``messages_fail (T + 1, n)``; and constants: ``robot`` and ``box`` by name
or described, and ``dt`` [s].

A white nose shows the heading of a robot, and lines show the commanded wheel speeds. Robots in
contact are solid. Failed wheels are crossed out; a dashed ring marks failing messages. The
dashed outline is the goal pose; it and the box point ahead. Trails show past positions.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.patches import Circle, Patch, PathPatch, Polygon, Rectangle
from matplotlib.path import Path as Curve
from matplotlib.transforms import Affine2D

from ....core.numerics import FloatArray, IntArray
from ...movies import Pixels, Scene, film, save_picture
from ..world.boxes import BoxSpec, box_for
from ..world.robots import robot_for

Recording = Mapping[str, FloatArray]

SIDES = (800, 480)
"""Width and height of a picture in pixels: multiples of 16, as video codecs want them."""
AXES = (0.09, 0.11, 0.89, 0.81)
"""Left, bottom, width and height of the axes as fractions of the picture."""
MARGIN_M = 0.04
"""Margin around the drawing."""
# Safe for color-blind readers (Okabe and Ito 2008).
ROBOT_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
BOX_COLOR = "#E69F00"
GOAL_COLOR = "#555555"
FAILED_COLOR = "#B00020"


class BoxScene(Scene):
    """A figure that shows any step of a recording."""

    def __init__(self, recording: Recording) -> None:
        super().__init__(SIDES, AXES)
        self.recording = recording
        self.robot = robot_for(str(recording["robot"]))
        self.box = box_for(str(recording["box"]), recording["robot_poses"].shape[1])
        goal = recording["goal_pose"]
        centers = np.vstack([recording["box_pose"], goal])[:, :2]
        robots = recording["robot_poses"][..., :2].reshape(-1, 2)
        reach, radius = self.box.reach + MARGIN_M, self.robot.radius + MARGIN_M
        low, high = np.array(
            [
                np.minimum(centers.min(axis=0) - reach, robots.min(axis=0) - radius),
                np.maximum(centers.max(axis=0) + reach, robots.max(axis=0) + radius),
            ]
        )
        panel = np.multiply(SIDES, AXES[2:])
        middle, half = (low + high) / 2.0, panel * ((high - low) / panel).max() / 2.0
        x, y = zip(middle - half, middle + half, strict=True)
        self.axes.set(xlim=x, ylim=y, axisbelow=True)
        self.axes.grid(color="#eeeeee")
        self._add_box(goal, fill=False, ls="--", lw=1.5, ec=GOAL_COLOR, zorder=3)
        self._moving = []  # the goal stays

    def _add(self, step: int) -> None:
        box = self.recording["box_pose"]
        self._add_box(box[step], fc=BOX_COLOR, ec="black", alpha=0.75, zorder=1)
        self._trail(box, step, BOX_COLOR)
        silent = self._silent(step)
        for r in range(len(silent)):
            self._add_robot(r, step, is_silent=silent[r] > 0)
        gap = float(np.hypot(*(box[step] - self.recording["goal_pose"])[:2]))
        fails, absent = (
            ", ".join(str(r + 1) for r in np.flatnonzero(silent == kind)) for kind in (1, 2)
        )
        self.axes.set_title(
            f"step {step}, {step * float(self.recording['dt']):.1f} s: box {100 * gap:.0f} cm "
            f"from the goal{f'; messages of robots {fails} fail' * bool(fails)}"
            f"{f'; agents of robots {absent} are absent' * bool(absent)}",
            loc="left",
            fontsize=11,
        )

    def _silent(self, step: int) -> IntArray:
        """Return 1 for robots ``(M,)`` whose messages fail, 2 if one of their agents is absent."""
        robots = self.recording["robot_poses"].shape[1]
        fail = self.recording.get("messages_fail", np.zeros((step + 1, robots)))
        silent: IntArray = fail[step].astype(int).reshape(robots, -1).max(axis=1)
        return silent

    def _add_box(self, pose: FloatArray, **style: object) -> None:
        length = 0.18 * np.sqrt(self.box.area)
        arrow = length * np.array([[-1, 0], [1, 0], [0.5, 0.35], [1, 0], [0.5, -0.35]])
        line = style | {"ls": "-", "fill": False}
        self._patch(PathPatch(curve(self.box), **style), pose)
        self._patch(Polygon(arrow, closed=False, **line), pose)
        self._patch(Circle((0, 0), 0.12 * length, fc=line["ec"], ec="none", zorder=3), pose)

    def _add_robot(self, r: int, step: int, *, is_silent: bool) -> None:
        poses = self.recording["robot_poses"][:, r]
        radius = self.robot.radius
        color = ROBOT_COLORS[r % len(ROBOT_COLORS)]
        alpha = 0.9 if self.recording["contact"][step, r] else 0.4
        nose = [(radius, 0), (0.4 * radius, 0.35 * radius), (0.4 * radius, -0.35 * radius)]
        self._trail(poses, step, color)
        self._patch(Circle((0, 0), radius, fc=color, alpha=alpha), poses[step])
        self._patch(Polygon(nose, fc="white"), poses[step])
        if is_silent:
            ring = Circle((0, 0), 1.3 * radius, fill=False, ec=FAILED_COLOR, ls="--")
            self._patch(ring, poses[step])
        speeds = self.recording["wheel_speeds"]
        failed = self.recording.get("failed", np.zeros_like(speeds))
        for k, wheel in enumerate(self.robot.wheels, r * len(self.robot.wheels)):
            paint = FAILED_COLOR if failed[step, k] else "black"
            corner = (wheel.x - 0.25 * radius, wheel.y - 0.08 * radius)
            tire = Rectangle(corner, 0.5 * radius, 0.16 * radius, fc=paint)
            tip = wheel.x + 1.2 * radius * speeds[step, k] / self.robot.max_speed
            self._patch(tire, poses[step])
            self._patch(Polygon([(wheel.x, wheel.y), (tip, wheel.y)], ec=paint), poses[step])
            if failed[step, k]:
                place = _at(poses[step]).transform([(wheel.x, wheel.y)])
                self._moving += self.axes.plot(*place.T, "x", color=FAILED_COLOR, ms=9, mew=2)

    def _patch(self, patch: Patch, pose: FloatArray) -> None:
        patch.set_transform(_at(pose) + self.axes.transData)
        self._moving.append(self.axes.add_patch(patch))

    def _trail(self, poses: FloatArray, step: int, color: str) -> None:
        past = poses[: step + 1, :2].T
        self._moving += self.axes.plot(*past, color=color, lw=1, alpha=0.7, zorder=0.9)


def _at(pose: FloatArray) -> Affine2D:
    return Affine2D().rotate(float(pose[2])).translate(float(pose[0]), float(pose[1]))


def curve(box: BoxSpec) -> Curve:
    """Return the path along all rings of a box; holes run the other way and stay open."""
    return Curve.make_compound_path(*(Curve(ring, closed=True) for ring in box.rings))


def picture(recording: Recording, step: int) -> Pixels:
    """Return a step of a recording as ``(height, width, 3)`` bytes."""
    return BoxScene(recording).pixels(step)


def snapshot(recording: Recording, step: int, path: Path | str) -> None:
    """Draw a step of a recording (negative: from the end) to a picture file."""
    scene = BoxScene(recording)
    scene.draw(range(len(recording["box_pose"]))[step])
    save_picture(scene.figure, path)


def animate(recording: Recording, path: Path, speed: float = 4.0) -> None:
    """Draw an episode as an animation, GIF or MP4 by the suffix of `path`.

    Parameters
    ----------
    recording
        The episode.
    path
        Path of the file, which exists only once the animation is complete.
    speed
        Factor on real time; animations with omitted frames play faster still.

    Raises
    ------
    ValueError
        If the suffix is neither ``.gif`` nor ``.mp4``.
    """
    scene = BoxScene(recording)
    film(scene.pixels, len(recording["box_pose"]) - 1, float(recording["dt"]) / speed, path)
