"""State variables by name: what of a situation an agent perceives, beside its own wheel.

A state variable is a function of a `View` and a robot, vectorised over situations; the same
function serves sensing, where there is one situation, and prediction, where there are many. It must
depend on nothing else: ``nested-agents check`` finds out where it means two things. One of your own
is written as the built-in ones are, and a spec names it ``"mine.py:face_bearing"``::

    from nested_agents import View, state_variable

    @state_variable("m", 0.0, 1.5)
    def nearness(view: View, robot: int):
        return view.distance + view.gaps[:, robot]
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....core.arrays import FloatArray
from ....core.registry import Registry
from ....core.spaces import Variable
from .view import View

StateFunction = Callable[[View, int], FloatArray]
"""The values ``(m,)`` of a variable for one robot in the ``m`` situations of a view."""


@dataclass(frozen=True)
class StateVariable:
    """A state variable and how to compute it.

    Attributes
    ----------
    variable
        Its name, unit, range and membership centres.
    function
        ``function(view, robot) -> (m,)``.
    common
        Whether it is the same for all robots.
    """

    variable: Variable
    function: StateFunction
    common: bool = False

    def __call__(self, view: View, robot: int) -> FloatArray:
        """Return the values ``(m,)`` for a robot."""
        return self.function(view, robot)

    def checked(self, view: View, robot: int) -> FloatArray:
        """Return the values ``(m,)`` of a function that is not known to be sound.

        Raises
        ------
        ValueError
            If it returns anything but one finite number per situation.
        """
        found: FloatArray = np.asarray(self.function(view, robot))
        name, m = self.variable.name, len(view.box)
        if found.shape != (m,):
            raise ValueError(f"state variable {name!r}: shape {found.shape}, must be {(m,)}")
        if found.dtype.kind not in "fiu" or not np.isfinite(found).all():
            raise ValueError(f"state variable {name!r}: not all of its values are finite numbers")
        return found


def state_variable(
    unit: str,
    low: float,
    high: float,
    *,
    periodic: bool = False,
    centres: tuple[float, ...] = (),
    labels: tuple[str, ...] = (),
    common: bool = False,
) -> Callable[[StateFunction], StateVariable]:
    """Make a function of a view and a robot a state variable of the function's name.

    Parameters are those of `nested_agents.core.spaces.Variable`, and `common`: whether it is the
    same for all robots, which makes decisions by the values of many agents faster. What the
    function is given is read-only. Built-in variables are compiled for prediction: with one of its
    seven shared variables written as here, the decision of a team of two e-Pucks takes about a
    third longer.

    Examples
    --------
    >>> @state_variable("m", 0.0, 0.5)
    ... def closest(view, robot):
    ...     return view.gaps.min(axis=1)
    >>> closest.variable.name
    'closest'
    """

    def described(function: StateFunction) -> StateVariable:
        name: Any = getattr(function, "__name__", None)
        variable = Variable(name, unit, low, high, periodic, centres, labels)
        return StateVariable(variable, function, common)

    return described


_PLACE = "nested_agents.scenarios.box_pushing.states.relational"

STATE_VARIABLES = Registry(
    "state variable",
    {
        name: f"{_PLACE}:{name}"
        for name in (
            "gap", "box_bearing", "side", "others_gap", "push_bearing", "cross_track_error",
            "box_distance", "approach", "box_turn", "bend", "face_bearing",
            "others_away", "contact_push_bearing", "contact_cross_track_error",
        )
    },
)  # fmt: skip
"""State variables by the name that specs use."""


def found(name: str) -> StateVariable:
    """Return a state variable by name, or by where it is.

    Raises
    ------
    ValueError
        If there is none; one line.
    """
    try:
        thing = STATE_VARIABLES.find(name)
        if not isinstance(thing, StateVariable):
            raise ValueError(f"is no state variable, but a {type(thing).__name__}")
    except ValueError as error:
        raise ValueError(f"scenario.state_space: {name!r}: {error}") from None
    return thing
