"""What state variables are computed from: postures of the arm and the goal, many at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.numerics.arrays import FloatArray


@dataclass(frozen=True)
class ChainView:
    """Situations to be described, ``m`` at once.

    Attributes
    ----------
    places
        ``(m, n + 1, 2)`` the joints from the base on, and the tip [m].
    angles
        ``(m, n)`` joint angles [rad].
    speeds
        ``(m, n)`` commanded speeds of the joints, as fractions of the greatest.
    goal
        ``(2,)`` where the tip is to be [m].
    before
        Distance of the tip from the goal before the decision that led here [m].
    """

    places: FloatArray
    angles: FloatArray
    speeds: FloatArray
    goal: FloatArray
    before: float

    @property
    def n_situations(self) -> int:
        """How many situations there are."""
        return len(self.places)

    @property
    def tip(self) -> FloatArray:
        """The tip ``(m, 2)`` [m]."""
        return self.places[:, -1]

    @cached_property
    def distance(self) -> FloatArray:
        """Distance ``(m,)`` of the tip from the goal [m]."""
        return _fixed(np.hypot(*(self.goal - self.tip).T))

    @property
    def approach(self) -> FloatArray:
        """How much nearer ``(m,)`` the tip has come to the goal in the decision [m]."""
        return self.before - self.distance

    def guarded(self) -> ChainView:
        """Return the same situations, not to be written to."""
        places, angles, speeds, goal = (
            _fixed(array.view()) for array in (self.places, self.angles, self.speeds, self.goal)
        )
        return ChainView(places, angles, speeds, goal, self.before)


def _fixed(array: FloatArray) -> FloatArray:
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array
