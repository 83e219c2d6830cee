"""Pictures and animations of the kinematic chain from recordings.

A recording is a mapping of arrays: ``angles (T + 1, n)`` [rad], ``speeds (T + 1, n)`` [rad/s],
``failed (T + 1, n)``, ``goal (2,)`` [m], and scalars ``reach`` and ``tolerance`` [m], ``top_speed``
[rad/s], ``dt`` [s].

The base is a black square, and the tip an orange dot with its trail. Joints with faster commands
are darker, failed joints are crossed out. The dashed ring is the goal with the radius of the
tolerance, the pale circle the reach of the arm.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.patches import Circle

from ...core.numerics import FloatArray
from ..movies import Scene, film, save_picture
from .variables import forward_kinematics

Recording = Mapping[str, FloatArray]

SIDE = 480
"""Width and height of a picture in pixels."""
# Color-blind-safe (Okabe and Ito 2008), as in the pictures of box pushing.
LINK = "#0072B2"
TIP = "#E69F00"
GOAL = "#555555"
FAILED = "#B00020"


class _ChainScene(Scene):
    """A figure that shows any step of a recording."""

    def __init__(self, recording: Recording) -> None:
        super().__init__((SIDE, SIDE), (0.15, 0.1, 0.83, 0.83))
        self.recording = recording
        angles = recording["angles"]
        reach = float(recording["reach"])
        places = forward_kinematics(angles.T, reach / angles.shape[1])
        self.places = places.transpose(1, 0, 2)
        ends = -1.05 * reach, 1.05 * reach
        self.axes.set(xlim=ends, ylim=ends)
        self.axes.add_patch(Circle((0, 0), reach, fill=False, ec="#dddddd", lw=1))
        goal = recording["goal"]
        ring = max(float(recording["tolerance"]), 0.02 * reach)
        self.axes.add_patch(Circle(tuple(goal), ring, fill=False, ec=GOAL, ls="--", lw=1.5))
        self.axes.plot(0, 0, "s", color="black", ms=7, zorder=2)

    def _add(self, step: int) -> None:
        recording = self.recording
        places = self.places[step]
        tips = self.places[: step + 1, -1]
        away = np.hypot(*(recording["goal"] - places[-1]))
        hurry = np.abs(recording["speeds"][step]) / float(recording["top_speed"])
        n = len(hurry)
        failed = recording["failed"][step].astype(bool)
        size = 9.0 if n <= 8 else 5.0 if n <= 32 else 3.0
        axes = self.axes
        joints = places[:-1]
        x, y = joints.T
        self._moving = [
            *axes.plot(*tips.T, color=TIP, lw=1, alpha=0.7, zorder=1),
            *axes.plot(*places.T, color=LINK, lw=2.5 if n <= 16 else 1.5, zorder=3),
            axes.scatter(
                x,
                y,
                c=hurry,
                cmap="Greys",
                vmin=0.0,
                vmax=1.0,
                s=size**2,
                edgecolors=LINK,
                linewidths=1.0,
                zorder=4,
            ),
            *axes.plot(*joints[failed].T, "x", color=FAILED, ms=size + 3, mew=2.5, zorder=5),
            *axes.plot(*places[-1], "o", color=TIP, ms=6, zorder=6),
        ]
        axes.set_title(f"step {step}: tip {100 * away:.0f} cm from the goal", loc="left")


def animate(recording: Recording, path: Path) -> None:
    """Draw an episode as an animation, GIF or MP4 by the suffix of `path`.

    Parameters
    ----------
    recording
        The episode.
    path
        Where to write; an unfinished animation never bears this name.

    Raises
    ------
    ValueError
        If the suffix is neither ``.gif`` nor ``.mp4``.
    """
    film(_ChainScene(recording).pixels, len(recording["angles"]) - 1, float(recording["dt"]), path)


def snapshot(recording: Recording, path: Path | str) -> None:
    """Draw the last step of a recording to a picture file."""
    scene = _ChainScene(recording)
    scene.draw(len(recording["angles"]) - 1)
    save_picture(scene.figure, path)
