"""Actions of any Box or Discrete space as numbers along a scale, of which faults know what they do.

Each entry of a Box is an actuator, whose scale is that of the action. Each discrete choice is one,
too: its actions are taken to be in order along a scale, as left, none, right are, with rest in the
middle. What a fault makes of them may lie between two actions; then one of these is drawn, with the
probabilities whose mean is the place between.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete

from ...core.numerics.arrays import BoolArray, FloatArray


def limits_of(space: gymnasium.Space[Any], name: str) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest value ``(k,)`` of each entry of a space's actions.

    Raises
    ------
    ValueError
        If the space, called by its name, is of another kind or is not bounded; one line.
    """
    if isinstance(space, Box) and space.is_bounded():
        return space.low.ravel(), space.high.ravel()
    if isinstance(space, Discrete | MultiDiscrete):
        counts = space.n if isinstance(space, Discrete) else space.nvec
        return np.ravel(space.start), np.ravel(space.start) + np.ravel(counts) - 1
    raise ValueError(
        f"{name}: {space}, allowed: Box, Discrete or MultiDiscrete, of finite bounds; where it has "
        "none, wrap it in RescaleAction or ClipAction"
    )


class ActionScale:
    """The actuators that an action space has, each with its scale.

    Parameters
    ----------
    space
        The action space: a bounded Box, Discrete or MultiDiscrete.
    rest
        The action in which actuators rest; None: 0 where a Box has it, else the middle.
    name
        What the space is called in complaints.

    Attributes
    ----------
    limits
        ``(k,)`` how far from rest each scale reaches.

    Raises
    ------
    ValueError
        If the space is of another kind, is not bounded or does not hold `rest`; one line.

    Examples
    --------
    >>> scale = ActionScale(Discrete(3))
    >>> [float(scale.place(action)[0]) for action in range(3)]
    [-1.0, 0.0, 1.0]
    >>> int(scale.action(np.array([-0.2]), 2, np.array([True]), np.array([0.1])))
    1
    """

    def __init__(
        self, space: gymnasium.Space[Any], rest: Any = None, name: str = "action space"
    ) -> None:
        self.space = space
        self._low, self._high = (ends.astype(float) for ends in limits_of(space, name))
        if rest is None:
            has_zero = isinstance(space, Box) & (self._low <= 0) & (self._high >= 0)
            self._rest = np.where(has_zero, 0.0, (self._low + self._high) / 2)
        elif space.contains(rest):
            self._rest = np.ravel(rest).astype(float)
        else:
            raise ValueError(f"rest = {rest!r}: no action of {space}")
        self.limits: FloatArray = np.maximum(self._high - self._rest, self._rest - self._low)

    def __len__(self) -> int:
        """Return the number of actuators."""
        return len(self.limits)

    def place(self, action: Any) -> FloatArray:
        """Return where an action lies from rest, ``(k,)``."""
        return np.ravel(action).astype(float) - self._rest

    def action(self, place: FloatArray, chosen: Any, changed: BoolArray, drawn: FloatArray) -> Any:
        """Return the action at a place.

        Parameters
        ----------
        place
            ``(k,)`` from rest; what is out of bounds is cut.
        chosen
            The action that was chosen; of its entries remain those that are not `changed`.
        changed
            ``(k,)`` which do not.
        drawn
            ``(k,)`` uniform random numbers for what lies between two actions.
        """
        if not changed.any():
            return chosen
        values = np.clip(self._rest + place, self._low, self._high)
        if not isinstance(self.space, Box):
            below = np.floor(values + 1e-12)
            values = below + (drawn < values - below)
        elif np.issubdtype(self.space.dtype, np.integer):
            values = np.rint(values)
        action = np.array(chosen, dtype=self.space.dtype)
        action.ravel()[changed] = values[changed].astype(action.dtype)
        return action[()]  # a number, not an array, of Discrete
