"""Failures of wheels: what a wheel does instead of what it is told, and from when to when.

A failure lies between the command that a wheel gets and the speed that its servo holds; the agents
see the commands, and the failure only in how their robot moves. With u the command, held for a
control period, and s the greatest speed of the wheel, the servo holds::

    seized     0
    weak       gain u, 0 < gain < 1
    reversed   -u
    stuck      speed s, whatever u
    delayed    u of some control periods ago, 0 before the episode
    noisy      u + deviation s z, z standard normal, drawn anew every control period, cut to +-s

A free wheel has no drive at all: it resists sideways motion only. Of several failures of a wheel
delays act first, then the others in the order of the spec. A world without failures never comes
here.
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from ....core.arrays import BoolArray, FloatArray
from ..config import (
    DelayedSettings,
    FailureSettings,
    FreeSettings,
    NoisySettings,
    ReversedSettings,
    SeizedSettings,
    StuckSettings,
    WeakSettings,
)
from .world import World


class Failures:
    """The failures that a spec schedules, and the wheels under them.

    Parameters
    ----------
    settings
        The failures.
    agents
        Names of the ``n`` wheels.
    limits
        ``(n,)`` greatest speed of every wheel [m/s].

    Attributes
    ----------
    failed
        ``(n,)`` whether each wheel is under a failure now.
    grip
        ``(n,)`` what multiplies the drive stiffness of every wheel: 0 for free ones, else 1.

    Raises
    ------
    ValueError
        If a failure names a wheel that there is not.

    Examples
    --------
    >>> wheels = ("robot1.left", "robot1.right")
    >>> failures = Failures([SeizedSettings(wheels=("robot1.left",), step=3)], wheels, np.ones(2))
    >>> failures.begin(0, episode=0)
    >>> failures.strike(2), failures.strike(3), failures.failed
    (False, True, array([ True, False]))
    >>> failures.driven(np.array([0.1, 0.1]), periods=1)
    array([[0. , 0.1]])
    """

    def __init__(
        self, settings: Sequence[FailureSettings], agents: Sequence[str], limits: FloatArray
    ) -> None:
        self._settings = tuple(settings)
        self._delays_first = sorted(
            range(len(settings)), key=lambda i: not isinstance(settings[i], DelayedSettings)
        )
        self._limits = limits
        self._masks = [_wheels(i, failure, agents) for i, failure in enumerate(settings)]
        delays = [f.periods for f in settings if isinstance(f, DelayedSettings)]
        self._memory = max(delays, default=0)
        self.begin(0, 0)

    def begin(self, seed: int | np.random.SeedSequence, episode: int) -> None:
        """Start an episode; its noise follows from `seed`, a stream to every failure."""
        root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
        self._streams = [
            np.random.default_rng(
                np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, i))
            )
            for i in range(len(self._settings))
        ]
        self._episode = episode
        # Commands of the last control periods, the oldest first.
        self._commands = np.zeros((self._memory, len(self._limits)))
        self._active: tuple[int, ...] = ()
        self._gather()
        self.strike(0)

    def strike(self, step: int) -> bool:
        """Let begin and end what is due at a step; return whether anything changed."""
        now = (self._episode, step)
        active = tuple(i for i in self._delays_first if _lasts(self._settings[i], now))
        changed = active != self._active
        if changed:
            self._active = active
            self._gather()
        return changed

    def driven(self, commands: FloatArray, periods: int) -> FloatArray:
        """Return the speeds ``(periods, n)`` that the servos hold [m/s].

        Parameters
        ----------
        commands
            ``(n,)`` commanded speeds, held for all periods [m/s].
        periods
            Control periods; they are remembered as past.
        """
        speeds = np.tile(commands, (periods, 1))
        told = np.vstack([self._commands, speeds])
        for i in self._active:
            mask, failure = self._masks[i], self._settings[i]
            if isinstance(failure, DelayedSettings):
                first = self._memory - failure.periods
                speeds[:, mask] = told[first : first + periods, mask]
            else:
                speeds[:, mask] = _held(
                    failure, speeds[:, mask], self._limits[mask], self._streams[i]
                )
        self._commands = told[len(told) - self._memory :]
        return speeds

    def advance(self, world: World, commands: FloatArray, step: int, periods: int) -> None:
        """Let a world go on through (a part of) a step, its wheels being told `commands`."""
        if self.strike(step):
            world.set_grip(self.grip)
        touched = np.zeros(len(world.robots))
        for speeds in self.driven(commands, periods):
            world.advance(speeds, 1)
            touched += world.contact_time
        world.contact_time = touched / periods

    def _gather(self) -> None:
        n = len(self._limits)
        self.failed = np.zeros(n, dtype=bool)
        self.grip: FloatArray = np.ones(n)
        for i in self._active:
            self.failed |= self._masks[i]
            if isinstance(self._settings[i], FreeSettings):
                self.grip[self._masks[i]] = 0.0


def _lasts(failure: FailureSettings, now: tuple[int, int]) -> bool:
    """Return whether a failure is on at an episode and step."""
    over = failure.end_episode is not None and now >= (failure.end_episode, failure.end_step)
    return now >= (failure.episode, failure.step) and not over


def _held(
    failure: FailureSettings, speeds: FloatArray, limits: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Return what servos hold ``(periods, k)`` that are told `speeds`."""
    match failure:
        case SeizedSettings():
            return np.zeros_like(speeds)
        case WeakSettings():
            return failure.gain * speeds
        case ReversedSettings():
            return -speeds
        case StuckSettings():
            return np.broadcast_to(failure.speed * limits, speeds.shape)
        case NoisySettings():
            noise = failure.deviation * limits * rng.standard_normal(speeds.shape)
            return np.clip(speeds + noise, -limits, limits)
        case _:  # a free wheel turns as it likes
            return speeds


def _wheels(number: int, failure: FailureSettings, agents: Sequence[str]) -> BoolArray:
    """Return the mask ``(n,)`` of the wheels that a failure names."""
    mask = np.zeros(len(agents), dtype=bool)
    for name in failure.wheels:
        hit = np.array([fnmatchcase(agent, name) for agent in agents])
        if not hit.any():
            shown = ", ".join(agents[:8]) + (", ..." if len(agents) > 8 else "")
            raise ValueError(
                f"scenario.failures[{number}].wheels = {name!r}: no such wheel, "
                f"allowed {shown} or a pattern such as robot1.*"
            )
        mask |= hit
    return mask
