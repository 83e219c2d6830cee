"""Failures of actuators: their kinds, settings and schedule.

The `EFFECTS` of failures do not depend on the scenario. A scenario names its actuators (``wheels``,
``joints``) in a model that inherits `FailureSettings`, and `build_kinds` extends that model to each
kind that it supports::

    class WheelFailure(FailureSettings):
        part = "wheels"
        wheels: Names

    Failure = Annotated[Union[*build_kinds(WheelFailure).values()], DISCRIMINATOR]

A failure changes the speed that the servo of an actuator holds for a command, see
`held_speeds`. Agents observe their commands, not the failure. If an actuator has several
failures, delays act first, then the others in the order of the spec.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, cast

import numpy as np
from numpy.random import Generator
from pydantic import Field, create_model

from ...core.hierarchy.failures import Scheduled
from ...core.numerics import BoolArray, FloatArray, stream_of


def _parameter(default: float, text: str, **bounds: float) -> tuple[Any, object]:
    """Return type and default of a setting for pydantic."""
    return Annotated[type(default), Field(**cast(Any, bounds))], Field(default, description=text)


class FailureSettings(Scheduled):
    """Settings that all kinds of failure share: a schedule."""

    effect: ClassVar[str] = ""
    """What the actuators do, a key of `EFFECTS`."""


Parameters = Mapping[str, tuple[Any, object]]
"""Type and default of settings by name."""

EFFECTS: Mapping[str, tuple[str, Parameters]] = {
    "seized": ("does not move", {}),
    "free": ("has no drive and gives way", {}),
    "weak": (
        "moves at a fraction of its command",
        {"gain": _parameter(0.3, "Fraction of its command at which it moves.", gt=0, lt=1)},
    ),
    "reversed": ("moves against its command", {}),
    "stuck": (
        "moves at a fixed speed for all commands",
        {
            "speed": _parameter(
                0.5, "Speed at which it moves, as a fraction of the maximum.", ge=-1, le=1
            )
        },
    ),
    "delayed": (
        "executes its commands too late",
        {"periods": _parameter(8, "Delay of commands in control periods.", ge=1, le=1000)},
    ),
    "noisy": (
        "moves at its command plus noise",
        {
            "deviation": _parameter(
                0.3,
                "Standard deviation of the noise, as a fraction of the maximum speed.",
                gt=0,
                le=1,
            )
        },
    ),
}
"""What actuators of each kind of failure do, and the settings of that kind."""
DISCRIMINATOR = Field(discriminator="kind")
"""Pydantic field for failures of several kinds."""


def held_speeds(
    failure: FailureSettings, commands: FloatArray, limits: FloatArray, rng: Generator
) -> FloatArray:
    """Return the speeds ``(periods, k)`` that the servos of failed actuators hold.

    Delays and actuators without a drive, which keep their commands here, are implemented by
    `Failures` and by the scenario.

    Parameters
    ----------
    failure
        The failure.
    commands
        ``(periods, k)`` commanded speeds.
    limits
        ``(k,)`` maximum speeds.
    rng
        Generator of the noise in every control period.
    """
    values = dict(failure)
    match failure.effect:
        case "seized":
            return np.zeros_like(commands)
        case "weak":
            return values["gain"] * commands
        case "reversed":
            return -commands
        case "stuck":
            return np.broadcast_to(values["speed"] * limits, commands.shape)
        case "noisy":
            noise = values["deviation"] * limits * rng.standard_normal(commands.shape)
            return np.clip(commands + noise, -limits, limits)
    return commands


def build_kinds(naming: type[FailureSettings], **effects: str) -> dict[str, type[Any]]:
    """Return models of failures of the actuators that `naming` names, by ``kind``.

    Each model inherits `naming`, and is an attribute of `naming` so that it can be pickled. By
    default, the kinds are the effects.

    Examples
    --------
    >>> class CartFailure(FailureSettings):
    ...     part = "carts"
    ...     carts: tuple[str, ...]
    >>> build_kinds(CartFailure, loose="free")["loose"](carts=("left",))
    Loose(episode=0, step=0, end_episode=None, end_step=0, carts=('left',), kind='loose')
    >>> CartFailure.Loose.__doc__
    'The cart has no drive and gives way.'
    """
    models = {}
    for kind, effect in (effects or dict.fromkeys(EFFECTS)).items():
        sentence, parameters = EFFECTS[effect or kind]
        model: type[Any] = create_model(
            kind.capitalize(),
            __base__=naming,
            __module__=naming.__module__,
            __doc__=f"The {naming.part.removesuffix('s')} {sentence}.",
            **cast(Any, {**parameters, "kind": (Literal[kind], kind)}),
        )
        model.__qualname__ = f"{naming.__qualname__}.{model.__name__}"
        model.effect = effect or kind
        setattr(naming, model.__name__, model)
        models[kind] = model
    return models


class Failures:
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
    >>> class CartFailure(FailureSettings):
    ...     part = "carts"
    ...     carts: tuple[str, ...]
    >>> seized = build_kinds(CartFailure)["seized"](carts=("left",), step=3)
    >>> failures = Failures([seized], ("left", "right"), np.ones(2))
    >>> failures.begin(0, episode=0)
    >>> failures.strike(2), failures.strike(3), failures.failed
    (False, True, array([ True, False]))
    >>> failures.driven(np.array([0.1, 0.1]), periods=1)
    array([[0. , 0.1]])
    """

    def __init__(
        self,
        settings: Sequence[FailureSettings],
        agents: Sequence[str],
        limits: FloatArray,
        key: str = "scenario.failures",
    ) -> None:
        self.settings = tuple(settings)
        delays = {i: dict(f)["periods"] for i, f in enumerate(settings) if f.effect == "delayed"}
        self._delays_first = sorted(range(len(settings)), key=lambda i: i not in delays)
        self._limits = limits
        self._masks = [failure.mask(agents, f"{key}[{i}]") for i, failure in enumerate(settings)]
        self._delays = delays
        self._max_delay = max(delays.values(), default=0)
        self.begin(0, 0)

    def begin(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Start an episode; each failure draws its noise from its own stream of `seed`."""
        self._streams = [stream_of(seed, i) for i in range(len(self.settings))]
        self._episode = episode
        # Commands of the last control periods, oldest first
        self._commands = np.zeros((self._max_delay, len(self._limits)))
        self._active: tuple[int, ...] = ()
        self.strike(0)

    def strike(self, step: int) -> bool:
        """Start and end the failures that are due at a step; return whether any changed."""
        former = self._active
        self._active = tuple(
            i for i in self._delays_first if self.settings[i].lasts(self._episode, step)
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
            if i in self._delays:
                first = self._max_delay - self._delays[i]
                speeds[:, mask] = history[first : first + periods, mask]
            else:
                limits, stream = self._limits[mask], self._streams[i]
                speeds[:, mask] = held_speeds(self.settings[i], speeds[:, mask], limits, stream)
        self._commands = history[len(history) - self._max_delay :]
        return speeds

    def active(self) -> Iterator[tuple[FailureSettings, BoolArray]]:
        """Yield the active failures, each with the mask ``(n,)`` of its actuators."""
        for i in self._active:
            yield self.settings[i], self._masks[i]

    @property
    def grip(self) -> FloatArray:
        """Factor on the stiffness of every drive ``(n,)``: 0 for free actuators, else 1."""
        grip = np.ones(len(self._limits))
        for failure, mask in self.active():
            if failure.effect == "free":
                grip[mask] = 0.0
        return grip

    @property
    def failed(self) -> BoolArray:
        """Whether each actuator has failed ``(n,)``."""
        failed = np.zeros(len(self._limits), dtype=bool)
        for _, mask in self.active():
            failed |= mask
        return failed
