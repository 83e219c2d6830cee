"""The present, as far as predictions of the push need it."""

from __future__ import annotations

from dataclasses import dataclass

from ....core.arrays import FloatArray


@dataclass(frozen=True)
class Situation:
    """The present, as far as prediction needs it.

    Attributes
    ----------
    robots, box, goal
        Poses ``(M, 3)``, ``(3,)``, ``(3,)``.
    speeds
        ``(n,)`` commanded wheel speeds [m/s].
    effects
        Per robot ``(3, w + 1)``: twist in its frame = effect @ [wheel speeds, 1].
    groups
        Agents of each robot.
    """

    robots: FloatArray
    box: FloatArray
    goal: FloatArray
    speeds: FloatArray
    effects: tuple[FloatArray, ...]
    groups: tuple[tuple[int, ...], ...]
