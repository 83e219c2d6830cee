"""What fails, how, and from when to when, as it stands in the ``[[scenario.failures]]`` of a spec.

The kinds of failure, `KINDS`, know nothing of what fails. A scenario says under which key its
actuators are named, ``wheels`` or ``joints``, in a model that inherits `FailureSettings`, and
`build_kinds` joins it with the kinds that can befall them::

    class WheelFailure(FailureSettings):
        part = "wheels"
        wheels: Names

    Failure = Annotated[Union[*build_kinds(WheelFailure, **KINDS).values()], DISCRIMINATOR]

A failure lies between the command that an actuator gets and the speed that its servo holds, see
`FailureSettings.held`; the agents see the commands, and the failure only in how their bodies move.

`Failures` schedules what an actuator does instead of its command. Of several failures of an
actuator delays act first, then the others in the order of the spec, each on what the one before it
holds, see `FailureSettings.held`. A world without failures never comes here.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Generic, Literal, TypeVar, cast

import numpy as np
from numpy.random import Generator
from pydantic import Field, create_model

from ...core.hierarchy.failures import Scheduled
from ...core.numerics import BoolArray, FloatArray, stream_of


class FailureSettings(Scheduled):
    """How an actuator fails, and when; see `nested_agents.scenarios.faults.settings`."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the speeds ``(periods, k)`` that the servos of what fails hold.

        Parameters
        ----------
        commands
            ``(periods, k)`` commanded speeds.
        limits
            ``(k,)`` their greatest speeds.
        rng
            For noise, drawn anew every control period.
        """
        return commands


class Seized(FailureSettings):
    """It does not move."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return 0."""
        return np.zeros_like(commands)


class Free(FailureSettings):
    """It has no drive and gives way; what that does is the scenario's own business."""


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
    """It moves at one speed whatever its command."""

    speed: Annotated[float, Field(ge=-1, le=1)] = 0.5
    """Speed at which it moves, as a fraction of the greatest."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the one speed."""
        return np.broadcast_to(self.speed * limits, commands.shape)


class Delayed(FailureSettings):
    """It carries out its commands too late; `Failures` remembers them."""

    periods: Annotated[int, Field(ge=1, le=1000)] = 8
    """Control periods by which commands are late."""


class Noisy(FailureSettings):
    """It moves at its command plus noise."""

    deviation: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Standard deviation of the noise, as a fraction of the greatest speed."""

    def held(self, commands: FloatArray, limits: FloatArray, rng: Generator) -> FloatArray:
        """Return the command plus noise, cut to the greatest speed either way."""
        noise = self.deviation * limits * rng.standard_normal(commands.shape)
        return np.clip(commands + noise, -limits, limits)


KINDS: Mapping[str, type[FailureSettings]] = {
    kind.__name__.lower(): kind for kind in (Seized, Free, Weak, Reversed, Stuck, Delayed, Noisy)
}
"""The kinds of failure by name."""
DISCRIMINATOR = Field(discriminator="kind")
"""Of a field that holds failures of any of several kinds."""


def build_kinds(
    naming: type[FailureSettings], **kinds: type[FailureSettings]
) -> dict[str, type[Any]]:
    """Return the settings of failures that befall what `naming` names, by their ``kind``.

    Each inherits its kind and `naming`, and is an attribute of `naming`, by which pickles find it.

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
    """The failures that a spec schedules, and the actuators under them.

    Parameters
    ----------
    settings
        The failures.
    agents
        Names of the ``n`` actuators.
    limits
        ``(n,)`` greatest speed of every actuator, in units of its speed.
    key
        What the failures are called in complaints.

    Raises
    ------
    ValueError
        If a failure names an actuator that there is not.

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
        self._memory = max((f.periods for f in settings if isinstance(f, Delayed)), default=0)
        self.begin(0, 0)

    def begin(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Start an episode; its noise follows from `seed`, a stream to every failure."""
        self._streams = [stream_of(seed, i) for i in range(len(self._settings))]
        self._episode = episode
        # Commands of the last control periods, the oldest first.
        self._commands = np.zeros((self._memory, len(self._limits)))
        self._active: tuple[int, ...] = ()
        self.strike(0)

    def strike(self, step: int) -> bool:
        """Let begin and end what is due at a step; return whether anything changed."""
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
            Control periods; they are remembered as past.
        """
        speeds = np.tile(commands, (periods, 1))
        remembered = np.vstack([self._commands, speeds])
        for i in self._active:
            mask = self._masks[i]
            failure = self._settings[i]
            if isinstance(failure, Delayed):
                first = self._memory - failure.periods
                speeds[:, mask] = remembered[first : first + periods, mask]
            else:
                limits = self._limits[mask]
                stream = self._streams[i]
                speeds[:, mask] = failure.held(speeds[:, mask], limits, stream)
        self._commands = remembered[len(remembered) - self._memory :]
        return speeds

    def active(self) -> Iterator[tuple[FailureT, BoolArray]]:
        """Yield the failures that are on, each with the mask ``(n,)`` of what it has befallen."""
        for i in self._active:
            yield self._settings[i], self._masks[i]

    @property
    def failed(self) -> BoolArray:
        """Whether each actuator is under a failure now, ``(n,)``."""
        failed = np.zeros(len(self._limits), dtype=bool)
        for _, mask in self.active():
            failed |= mask
        return failed
