"""Pictures of box pushing, drawn from recordings: one moment, or an episode as GIF or MP4.

A recording is a mapping of arrays: ``robot_poses (T + 1, M, 3)``, ``box_pose (T + 1, 3)``,
``goal_pose (3,)``, ``wheel_speeds (T + 1, n)``, ``contact (T + 1, M)``, ``reward (T,)``, optionally
``failed (T + 1, n)``; and constants of no dimension: ``robot`` and ``box`` by name, ``dt`` [s].
Robots show their heading, their wheels with the speed commanded, and turn solid in contact; failed
wheels are crossed out. The goal pose is the dashed outline; trails show where all have been.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray
from PIL import Image

from ..core.arrays import FloatArray
from .boxes import box_for
from .robots import RobotSpec, robot_for

Recording = Mapping[str, FloatArray]
Pixels = NDArray[np.uint8]

SIDES = (800, 480)
"""Width and height of a picture in pixels: multiples of 16, as video codecs want them."""
AXES = (0.09, 0.11, 0.89, 0.81)
"""Left, bottom, width and height of the axes as fractions of the picture."""
DPI = 100
MOST_FRAMES = 120
"""Longer episodes are thinned out to this many frames."""
# Colour-blind-safe (Okabe and Ito 2008).
ROBOT_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
BOX_COLOUR, GOAL_COLOUR, FAILED_COLOUR = "#E69F00", "#555555", "#B00020"


def _outline(recording: Recording) -> FloatArray:
    """Return the closed outline ``(k, 2)`` of the box in its frame [m]."""
    box = box_for(str(recording["box"]), recording["robot_poses"].shape[1])
    if box.polygon is None:
        angles = np.linspace(0, 2 * np.pi, 65)
        return box.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.array(box.polygon.exterior.coords)


class _Stage:
    """A figure on which any moment of a recording can be drawn."""

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.robot: RobotSpec = robot_for(str(recording["robot"]))
        self.outline = _outline(recording)
        self.figure = Figure(figsize=(SIDES[0] / DPI, SIDES[1] / DPI), dpi=DPI)
        self.canvas = FigureCanvasAgg(self.figure)
        self.axes = self.figure.add_axes(AXES)
        self.axes.set_aspect("equal")
        places = np.concatenate(
            [
                recording["robot_poses"][..., :2].reshape(-1, 2),
                recording["box_pose"][:, :2],
                recording["goal_pose"][None, :2],
            ]
        )
        reach = float(np.hypot(*self.outline.T).max())
        low, high = places.min(axis=0) - reach - 0.03, places.max(axis=0) + reach + 0.03
        # One metre is as long both ways: widen what is too narrow for the picture.
        room = np.array([SIDES[0] * AXES[2], SIDES[1] * AXES[3]])
        half = 0.5 * float(((high - low) / room).max()) * room
        middle = 0.5 * (low + high)
        self.axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        self.axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
        self.axes.set_xlabel("x [m]")
        self.axes.set_ylabel("y [m]")
        self.axes.grid(color="#eeeeee")
        self.axes.set_axisbelow(True)
        self._place(Polygon(self.outline, fill=False, ls="--", lw=1.5, ec=GOAL_COLOUR), "goal_pose")
        self._moving: list[Artist] = []

    def _at(self, pose: FloatArray) -> Affine2D:
        return Affine2D().rotate(float(pose[2])).translate(float(pose[0]), float(pose[1]))

    def _place(self, patch: Polygon | Circle | Rectangle, name: str) -> None:
        patch.set_transform(self._at(self.recording[name]) + self.axes.transData)
        self.axes.add_patch(patch)

    def draw(self, step: int) -> None:
        """Draw the moment after `step` steps."""
        for artist in self._moving:
            artist.remove()
        self._moving = []
        box = self.recording["box_pose"]
        self._trail(box, step, BOX_COLOUR)
        self._patch(Polygon(self.outline, fc=BOX_COLOUR, ec="black", alpha=0.75), box[step])
        wheels = len(self.robot.wheels)
        for r in range(self.recording["robot_poses"].shape[1]):
            self._robot(r, step, slice(r * wheels, (r + 1) * wheels))
        goal = self.recording["goal_pose"]
        gap = float(np.hypot(*(box[step, :2] - goal[:2])))
        self.axes.set_title(
            f"step {step}, {step * float(self.recording['dt']):.1f} s: box {100 * gap:.0f} cm "
            "from the goal",
            loc="left",
            fontsize=11,
        )

    def _robot(self, r: int, step: int, wheels: slice) -> None:
        poses = self.recording["robot_poses"][:, r]
        colour = ROBOT_COLOURS[r % len(ROBOT_COLOURS)]
        touching = bool(self.recording["contact"][step, r])
        speeds = self.recording["wheel_speeds"][step, wheels]
        failed: FloatArray = np.zeros(len(speeds))
        if "failed" in self.recording:
            failed = self.recording["failed"][step, wheels]
        radius = self.robot.radius
        self._trail(poses, step, colour)
        body = Circle((0, 0), radius, fc=colour, ec=colour, alpha=0.9 if touching else 0.4)
        self._patch(body, poses[step])
        nose = Polygon([(radius, 0), (0.4 * radius, 0.35 * radius), (0.4 * radius, -0.35 * radius)])
        nose.set_facecolor("white")
        self._patch(nose, poses[step])
        length, width = 0.5 * radius, 0.16 * radius
        for wheel, speed, broken in zip(self.robot.wheels, speeds, failed, strict=True):
            corner = (wheel.x - length / 2, wheel.y - width / 2)
            fill = FAILED_COLOUR if broken else "black"
            self._patch(Rectangle(corner, length, width, fc=fill, ec="none"), poses[step])
            ahead = wheel.x + 1.2 * radius * float(speed) / self.robot.max_speed
            shaft = [(wheel.x, wheel.y), (ahead, wheel.y)]
            self._patch(Polygon(shaft, closed=False, fill=False, ec=fill, lw=1.5), poses[step])
            if broken:
                ends = self._at(poses[step]).transform([(wheel.x, wheel.y)])
                self._moving += self.axes.plot(*ends.T, "x", color=FAILED_COLOUR, ms=9, mew=2)

    def _patch(self, patch: Polygon | Circle | Rectangle, pose: FloatArray) -> None:
        patch.set_transform(self._at(pose) + self.axes.transData)
        self._moving.append(self.axes.add_patch(patch))

    def _trail(self, poses: FloatArray, step: int, colour: str) -> None:
        past = poses[: step + 1]
        self._moving += self.axes.plot(past[:, 0], past[:, 1], color=colour, lw=1, alpha=0.7)

    def pixels(self) -> Pixels:
        """Return what is drawn as ``(height, width, 3)`` bytes."""
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


def picture(recording: Recording, step: int) -> Pixels:
    """Return the moment after `step` steps as ``(height, width, 3)`` bytes."""
    stage = _Stage(recording)
    stage.draw(step)
    return stage.pixels()


def snapshot(recording: Recording, step: int, path: Path) -> None:
    """Draw the moment after `step` steps (negative: from the end) to a picture file."""
    stage = _Stage(recording)
    stage.draw(range(len(recording["box_pose"]))[step])
    stage.figure.savefig(path, dpi=DPI)


def animate(recording: Recording, path: Path, speed: float = 4.0) -> None:
    """Draw an episode as an animation, GIF or MP4 by the suffix of `path`.

    Parameters
    ----------
    recording
        The episode.
    path
        Where to write; an unfinished animation never bears this name.
    speed
        How many times faster than real time it plays; thinned-out episodes play faster still.

    Raises
    ------
    ValueError
        If the suffix is neither ``.gif`` nor ``.mp4``.
    """
    if path.suffix not in (".gif", ".mp4"):
        raise ValueError(f"animation: suffix {path.suffix!r} of {path.name}, allowed .gif or .mp4")
    stage = _Stage(recording)
    last = len(recording["box_pose"]) - 1
    steps = np.unique(np.linspace(0, last, min(last + 1, MOST_FRAMES)).round().astype(int))
    frames = []
    for step in steps:
        stage.draw(int(step))
        frames.append(stage.pixels())
    seconds = float(recording["dt"]) / speed
    partial = path.with_name(f".{path.stem}.partial{path.suffix}")
    write = _write_gif if path.suffix == ".gif" else _write_mp4
    write(partial, frames, seconds)
    partial.replace(path)


def _write_gif(path: Path, frames: list[Pixels], seconds: float) -> None:
    # One palette for all frames: colours do not flicker, and it is found only once.
    palette = Image.fromarray(frames[-1]).quantize(128)
    images = [
        Image.fromarray(f).quantize(palette=palette, dither=Image.Dither.NONE) for f in frames
    ]
    durations = [round(1000 * seconds)] * (len(images) - 1) + [1500]
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0)


def _write_mp4(path: Path, frames: list[Pixels], seconds: float) -> None:
    imageio.mimwrite(path, frames, fps=1 / seconds, macro_block_size=16)  # type: ignore[arg-type]
