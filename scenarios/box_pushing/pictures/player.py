"""Recorded episodes for a page: packed small for the canvas that ``player.js`` draws.

A packed episode is a zlib stream in base64. It holds, one whole column of ``T + 1`` moments after
the other: as 16-bit differences from moment to moment x, y, heading of the box and of every robot;
then as bytes the commanded speed of every wheel, contact of every robot, failure of every wheel,
and whether messages of each agent fail, if they ever are to.
Lengths are in units of `scale` metres, headings in 1/32768 of half a turn, which wraps by itself,
wheel speeds in 1/127 of the greatest one.
"""

import base64
import zlib
from collections.abc import Mapping
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from ....core.numerics import FloatArray
from ..world.bodies import box_for, robot_for

Recording = Mapping[str, Any]

SCRIPT = Path(__file__).with_suffix(".js")
"""What draws an episode in a browser."""
NEEDED = (
    "robot_poses", "box_pose", "wheel_speeds", "contact", "failed", "goal_pose", "dt", "robot",
    "box",
)  # fmt: skip
"""What the canvas draws."""
LEAST_SCALE = 1e-4
"""Positions are kept to a tenth of a millimetre, or coarser where they reach beyond 3 m [m]."""


def scene_of(recording: Recording) -> dict[str, Any]:
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
    robot, box = robot_for(str(recording["robot"])), box_for(str(recording["box"]), robots)
    return {
        "radius": robot.radius,
        "speed": robot.max_speed,
        "wheels": [[wheel.x, wheel.y] for wheel in robot.wheels],
        "agents": [f"robot{r + 1}.{name}" for r in range(robots) for name in robot.wheel_names],
        "rings": [] if box.radius else [_rounded(ring[:-1]) for ring in box.rings],
        "disc": round(box.radius, 5),
        "reach": round(box.reach, 5),
    }


def pack(recording: Recording, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return an episode packed, with what is needed to unpack it.

    Parameters
    ----------
    recording
        The episode.
    scene
        The shapes that `scene_of` gives for it.
    """
    box, robots = recording["box_pose"], recording["robot_poses"]
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
        "goal": [round(float(v), 5) for v in recording["goal_pose"]],
        "data": base64.b64encode(content).decode("ascii"),
    }


def _rounded(points: FloatArray) -> list[list[float]]:
    return [[round(float(v), 5) for v in point] for point in points]
