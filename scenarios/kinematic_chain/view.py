"""What state variables are computed from: postures of the arm and the goal, many at once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.numerics.arrays import FloatArray
from ..state_variables import fixed


@dataclass(frozen=True)
class ChainView:
    """Situations to be described, ``m`` at once."""

    places: FloatArray
    """``(m, n + 1, 2)`` the joints from the base on, and the tip [m]."""
    angles: FloatArray
    """``(m, n)`` joint angles [rad]."""
    speeds: FloatArray
    """``(m, n)`` commanded speeds of the joints, as fractions of the greatest."""
    goal: FloatArray
    """``(2,)`` where the tip is to be [m]."""
    before: float
    """Distance of the tip from the goal before the decision that led here [m]."""

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
        return fixed(np.hypot(*(self.goal - self.tip).T))

    @property
    def approach(self) -> FloatArray:
        """How much nearer ``(m,)`` the tip has come to the goal in the decision [m]."""
        return self.before - self.distance
