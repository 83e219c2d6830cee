"""State spaces and action sets of agents.

A state space has two blocks. The leading *own* variables of an agent depend on the actions of its
own group only, such as the wheels of its robot. The other variables are *shared*: they may depend
on every agent. Own variables take few distinct values over all joint actions, so that kernels
evaluate their part of a rule base once.

Conventions. ``n`` agents, ``d`` state variables, ``A`` actions. A joint action is an integer array
``(n,)`` in agent order. Its *joint-action index* is that array read as a number in base ``A``, the
first agent being the most significant digit; tables of all joint actions are in the order of this
index. Groups are blocks of consecutive agents that move one body (the wheels of a robot); the
digits of one group read as a number are its *robot-action index*.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite
from numbers import Real
from typing import Literal

import numpy as np

from ..numerics import FloatArray, IntArray
from ..plugins.words import expect_each


def real_copy(values: object, what: str, allowed: str = "real numbers") -> FloatArray:
    """Return a copy of real numbers as an array of floats.

    Raises
    ------
    ValueError
        If the values are not real numbers; `what` and `allowed` are parts of the message.
    """
    given = type(values).__name__
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biufO":
            return np.array(array, float)
        given = array.dtype.name
    except (TypeError, ValueError):
        pass
    raise ValueError(f"{what}: {given}, allowed: {allowed}")


FARTHEST = 1000.0
"""Distance from the range of a variable, in widths of the range, that is refused as an error."""


@dataclass(frozen=True)
class Variable:
    """One state variable.

    Raises
    ------
    ValueError
        If the range is empty or not finite, or the centers do not increase within it.
    """

    name: str
    """Short identifier, unique within its state space."""
    unit: str
    """SI unit, ``"1"`` for a pure number."""
    low: float
    """Lower end of the range of the membership functions. Values outside the range are allowed and
    belong to the outermost membership functions."""
    high: float
    """Upper end of the range. For a periodic variable ``high - low`` is the period."""
    periodic: bool = False
    """Whether `low` and `high` are the same point, as for an angle."""
    centers: tuple[float, ...] = ()
    """Default centers of the membership functions, increasing, within the range. If empty, they are
    spaced evenly, see `core.values.partitions.Partition.of`."""
    labels: tuple[str, ...] = ()
    """Words for the membership functions, in the order of `centers`; numbers if empty."""
    mirrored: Literal["same", "opposite"] | None = None
    """Sign in the mirror image of the environment: the ``same`` or ``opposite``; None if unknown.
    See `core.models.predictors`."""
    bounds: tuple[float, float] = field(default=(-inf, inf), compare=False)
    """Values that are possible at all; `check_scenario` refuses others."""

    def __post_init__(self) -> None:
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise ValueError(
                f"variable {self.name!r}: range [{self.low}, {self.high}] must be finite, low first"
            )
        expect_each("numbers", Real, centers=self.centers)
        expect_each("words", str, labels=self.labels)
        ordered = all(a < b for a, b in zip(self.centers, self.centers[1:], strict=False))
        inside = all(self.low <= c <= self.high for c in self.centers)
        if not (ordered and inside):
            raise ValueError(
                f"variable {self.name!r}: centers {self.centers} must increase within "
                f"[{self.low}, {self.high}]"
            )
        if self.labels and len(self.labels) != len(self.centers):
            raise ValueError(
                f"variable {self.name!r}: {len(self.labels)} labels for {len(self.centers)} centers"
            )


def choice(name: str, actions: tuple[str, ...]) -> Variable:
    """Return a variable for the index of an action, with a center at each action."""
    centers = tuple(map(float, range(len(actions))))
    return Variable(name, "1", 0.0, centers[-1], centers=centers, labels=actions)


@dataclass(frozen=True)
class StateSpace:
    """The state variables of an agent, own block first.

    Examples
    --------
    >>> space = StateSpace("demo", (Variable("speed", "m/s", -1, 1), Variable("gap", "m", 0, 2)), 1)
    >>> space.n_variables, [v.name for v in space.shared]
    (2, ['gap'])
    >>> print(space)
    demo: own variables, then shared ones
      own     speed [m/s]  -1 to 1
      shared  gap [m]  0 to 2
    """

    name: str
    """Name in specs."""
    variables: tuple[Variable, ...]
    """The variables, own variables first."""
    n_own: int = 0
    """Number of own variables, which depend on the actions of the agent's own group only."""
    common: tuple[str, ...] = ()
    """Names of shared variables that are equal for all agents, so that a team evaluates them
    once."""
    actions: tuple[str, ...] = ()
    """Names of variables that are actions, of the agent or of others, with one membership function
    for each action."""

    def __post_init__(self) -> None:
        names = [v.name for v in self.variables]
        if not names or len(set(names)) != len(names):
            raise ValueError(f"state space {self.name!r}: variable names {names} must be distinct")
        if not 0 <= self.n_own <= len(names):
            raise ValueError(
                f"state space {self.name!r}: n_own = {self.n_own}, allowed 0 to {len(names)}"
            )
        for name in self.common:
            if name not in names[self.n_own :]:
                raise ValueError(
                    f"state space {self.name!r}: common variable {name!r} is none of the shared"
                )
        for name in self.actions:
            if name not in names:
                raise ValueError(f"state space {self.name!r}: action {name!r} is no variable")

    def __str__(self) -> str:
        lines = [f"{self.name}: own variables, then shared ones"]
        for k, v in enumerate(self.variables):
            kind = "own" if k < self.n_own else "shared"
            lines.append(f"  {kind:<6}  {v.name} [{v.unit}]  {v.low:.3g} to {v.high:.3g}")
        return "\n".join(lines)

    def checked(self, states: FloatArray, agents: Sequence[str]) -> FloatArray:
        """Return a checked copy of the states of agents.

        Raises
        ------
        ValueError
            If they are not finite real numbers of shape ``(n, d)``, or a value is farther from its
            range than `FARTHEST` widths of the range; the first wrong value is named.
        """
        wanted = len(agents), self.n_variables
        array = real_copy(states, "states of agents", f"real numbers of shape {wanted}")
        if array.shape != wanted:
            given = f"shape {array.shape}" if array.ndim == 2 else type(states).__name__
            raise ValueError(f"states of agents: {given}, allowed: real numbers of shape {wanted}")
        low, width = self.ranges
        near = np.abs((array - low) / width) <= FARTHEST
        if not near.all():
            agent, variable = np.argwhere(~near)[0]
            v = self.variables[variable]
            raise ValueError(
                f"{v.name} of {agents[agent]} is {array[agent, variable]:.6g}, "
                f"allowed: finite, and at most {FARTHEST:g} times its range from {v.low:g}"
            )
        return array

    @cached_property
    def ranges(self) -> tuple[FloatArray, FloatArray]:
        """Lower ends ``(d,)`` and widths ``(d,)`` of the ranges of all variables."""
        low, high = np.array([(v.low, v.high) for v in self.variables]).T
        return low, high - low

    @property
    def bounds(self) -> FloatArray:
        """``(d, 2)`` bounds of the states: the period of periodic variables, else `bounds`."""
        return np.array([(v.low, v.high) if v.periodic else v.bounds for v in self.variables])

    @property
    def n_variables(self) -> int:
        """Number of state variables d."""
        return len(self.variables)

    @property
    def own(self) -> tuple[Variable, ...]:
        """Variables that depend on the agent's own group only."""
        return self.variables[: self.n_own]

    @property
    def shared(self) -> tuple[Variable, ...]:
        """Variables that may depend on every agent."""
        return self.variables[self.n_own :]


@dataclass(frozen=True)
class ActionSet:
    """Actions of every agent, and their effect on its commanded speed.

    Action ``a`` turns the commanded speed ``u`` into
    ``clip(gain[a] * u + increment[a] * unit, -limit, limit)``. Unit and limit belong to the
    scenario. The paper's four (Section V) are increase, decrease, maintain and make zero.
    """

    names: tuple[str, ...] = ("increase", "decrease", "maintain", "zero")
    gains: tuple[float, ...] = (1.0, 1.0, 1.0, 0.0)
    increments: tuple[float, ...] = (1.0, -1.0, 0.0, 0.0)
    neutral: int = field(default=2)
    """Action that is assumed of unseen agents, by default maintain."""

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.gains) == len(self.increments):
            raise ValueError("action set: names, gains and increments must have equal lengths")
        if not 0 <= self.neutral < len(self.names):
            raise ValueError(f"action set: neutral = {self.neutral} names no action")

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def _arrays(self) -> tuple[FloatArray, FloatArray]:
        """`gains` and `increments`."""
        return np.asarray(self.gains), np.asarray(self.increments)

    def apply(
        self, speeds: FloatArray, actions: IntArray, unit: FloatArray, limit: FloatArray
    ) -> FloatArray:
        """Return the commanded speeds ``(..., n)`` after `actions` ``(..., n)``.

        Parameters
        ----------
        speeds
            ``(n,)`` commanded speeds before.
        actions
            Action indices.
        unit, limit
            ``(n,)`` size of an increment, and maximum speed.

        Examples
        --------
        >>> ActionSet().apply(np.array([0.5, 0.1]), np.array([0, 3]), np.ones(2), np.ones(2))
        array([1., 0.])
        """
        gains, increments = self._arrays
        wanted = gains[actions] * speeds + increments[actions] * unit
        return np.minimum(np.maximum(wanted, -limit), limit)
