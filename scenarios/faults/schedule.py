"""The schedule of failures: what an actuator does instead of its command, and when.

Of several failures of an actuator delays act first, then the others in the order of the spec, each
on what the one before it holds, see `FailureSettings.held`. A world without failures never comes
here.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...core.numerics.arrays import BoolArray, FloatArray
from ...core.numerics.streams import stream_of
from .settings import Delayed, FailureSettings


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
        settings: Sequence[FailureSettings],
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
        delays = [f.periods for f in settings if isinstance(f, Delayed)]
        self._memory = max(delays, default=0)
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
        active = tuple(
            i for i in self._delays_first if self._settings[i].lasts(self._episode, step)
        )
        changed = active != self._active
        self._active = active
        return changed

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
            mask, failure = self._masks[i], self._settings[i]
            if isinstance(failure, Delayed):
                first = self._memory - failure.periods
                speeds[:, mask] = remembered[first : first + periods, mask]
            else:
                limits, stream = self._limits[mask], self._streams[i]
                speeds[:, mask] = failure.held(speeds[:, mask], limits, stream)
        self._commands = remembered[len(remembered) - self._memory :]
        return speeds

    def active(self) -> Iterator[tuple[Any, BoolArray]]:
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
