"""Failures of actuators: their kinds, settings and schedule.

The `KINDS` of failure do not depend on the scenario. A scenario names its actuators (``wheels``,
``joints``) in a model that inherits `FailureSettings`, and `build_kinds` combines that model with
the kinds it supports::

    class WheelFailure(FailureSettings):
        part = "wheels"
        wheels: Names

    Failure = Annotated[Union[*build_kinds(WheelFailure, **KINDS).values()], DISCRIMINATOR]

A failure changes the speed that the servo of an actuator holds for a command, see
`FailureSettings.held`. Agents observe their commands, not the failure. If an actuator has several
failures, delays act first, then the others in the order of the spec.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Generic, Literal, TypeVar, cast

import numpy as np
from numpy.random import Generator
from pydantic import Field, create_model

from ...core.hierarchy.failures import Scheduled
from ...core.numerics import BoolArray, FloatArray, stream_of


class FailureSettings(Scheduled):
    """Settings that all kinds of failure share: a schedule, and a change of held speeds."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the speeds ``(periods, k)`` that the servos of failed actuators hold.

        Parameters
        ----------
        commands
            ``(periods, k)`` commanded speeds.
        limits
            ``(k,)`` maximum speeds.
        rng
            Generator of the noise in every control period.
        """
        return commands


class Seized(FailureSettings):
    """It does not move."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return 0."""
        return np.zeros_like(commands)


class Free(FailureSettings):
    """It has no drive and gives way; the scenario implements this."""


class Weak(FailureSettings):
    """It moves at a fraction of its command."""

    gain: Annotated[float, Field(gt=0, lt=1)] = 0.3
    """Fraction of its command at which it moves."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the gain times the command."""
        return self.gain * commands


class Reversed(FailureSettings):
    """It moves against its command."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the command with its sign changed."""
        return -commands


class Stuck(FailureSettings):
    """It moves at a fixed speed for all commands."""

    speed: Annotated[float, Field(ge=-1, le=1)] = 0.5
    """Speed at which it moves, as a fraction of the maximum."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the fixed speed."""
        return np.broadcast_to(self.speed * limits, commands.shape)


class Delayed(FailureSettings):
    """It executes its commands too late; `Failures` stores them."""

    periods: Annotated[int, Field(ge=1, le=1000)] = 8
    """Delay of commands in control periods."""


class Noisy(FailureSettings):
    """It moves at its command plus noise."""

    deviation: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Standard deviation of the noise, as a fraction of the maximum speed."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the command plus noise, clipped to the maximum speed."""
        noise = self.deviation * limits * rng.standard_normal(commands.shape)
        return np.clip(commands + noise, -limits, limits)


KINDS: Mapping[str, type[FailureSettings]] = {
    kind.__name__.lower(): kind for kind in (Seized, Free, Weak, Reversed, Stuck, Delayed, Noisy)
}
"""The kinds of failure by name."""
DISCRIMINATOR = Field(discriminator="kind")
"""Pydantic field for failures of several kinds."""


def build_kinds(
    naming: type[FailureSettings], **kinds: type[FailureSettings]
) -> dict[str, type[Any]]:
    """Return models of failures of the actuators that `naming` names, by ``kind``.

    Each model inherits its kind and `naming`, and is an attribute of `naming` so that it can be
    pickled.

    Examples
    --------
    >>> class CartFailure(FailureSettings):
    ...     part = "carts"
    ...     carts: tuple[str, ...]
    >>> build_kinds(CartFailure, loose=Free)["loose"](carts=("left",))
    Loose(episode=0, step=0, end_episode=None, end_step=0, carts=('left',), kind='loose')
    >>> CartFailure.Loose.__doc__
    'The cart has no drive and gives way.'
    """
    models = {}
    for kind, base in kinds.items():
        sentence = (base.__doc__ or "").partition(";")[0].rstrip(".")
        model = create_model(
            kind.capitalize(),
            __base__=(base, naming),
            __module__=naming.__module__,
            __doc__=sentence.replace("It", f"The {naming.part.removesuffix('s')}", 1) + ".",
            kind=(cast(Any, Literal[kind]), kind),
        )
        model.__qualname__ = f"{naming.__qualname__}.{model.__name__}"
        setattr(naming, model.__name__, model)
        models[kind] = model
    return models


FailureT = TypeVar("FailureT", bound=FailureSettings)


class Failures(Generic[FailureT]):
    """Scheduled failures of a set of actuators.

    Parameters
    ----------
    settings
        The failures.
    agents
        Names of the ``n`` actuators.
    limits
        ``(n,)`` maximum speed of every actuator.
    key
        Name of the failures in error messages.

    Raises
    ------
    ValueError
        If a failure names an unknown actuator.

    Examples
    --------
    >>> from nested_agents.scenarios.faults.settings import Seized
    >>> class SeizedCart(Seized):
    ...     part = "carts"
    ...     carts: tuple[str, ...]
    >>> failures = Failures([SeizedCart(carts=("left",), step=3)], ("left", "right"), np.ones(2))
    >>> failures.begin(0, episode=0)
    >>> failures.strike(2), failures.strike(3), failures.failed
    (False, True, array([ True, False]))
    >>> failures.driven(np.array([0.1, 0.1]), periods=1)
    array([[0. , 0.1]])
    """

    def __init__(
        self,
        settings: Sequence[FailureT],
        agents: Sequence[str],
        limits: FloatArray,
        key: str = "scenario.failures",
    ) -> None:
        self._settings = tuple(settings)
        self._delays_first = sorted(
            range(len(settings)), key=lambda i: not isinstance(settings[i], Delayed)
        )
        self._limits = limits
        self._masks = [failure.mask(agents, f"{key}[{i}]") for i, failure in enumerate(settings)]
        self._max_delay = max((f.periods for f in settings if isinstance(f, Delayed)), default=0)
        self.begin(0, 0)

    def begin(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Start an episode; each failure draws its noise from its own stream of `seed`."""
        self._streams = [stream_of(seed, i) for i in range(len(self._settings))]
        self._episode = episode
        # Commands of the last control periods, oldest first
        self._commands = np.zeros((self._max_delay, len(self._limits)))
        self._active: tuple[int, ...] = ()
        self.strike(0)

    def strike(self, step: int) -> bool:
        """Start and end the failures that are due at a step; return whether any changed."""
        former = self._active
        self._active = tuple(
            i for i in self._delays_first if self._settings[i].lasts(self._episode, step)
        )
        return self._active != former

    def driven(self, commands: FloatArray, periods: int) -> FloatArray:
        """Return the speeds ``(periods, n)`` that the servos hold.

        Parameters
        ----------
        commands
            ``(n,)`` commanded speeds, held for all periods.
        periods
            Number of control periods; their commands are stored for delays.
        """
        speeds = np.tile(commands, (periods, 1))
        history = np.vstack([self._commands, speeds])
        for i in self._active:
            mask = self._masks[i]
            failure = self._settings[i]
            if isinstance(failure, Delayed):
                first = self._max_delay - failure.periods
                speeds[:, mask] = history[first : first + periods, mask]
            else:
                limits = self._limits[mask]
                stream = self._streams[i]
                speeds[:, mask] = failure.held(speeds[:, mask], limits, stream)
        self._commands = history[len(history) - self._max_delay :]
        return speeds

    def active(self) -> Iterator[tuple[FailureT, BoolArray]]:
        """Yield the active failures, each with the mask ``(n,)`` of its actuators."""
        for i in self._active:
            yield self._settings[i], self._masks[i]

    @property
    def failed(self) -> BoolArray:
        """Whether each actuator has failed ``(n,)``."""
        failed = np.zeros(len(self._limits), dtype=bool)
        for _, mask in self.active():
            failed |= mask
        return failed
