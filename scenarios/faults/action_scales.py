"""Actions of any Box or Discrete space as numbers along a scale, of which faults know what they do.

Each entry of a Box is an actuator, whose scale is that of the action. Each discrete choice is one,
too: its ``n`` actions are taken to be in order along a scale from -1 to 1, as left, none, right
are. What a fault makes of them may lie between two actions; then one of these is drawn, with the
probabilities whose mean is the place between.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete

from ...core.numerics.arrays import BoolArray, FloatArray, IntArray


class ActionScale:
    """The actuators that an action space has, each with its scale.

    Parameters
    ----------
    space
        The action space: a bounded Box, Discrete or MultiDiscrete.
    rest
        The action in which actuators rest; None: 0 where the scale has it, else its middle.
    said
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
        self, space: gymnasium.Space[Any], rest: Any = None, said: str = "action space"
    ) -> None:
        self.space = space
        self._first: IntArray = np.zeros(1, dtype=np.int64)  # the first action of each choice
        if isinstance(space, Box):
            self._low, self._high = (b.ravel().astype(float) for b in (space.low, space.high))
            if not np.isfinite([self._low, self._high]).all():
                raise ValueError(
                    f"{said} = {space}: faults need finite bounds; "
                    "gymnasium.wrappers.RescaleAction or ClipAction gives them"
                )
            self._counts = np.zeros(self._low.size, dtype=np.int64)
        elif isinstance(space, Discrete | MultiDiscrete):
            counts = space.n if isinstance(space, Discrete) else space.nvec
            self._counts = np.atleast_1d(np.asarray(counts, dtype=np.int64)).ravel()
            self._low, self._high = -np.ones(self._counts.size), np.ones(self._counts.size)
            self._first = np.ravel(space.start)
        else:
            raise ValueError(f"{said} = {space}: allowed: Box, Discrete, MultiDiscrete")
        if rest is None:
            has_zero = (self._low <= 0) & (self._high >= 0)
            self._rest = np.where(has_zero, 0.0, (self._low + self._high) / 2)
        else:
            if not space.contains(rest):
                raise ValueError(f"rest = {rest!r}: no action of {space}")
            self._rest = self._scaled(rest)
        self.limits: FloatArray = np.maximum(self._high - self._rest, self._rest - self._low)

    def __len__(self) -> int:
        """Return the number of actuators."""
        return len(self._counts)

    def place(self, action: Any) -> FloatArray:
        """Return where an action lies from rest, ``(k,)``."""
        return self._scaled(action) - self._rest

    def action(self, place: FloatArray, told: Any, changed: BoolArray, drawn: FloatArray) -> Any:
        """Return the action at a place.

        Parameters
        ----------
        place
            ``(k,)`` from rest; what is out of bounds is cut.
        told
            The action that was chosen; of its entries remain those that are not `changed`.
        changed
            ``(k,)`` which do not.
        drawn
            ``(k,)`` uniform random numbers for what lies between two actions.
        """
        values = np.clip(self._rest + place, self._low, self._high)
        if isinstance(self.space, Box):
            whole = np.issubdtype(self.space.dtype, np.integer)
            found = np.array(told, dtype=self.space.dtype)
            entries = np.rint(values) if whole else values
            found.ravel()[changed] = entries[changed].astype(self.space.dtype)
            return found
        index = (values + 1.0) / 2.0 * (self._counts - 1)
        below = np.floor(index + 1e-12)
        choices = (below + (drawn < index - below)).astype(np.int64)
        choices += self._first
        if isinstance(self.space, Discrete):
            return choices[0] if changed[0] else told
        found = np.array(told, dtype=self.space.dtype)
        found.ravel()[changed] = choices[changed]
        return found

    def _scaled(self, action: Any) -> FloatArray:
        if isinstance(self.space, Box):
            return np.asarray(action, dtype=float).ravel()
        choices = np.asarray(action, dtype=float).ravel() - self._first
        return 2.0 * choices / np.maximum(self._counts - 1, 1) - 1.0
