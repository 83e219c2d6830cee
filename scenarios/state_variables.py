"""State variables by name, for any scenario.

A state variable is a function of a view of the scenario and of the index of a body (a robot, a
joint), vectorized over the situations in the view. The same function serves sensing, with one
situation, and prediction, with many. It must not depend on anything else, which ``nested-agents
check`` verifies. Each scenario defines its view and a registry of its built-in variables.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import BeforeValidator

from ..core.interface.spaces import StateSpace, Variable
from ..core.numerics import FloatArray
from ..core.plugins.registry import Registry

StateFunction = Callable[[Any, Any], Any]
"""A function of a scenario's situation and of a body; what it returns is the scenario's business:
values ``(m,)`` in ``m`` situations, or one number if it is compiled."""


ViewT = TypeVar("ViewT")


@dataclass(frozen=True)
class StateVariable:
    """A state variable and the function that computes it."""

    variable: Variable
    """Name, unit, range and centers of membership functions."""
    function: StateFunction
    """``function(view, body) -> (m,)``."""
    common: bool = False
    """Whether it is the same for all bodies."""
    trusted: bool = False
    """Whether it is built in, so that its values are not checked."""

    def checked(self, returned: object, m: int) -> FloatArray:
        """Return the values that a user's function gave for ``m`` situations.

        Raises
        ------
        ValueError
            If they are anything but a finite number per situation.
        """
        values = np.asarray(returned)
        name = self.variable.name
        if values.shape != (m,):
            raise ValueError(
                f"state variable {name!r}: shape {values.shape}, must be {(m,)}: one value for "
                "each situation; fields are arrays, so use numpy.where instead of if"
            )
        if values.dtype.kind not in "fiu" or not np.isfinite(values).all():
            raise ValueError(f"state variable {name!r}: not all of its values are finite numbers")
        return values


def space_of(name: str, own: Variable, things: Sequence[StateVariable]) -> StateSpace:
    """Return the state space of the body's own variable followed by other variables.

    Raises
    ------
    ValueError
        If there are no other variables, or a variable is repeated.
    """
    variables = (own, *(thing.variable for thing in things))
    names = [variable.name for variable in variables]
    if len(names) < 2 or len(set(names)) < len(names):
        raise ValueError(
            f"scenario.state_space = {names[1:]}: variables must be distinct and at least one"
        )
    common = tuple(thing.variable.name for thing in things if thing.common)
    return StateSpace(name, variables, 1, common)


def freeze(array: FloatArray) -> FloatArray:
    """Make an array read-only and return it."""
    array.flags.writeable = False
    return array


def guard(view: ViewT) -> ViewT:
    """Return a copy of a dataclass with read-only arrays."""
    held = vars(view).items()
    arrays = {k: freeze(v.view()) for k, v in held if isinstance(v, np.ndarray)}
    guarded = copy(view)
    vars(guarded).update(arrays)
    return guarded


def state_variable(
    unit: str,
    low: float,
    high: float,
    *,
    periodic: bool = False,
    centers: tuple[float, ...] = (),
    labels: tuple[str, ...] = (),
    common: bool = False,
    mirrored: Literal["same", "opposite"] | None = None,
) -> Callable[[StateFunction], StateVariable]:
    """Decorate a function of a view and a body as a state variable with the function's name.

    Parameters
    ----------
    unit, low, high, periodic, centers, labels
        See `Variable`.
    common
        Whether the variable is the same for all bodies, which makes decisions faster.
    mirrored
        Value in the mirror image of the scenario: the ``same``, or of ``opposite`` sign. Required
        for ``learner.mirrored``.

    Examples
    --------
    >>> @state_variable("m", 0.0, 0.5)
    ... def nearness(situation, robot):
    ...     return situation.distance + robot.gap
    >>> nearness.variable.name
    'nearness'
    """

    def describe(function: StateFunction) -> StateVariable:
        variable = Variable(function.__name__, unit, low, high, periodic, centers, labels, mirrored)
        return StateVariable(variable, function, common)

    return describe


def find_variable(registry: Registry, name: str) -> StateVariable:
    """Return a state variable by its registered name or by ``"file.py:name"``.

    Built-in variables are marked as trusted: their values are not checked.

    Raises
    ------
    ValueError
        If there is no such variable, or the name refers to something else.
    """
    try:
        thing = registry.find(name)
        if not isinstance(thing, StateVariable):
            raise ValueError(f"is of type {type(thing).__name__}, allowed: state variable")
    except ValueError as error:
        raise ValueError(f"scenario.state_space: {name!r}: {error}") from None
    return replace(thing, trusted=name in registry.built_in)


def names_of(registry: Registry) -> BeforeValidator:
    """Return a pydantic validator that replaces state variables in a list by their names."""

    def named(given: object) -> object:
        if not isinstance(given, list | tuple):
            return given
        return tuple(registry.reference_to(v) if isinstance(v, StateVariable) else v for v in given)

    return BeforeValidator(named)
