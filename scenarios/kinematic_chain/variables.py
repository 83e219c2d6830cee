"""State variables by name: what a joint perceives beside its own speed.

A state variable is a function of a `ChainView` and the number of a joint from 0, see
`nested_agents.scenarios.state_variables`. One of your own is written as the built-in ones are, and
a spec names it ``"mine.py:height"``::

    from nested_agents import ChainView, state_variable

    @state_variable("m", -1.0, 1.0)
    def height(view: ChainView, joint: int):
        return view.places[:, joint, 1]
"""

from collections.abc import Sequence

import numpy as np

from ...core.interface.spaces import Variable
from ...core.numerics.arrays import FloatArray
from ...core.plugins.registry import Registry
from ..state_variables import filled, find_variable, space_of
from .relational import COMPILED, columns
from .view import ChainView

_PLACE = "nested_agents.scenarios.kinematic_chain.relational"

CHAIN_VARIABLES = Registry("chain variable", {name: f"{_PLACE}:{name}" for name in COMPILED})
"""State variables by the name that specs use."""

SPEEDS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Centres of the own speed, as a fraction of the greatest: arms of any length share it."""
SPEED = Variable("speed", "1", -1.0, 1.0, centres=SPEEDS, mirrored="opposite")


class ChainStates:
    """The states of joints: the own speed, and variables in the order in which they are listed.

    Parameters
    ----------
    names
        Of the variables, see `CHAIN_VARIABLES`. The compiled ones are trusted; what functions of
        users return is checked.

    Raises
    ------
    ValueError
        If one is unknown or named twice, or there is none; one line.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._things = [find_variable(CHAIN_VARIABLES, name) for name in names]
        self.space = space_of("+".join(names), SPEED, self._things)
        # Beyond the last of the compiled columns: the column is none of these.
        rows = [COMPILED.index(name) if name in COMPILED else len(COMPILED) for name in names]
        self._rows = np.array([-1, *rows])

    def of_joints(self, view: ChainView, first: int, count: int) -> FloatArray:
        """Return the states ``(count, m, d)`` of joints from `first` on, compiled if possible."""
        states: FloatArray = columns(
            view.places, view.angles, view.speeds, view.goal, view.before, first, count, self._rows
        )
        filled(states[:, :, 1:], self._things, view, range(first, first + count))
        return states
