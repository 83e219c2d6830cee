"""State variables by name: functions of what is seen, whatever the scenario.

A state variable is a function of a view and of the number of a body (a robot, a joint), vectorised
over the situations that the view holds; the same function serves sensing, where there is one
situation, and prediction, where there are many. It must depend on nothing else: ``nested-agents
check`` finds out where it means two things. What a view is, and which variables are built in, is
the scenario's business: each has a registry and a view of its own.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import BeforeValidator

from ..core.interface.spaces import StateSpace, Variable
from ..core.numerics import FloatArray
from ..core.plugins.registry import Registry

StateFunction = Callable[[Any, Any], Any]
"""A function of a scenario's situation and of a body; what it returns is the scenario's business:
values ``(m,)`` in ``m`` situations, or one number if it is compiled."""


@dataclass(frozen=True)
class Situations(ABC):
    """Situations to be described, ``m`` at once: what the view of a scenario inherits."""

    @property
    @abstractmethod
    def n_situations(self) -> int:
        """How many situations there are."""


SituationsT = TypeVar("SituationsT", bound=Situations)


@dataclass(frozen=True)
class StateVariable:
    """A state variable and how to compute it."""

    variable: Variable
    """Its name, unit, range and membership centres."""
    function: StateFunction
    """``function(view, body) -> (m,)``."""
    common: bool = False
    """Whether it is the same for all bodies."""
    trusted: bool = False
    """Whether it is a built-in one, whose values are not checked."""

    def __call__(self, view: Situations, body: int) -> FloatArray:
        """Return the values ``(m,)`` for a body.

        Raises
        ------
        ValueError
            If a function that is not trusted returns anything but a finite number per situation.
        """
        values: FloatArray = self.function(view, body)
        return values if self.trusted else self.checked(values, view.n_situations)

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
                "each situation of the view"
            )
        if values.dtype.kind not in "fiu" or not np.isfinite(values).all():
            raise ValueError(f"state variable {name!r}: not all of its values are finite numbers")
        return values


def space_of(name: str, own: Variable, things: Sequence[StateVariable]) -> StateSpace:
    """Return the state space of an own variable and what is perceived beside it.

    Raises
    ------
    ValueError
        If that is nothing, or a variable occurs twice.
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
    """Make an array read-only, and return it."""
    array.flags.writeable = False
    return array


def guard(view: SituationsT) -> SituationsT:
    """Return a view of the same situations whose arrays cannot be written to."""
    held = {field.name: vars(view)[field.name] for field in fields(view)}
    arrays = {k: freeze(v.view()) for k, v in held.items() if isinstance(v, np.ndarray)}
    return replace(view, **arrays)


def sense(
    parts: Sequence[StateVariable],
    view: Situations,
    bodies: Sequence[int],
    done: FloatArray | None = None,
) -> FloatArray:
    """Return state variables ``(len(bodies), m, variables)`` of bodies.

    By the functions alone, and those that are the same for all bodies are computed once. Or, if
    compiled ones are `done`, with those of users filled in: then every body is asked, so that a
    check of the scenario finds what is wrongly called common.
    """
    once = done is None
    shape = (len(bodies), view.n_situations, len(parts))
    values = np.empty(shape) if done is None else done
    wanted = [(c, thing) for c, thing in enumerate(parts) if once or not thing.trusted]
    safe = view if all(thing.trusted for _, thing in wanted) else guard(view)
    for column, thing in wanted:
        for k, body in enumerate(bodies):
            known = once and k > 0 and thing.common
            values[k, :, column] = values[0, :, column] if known else thing(safe, body)
    return values


def state_variable(
    unit: str,
    low: float,
    high: float,
    *,
    periodic: bool = False,
    centres: tuple[float, ...] = (),
    labels: tuple[str, ...] = (),
    common: bool = False,
    mirrored: Literal["same", "opposite"] | None = None,
) -> Callable[[StateFunction], StateVariable]:
    """Make a function of a view and a body a state variable of the function's name.

    Parameters are those of `Variable`, and `common`: whether it is the
    same for all bodies, which makes sensing and decisions by the values of many agents faster. What
    the function is given is read-only. A variable that says what it is in the mirror image of the
    world, the ``same`` or of ``opposite`` sign, can be used with ``learner.mirrored``.

    Examples
    --------
    >>> @state_variable("m", 0.0, 0.5)
    ... def nearness(situation, robot):
    ...     return situation.distance + robot.gap
    >>> nearness.variable.name
    'nearness'
    """

    def describe(function: StateFunction) -> StateVariable:
        variable = Variable(function.__name__, unit, low, high, periodic, centres, labels, mirrored)
        return StateVariable(variable, function, common)

    return describe


def find_variable(registry: Registry, name: str) -> StateVariable:
    """Return a state variable of a registry by name, or by where it is.

    Raises
    ------
    ValueError
        If there is none; one line.
    """
    try:
        thing = registry.find(name)
        if not isinstance(thing, StateVariable):
            raise ValueError(f"is no state variable, but a {type(thing).__name__}")
    except ValueError as error:
        raise ValueError(f"scenario.state_space: {name!r}: {error}") from None
    return replace(thing, trusted=name in registry.built_in)


def names_of(registry: Registry) -> BeforeValidator:
    """Return what replaces state variables of a registry by their names, in a list of both."""

    def named(given: object) -> object:
        if not isinstance(given, list | tuple):
            return given
        return tuple(registry.reference_to(v) if isinstance(v, StateVariable) else v for v in given)

    return BeforeValidator(named)
