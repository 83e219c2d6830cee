"""Recorded episodes of box pushing for the canvas of a report, see ``player.js``.

The data of an episode are JSON, compressed by zlib, in base64. Every quantity is a column with one
number for each step.
"""

import base64
import json
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ....core.numerics import FloatArray
from ..world.boxes import box_for
from ..world.robots import robot_for

Recording = Mapping[str, FloatArray]

SCRIPT = Path(__file__).with_name("player.js")
"""Script that draws an episode in a browser."""
NEEDED = (
    *("robot_poses", "box_pose", "goal_pose", "wheel_speeds", "contact", "failed"),
    *("dt", "robot", "box"),
)
"""Arrays of a recording that the canvas draws."""


def scene_of(recording: Recording) -> dict[str, object]:
    """Return the shapes of an episode [m] and the names of the wheels.

    They are equal for episodes of equal bodies.

    Raises
    ------
    ValueError
        If the recording lacks an array that is drawn.
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
        "rings": [ring[:-1].round(5).tolist() for ring in box.rings],
        "reach": round(box.reach, 5),
    }


def pack(recording: Recording, scene: Mapping[str, object]) -> dict[str, object]:
    """Return an episode in packed form, with its constants.

    Parameters
    ----------
    recording
        The episode.
    scene
        Shapes of the episode, see `scene_of`.
    """
    steps, n_robots, _ = recording["robot_poses"].shape
    silent = recording.get("messages_fail", np.zeros((steps, 0)))
    columns = {
        "box": _columns(recording["box_pose"], 4),
        "robots": [_columns(recording["robot_poses"][:, r], 4) for r in range(n_robots)],
        "speeds": _columns(recording["wheel_speeds"], 3),
        "contact": _columns(recording["contact"].astype(int)),
        "failed": _columns(recording["failed"].astype(int)),
        "silent": _columns(silent.astype(int)),
    }
    content = zlib.compress(json.dumps(columns, separators=(",", ":")).encode(), 9)
    return {
        "steps": steps - 1,
        "dt": float(recording["dt"]),
        "goal": recording["goal_pose"].round(5).tolist(),
        "data": base64.b64encode(content).decode("ascii"),
    }


def _columns(rows: np.ndarray, digits: int = 0) -> list[list[float]]:
    return rows.T.round(digits).tolist()
