"""Recorded episodes for a report: those of box pushing packed small for its canvas.

A packed episode is a zlib stream in base64. It holds, one whole column of ``T + 1`` moments after
the other: as 16-bit differences from moment to moment x, y, heading of the box and of every robot;
then as bytes the commanded speed of every wheel, contact of every robot, failure of every wheel.
Lengths are in units of `scale` metres, headings in 1/32768 of half a turn, which wraps by itself,
wheel speeds in 1/127 of the greatest one.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from ...core.numerics.arrays import FloatArray
from ...scenarios.box_pushing.world.boxes import box_for
from ...scenarios.box_pushing.world.robots import robot_for
from ..errors import SpecError
from ..store.durable import NotRecordedError, Recording
from ..store.store import Planned, Store
from .films import Film, films
from .words import runs

NEEDED = (
    "robot_poses", "box_pose", "wheel_speeds", "contact", "failed", "goal_pose", "dt", "robot",
    "box",
)  # fmt: skip
"""What the canvas draws."""
LEAST_SCALE = 1e-4
"""Positions are kept to a tenth of a millimetre, or coarser where they reach beyond 3 m [m]."""
MOST_BYTES = 1_500_000
"""Of all packed episodes together."""


@dataclass(frozen=True)
class Replays:
    """What the page plays.

    Attributes
    ----------
    bodies
        Robots and box with the shapes that they are drawn in.
    episodes
        The packed episodes; `body` is an index into `bodies`.
    films
        Episodes that other scenarios draw themselves.
    missing
        Why finished trials are not shown, and which: seeds by condition by reason.
    """

    bodies: list[dict[str, Any]]
    episodes: list[dict[str, Any]]
    films: list[Film]
    missing: dict[str, dict[str, list[int]]]

    @property
    def remarks(self) -> list[str]:
        """What is missing, in words: a sentence for every reason."""
        said = []
        for reason, trials in self.missing.items():
            by_seeds: dict[str, list[str]] = {}
            for condition, seeds in trials.items():
                by_seeds.setdefault(runs(seeds), []).append(condition)
            parts = [f"{'; '.join(names)}: seeds {seeds}" for seeds, names in by_seeds.items()]
            said.append(f"{reason}: {'. '.join(parts)}.")
        return said


def replays(store: Store, trials: Iterable[Planned], most_bytes: int = MOST_BYTES) -> Replays:
    """Pack the recordings of finished trials, in their order, until there is no more room.

    Those that the canvas cannot play are drawn by their scenarios, one for each condition.
    """
    reached = _reached(store)
    done = {(condition, seed) for condition, seed, _ in reached}
    bodies: dict[tuple[str, str, int], int] = {}
    found = Replays([], [], [], {})
    others: list[Planned] = []
    size = 0

    def miss(trial: Planned, reason: str) -> None:
        trials = found.missing.setdefault(reason, {})
        trials.setdefault(trial.condition, []).append(trial.seed)

    for trial in trials:
        if (trial.condition, trial.seed) not in done:
            continue
        if size >= most_bytes:
            miss(trial, "Left out to keep the page small")
            continue
        try:
            kept = {k: store.recording(trial.identity, name) for k, name in trial.recorded.items()}
            for number, recording in kept.items():
                body = _body_of(recording, bodies, found.bodies)
                episode = {
                    "condition": trial.condition,
                    "seed": trial.seed,
                    "number": number + 1,
                    "reached": reached[trial.condition, trial.seed, number],
                    "body": body,
                    **pack(recording, found.bodies[body]["speed"]),
                }
                found.episodes.append(episode)
                size += len(episode["data"])
        except NotRecordedError:
            miss(trial, "Not shown, as the scenario records no episodes")
        except SpecError:
            miss(trial, "Not shown, as the recording is missing or damaged")
        except ValueError:
            others.append(trial)
    found.films.extend(films(store, others, most_bytes - size))
    filmed = {film.condition for film in found.films}
    for trial in others:
        if trial.condition not in filmed:
            miss(trial, "Not shown, as the scenario cannot draw it, or there is no room")
    return found


def pack(recording: Recording, greatest_speed: float) -> dict[str, Any]:
    """Return an episode packed, with what is needed to unpack it.

    Parameters
    ----------
    recording
        The episode.
    greatest_speed
        Of a wheel [m/s].
    """
    box, robots = recording["box_pose"], recording["robot_poses"]
    poses = np.concatenate([box[:, None], robots], axis=1)
    scale = max(LEAST_SCALE, float(np.abs(poses[..., :2]).max()) / 32767)
    whole = np.empty(poses.shape, dtype=np.int64)
    whole[..., :2] = np.round(poses[..., :2] / scale)
    whole[..., 2] = np.round(poses[..., 2] * (32768 / pi))
    columns = whole.reshape(len(whole), -1).T
    steps = np.diff(columns, axis=1, prepend=0)
    speeds = np.round(np.clip(recording["wheel_speeds"] / greatest_speed, -1, 1) * 127)
    # astype to 16 bits keeps the low ones: a difference of headings across the cut wraps.
    parts = [
        (steps & 0xFFFF).astype("<u2"),
        speeds.T.astype(np.int8),
        recording["contact"].T.astype(np.uint8),
        recording["failed"].T.astype(np.uint8),
    ]
    content = zlib.compress(b"".join(np.ascontiguousarray(p).tobytes() for p in parts), 9)
    return {
        "steps": len(box) - 1,
        "robots": robots.shape[1],
        "scale": round(scale, 9),
        "dt": float(recording["dt"]),
        "goal": [round(float(v), 5) for v in recording["goal_pose"]],
        "data": base64.b64encode(content).decode("ascii"),
    }


def _body_of(
    recording: Recording, known: dict[tuple[str, str, int], int], bodies: list[dict[str, Any]]
) -> int:
    missing = [name for name in NEEDED if name not in recording]
    if missing:
        raise ValueError(f"the recording holds no {missing[0]}")
    key = str(recording["robot"]), str(recording["box"]), recording["robot_poses"].shape[1]
    if key not in known:
        known[key] = len(bodies)
        bodies.append(body(*key))
    return known[key]


def body(robot_name: str, box_name: str, robots: int) -> dict[str, Any]:
    """Return the shapes that robots and box are drawn in [m], and the names of the wheels."""
    robot, box = robot_for(robot_name), box_for(box_name, robots)
    polygon = box.polygon
    rings = [] if polygon is None else [polygon.exterior, *polygon.interiors]
    return {
        "radius": robot.radius,
        "speed": robot.max_speed,
        "wheels": [[wheel.x, wheel.y] for wheel in robot.wheels],
        "agents": [f"robot{r + 1}.{name}" for r in range(robots) for name in robot.wheel_names],
        "rings": [_rounded(np.array(ring.coords)[:-1]) for ring in rings],
        "disc": round(box.radius, 5),
        "reach": round(box.reach, 5),
    }


def _rounded(points: FloatArray) -> list[list[float]]:
    return [[round(float(v), 5) for v in point] for point in points]


def _reached(store: Store) -> Mapping[tuple[str, int, int], bool]:
    """Return whether each training episode reached the goal, by condition, seed and number."""
    names, rows = store.rows("training")
    at = [names.index(name) for name in ("condition", "seed", "episode", "success")]
    return {(row[at[0]], row[at[1]], row[at[2]]): bool(row[at[3]]) for row in rows}
