"""What fails, how, and from when to when, as it stands in the ``[[scenario.failures]]`` of a spec.

The kinds of failure, `KINDS`, know nothing of what fails. A scenario says under which key its
actuators are named, ``wheels`` or ``joints``, in a model that inherits `FailureSettings`, and
`befalling` joins it with the kinds that can befall them::

    class WheelFailure(FailureSettings):
        part = "wheels"
        wheels: Names

    Failure = Annotated[Union[*befalling(WheelFailure, **KINDS).values()], DISCRIMINATOR]

A failure lies between the command that an actuator gets and the speed that its servo holds, see
`FailureSettings.held`; the agents see the commands, and the failure only in how their bodies move.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, cast

import numpy as np
from numpy.random import Generator
from pydantic import Field, create_model

from ...core.numerics.arrays import FloatArray
from ...core.plugins.scheduled import Scheduled


class FailureSettings(Scheduled):
    """How an actuator fails, and when; see `nested_agents.scenarios.faults.schedule`."""

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
    """It carries out its commands too late; `schedule.Failures` remembers them."""

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
    "seized": Seized,
    "free": Free,
    "weak": Weak,
    "reversed": Reversed,
    "stuck": Stuck,
    "delayed": Delayed,
    "noisy": Noisy,
}
"""The kinds of failure by name."""
DISCRIMINATOR = Field(discriminator="kind")
"""Of a field that holds failures of any of several kinds."""


def befalling(
    naming: type[FailureSettings], **kinds: type[FailureSettings]
) -> dict[str, type[Any]]:
    """Return the settings of failures that befall what `naming` names, by their ``kind``.

    Each inherits its kind and `naming`, and is an attribute of `naming`, by which pickles find it.

    Examples
    --------
    >>> class CartFailure(FailureSettings):
    ...     part = "carts"
    ...     carts: tuple[str, ...]
    >>> befalling(CartFailure, loose=Free)["loose"](carts=("left",))
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
