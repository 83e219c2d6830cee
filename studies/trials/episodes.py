"""What is measured of an episode, and what is recorded of it."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.loop import StepRecord
from ...core.protocols import Transition

Recording = dict[str, NDArray[Any]]
"""Arrays of one episode by name; with T steps, M robots and n agents: `robot_poses` (T + 1, M, 3),
`box_pose` (T + 1, 3), `goal_pose` (3,), `wheel_speeds` (T + 1, n), `contact` (T + 1, M),
`failed` (T + 1, n) wheels, `reward` (T,), `dt` [s] () of one decision, `robot` and `box` () by
name."""

RECORDED = ("robot_poses", "box_pose", "wheel_speeds", "contact", "failed")


class EpisodeRow(NamedTuple):
    """The measurements of one episode."""

    phase: str
    """``training`` or ``evaluation``."""
    episode: int
    """Counted from 0 within its phase."""
    steps: int
    success: bool
    """Whether the box came within the tolerance of the goal, at whatever speed."""
    stopped_at_goal: bool
    """Whether it was there, nearly at rest, once the robots had stopped."""
    final_distance_m: float
    """Distance of the box from the goal at the end [m]."""
    final_orientation_rad: float
    """Absolute orientation error of the box at the end [rad]."""
    contact_fraction: float
    """Fraction of the time that a robot touches the box, averaged over the robots."""
    return_: float
    """Sum of the rewards, not discounted."""


COLUMNS = tuple(name.rstrip("_") for name in EpisodeRow._fields)
"""The columns of an episode row as they are stored."""


class EpisodeMeter:
    """Takes in the records of one episode and sums them up.

    Parameters
    ----------
    phase, episode
        Where the episode stands.
    """

    def __init__(self, phase: str, episode: int) -> None:
        self._phase, self._episode = phase, episode
        self._steps, self._contact, self._return = 0, 0.0, 0.0

    def add(self, transition: Transition) -> None:
        """Take in one step."""
        self._steps += 1
        self._contact += float(np.mean(transition.info["contact_time"]))
        self._return += float(transition.reward)

    def row(self, last: Transition) -> EpisodeRow:
        """Return the measurements of an episode that ended with the transition `last`.

        Raises
        ------
        FloatingPointError
            If one of them is not finite: the trial has come to nothing, and says so.
        """
        row = EpisodeRow(
            phase=self._phase,
            episode=self._episode,
            steps=self._steps,
            success=bool(last.terminated),
            stopped_at_goal=bool(last.info.get("stopped_at_goal", False)),
            final_distance_m=float(last.info["distance_m"]),
            final_orientation_rad=abs(float(last.info["orientation_rad"])),
            contact_fraction=self._contact / self._steps,
            return_=self._return,
        )
        for name, value in zip(COLUMNS[2:], row[2:], strict=True):
            if not isfinite(value):
                where = f"{self._phase} episode {self._episode}"
                raise FloatingPointError(f"{name} = {value} in {where}")
        return row


class Stopwatch:
    """Sums the seconds that the parts of the control loop took."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(("decision", "physics", "sensors", "learning"), 0.0)

    def add(self, record: StepRecord) -> None:
        """Take in one step."""
        spent: Mapping[str, float] = record.transition.info.get("seconds", {})
        self.seconds["decision"] += record.deciding
        self.seconds["physics"] += spent.get("physics", 0.0)
        self.seconds["sensors"] += spent.get("sensors", 0.0)
        self.seconds["learning"] += record.learning


class EpisodeRecorder:
    """Collects the recording of one episode.

    Parameters
    ----------
    opening
        Measurements before the first step.
    """

    def __init__(self, opening: Mapping[str, Any]) -> None:
        self._goal = np.array(opening["goal_pose"], dtype=float)
        self._frames = {name: [np.array(opening[name])] for name in RECORDED}
        self._rewards: list[float] = []

    def add(self, transition: Transition) -> None:
        """Take in one step."""
        for name, frames in self._frames.items():
            frames.append(np.array(transition.info[name]))
        self._rewards.append(float(transition.reward))

    def recording(self, **constants: float | str) -> Recording:
        """Return what was recorded; `constants` are added as arrays of no dimension."""
        arrays = {name: np.stack(frames) for name, frames in self._frames.items()}
        arrays |= {"goal_pose": self._goal, "reward": np.array(self._rewards)}
        return arrays | {name: np.array(value) for name, value in constants.items()}
