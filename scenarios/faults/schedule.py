"""The schedule of failures: what an actuator does instead of what it is told, and when.

A failure lies between the command that an actuator gets and the speed that its servo holds; the
agents see the commands, and the failure only in how their bodies move. With u the command, held for
a control period, and s the greatest speed of the actuator, the servo holds::

    seized     0
    weak       gain u, 0 < gain < 1
    reversed   -u
    stuck      speed s, whatever u
    delayed    u of some control periods ago, 0 before the episode
    noisy      u + deviation s z, z standard normal, drawn anew every control period, cut to +-s

Failures of other kinds leave the command as it is; what they do is the scenario's own business. Of
several failures of an actuator delays act first, then the others in the order of the spec. A world
without failures never comes here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase

import numpy as np

from ...core.numerics.arrays import BoolArray, FloatArray
from .settings import Delayed, FailureSettings, Noisy, Reversed, Seized, Stuck, Weak


class Failures:
    """The failures that a spec schedules, and the actuators under them.

    Parameters
    ----------
    settings
        The failures.
    agents
        Names of the ``n`` actuators.
    limits
        ``(n,)`` greatest speed of every actuator, in units of its speed.
    said
        What the failures are called in complaints.

    Attributes
    ----------
    failed
        ``(n,)`` whether each actuator is under a failure now.

    Raises
    ------
    ValueError
        If a failure names an actuator that there is not.

    Examples
    --------
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
        settings: Sequence[FailureSettings],
        agents: Sequence[str],
        limits: FloatArray,
        said: str = "scenario.failures",
    ) -> None:
        self._settings = tuple(settings)
        self._delays_first = sorted(
            range(len(settings)), key=lambda i: not isinstance(settings[i], Delayed)
        )
        self._limits = limits
        self._masks = [
            _named(f"{said}[{i}]", failure, agents) for i, failure in enumerate(settings)
        ]
        delays = [f.periods for f in settings if isinstance(f, Delayed)]
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
        """Return the speeds ``(periods, n)`` that the servos hold .

        Parameters
        ----------
        commands
            ``(n,)`` commanded speeds, held for all periods .
        periods
            Control periods; they are remembered as past.
        """
        speeds = np.tile(commands, (periods, 1))
        told = np.vstack([self._commands, speeds])
        for i in self._active:
            mask, failure = self._masks[i], self._settings[i]
            if isinstance(failure, Delayed):
                first = self._memory - failure.periods
                speeds[:, mask] = told[first : first + periods, mask]
            else:
                speeds[:, mask] = _held(
                    failure, speeds[:, mask], self._limits[mask], self._streams[i]
                )
        self._commands = told[len(told) - self._memory :]
        return speeds

    def active(self) -> Iterator[tuple[FailureSettings, BoolArray]]:
        """Yield the failures that are on, each with the mask ``(n,)`` of what it has befallen."""
        for i in self._active:
            yield self._settings[i], self._masks[i]

    def _gather(self) -> None:
        n = len(self._limits)
        self.failed = np.zeros(n, dtype=bool)
        for _, mask in self.active():
            self.failed |= mask


def _lasts(failure: FailureSettings, now: tuple[int, int]) -> bool:
    """Return whether a failure is on at an episode and step."""
    over = failure.end_episode is not None and now >= (failure.end_episode, failure.end_step)
    return now >= (failure.episode, failure.step) and not over


def _held(
    failure: FailureSettings, speeds: FloatArray, limits: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Return what servos hold ``(periods, k)`` that are told `speeds`."""
    match failure:
        case Seized():
            return np.zeros_like(speeds)
        case Weak():
            return failure.gain * speeds
        case Reversed():
            return -speeds
        case Stuck():
            return np.broadcast_to(failure.speed * limits, speeds.shape)
        case Noisy():
            noise = failure.deviation * limits * rng.standard_normal(speeds.shape)
            return np.clip(speeds + noise, -limits, limits)
        case _:
            return speeds


def _named(said: str, failure: FailureSettings, agents: Sequence[str]) -> BoolArray:
    """Return the mask ``(n,)`` of what a failure names."""
    mask = np.zeros(len(agents), dtype=bool)
    for name in failure.names:
        hit = np.array([fnmatchcase(agent, name) for agent in agents])
        if not hit.any():
            shown = ", ".join(agents[:8]) + (", ..." if len(agents) > 8 else "")
            head, dot, _ = agents[0].rpartition(".")
            raise ValueError(
                f"{said}.{failure.part} = {name!r}: no such "
                f"{failure.part.removesuffix('s')}, allowed {shown} or a pattern such as "
                f"{head}{dot}*"
            )
        mask |= hit
    return mask
