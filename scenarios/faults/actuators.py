"""Faults of the actuators of any environment: the kinds that there are, and draws of them.

The kinds are those of `nested_agents.scenarios.faults.settings`; what is added is the field that
names actuators. A fault names them by pattern, ``"0"``, ``"walker_0.*"``, or by number. The policy
is told nothing of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from . import settings
from .settings import FailureSettings, befalling


def _names(value: object) -> object:
    several = value if isinstance(value, list | tuple) else (value,)
    return tuple(str(one) if isinstance(one, int | np.integer) else one for one in several)


class ActuatorFault(FailureSettings):
    """From when to when actuators are faulty, see `nested_agents.scenarios.faults.settings`."""

    part: ClassVar[str] = "actuators"

    actuators: Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(_names)]
    """Actuators by name, pattern or number, one or a list."""
    kind: str = ""
    """What is wrong with them."""


KINDS = befalling(ActuatorFault, **settings.KINDS)
"""The kinds of fault by name."""
Seized, Free, Weak, Reversed, Stuck, Delayed, Noisy = KINDS.values()


def draw_faults(
    seed: int,
    actuators: Sequence[str],
    *,
    episodes: tuple[int, int],
    steps: int = 1,
    count: int = 1,
    lasts: int | None = None,
    kinds: Sequence[str] = tuple(KINDS),
) -> tuple[ActuatorFault, ...]:
    """Draw a schedule of faults, each of a kind, an actuator and an onset of equal probability.

    Parameters
    ----------
    seed
        Equal seeds draw equal schedules.
    actuators
        Names of which each fault befalls one, no one twice.
    episodes
        The first and the last episode in which a fault may begin.
    steps
        It begins at one of that many first steps of its episode.
    count
        Number of faults.
    lasts
        After how many episodes each ends; None: never.
    kinds
        Names in `KINDS`.

    Raises
    ------
    ValueError
        If a kind is unknown, or there are fewer actuators than faults.

    Examples
    --------
    >>> [fault] = draw_faults(1, ["hip", "knee"], episodes=(5, 9), steps=100)
    >>> type(fault).__name__, fault.actuators, fault.episode, fault.step
    ('Reversed', ('hip',), 8, 95)
    """
    unknown = [kind for kind in kinds if kind not in KINDS]
    if unknown or not kinds:
        said = repr(unknown[0]) if unknown else "[]"
        raise ValueError(f"kinds: {said} is no kind of fault, allowed: {', '.join(KINDS)}")
    if not 1 <= count <= len(actuators):
        raise ValueError(f"count = {count}, allowed: 1 to {len(actuators)}, one per actuator")
    first, last = episodes
    if not 0 <= first <= last:
        raise ValueError(f"episodes = {episodes}, allowed: 0 <= first <= last")
    rng = np.random.default_rng(seed)
    befallen = rng.permutation(len(actuators))[:count]
    found = []
    for i in befallen.tolist():
        kind, episode = kinds[int(rng.integers(len(kinds)))], int(rng.integers(first, last + 1))
        end = None if lasts is None else episode + lasts
        found.append(
            KINDS[kind](
                actuators=(actuators[i],), episode=episode, step=int(rng.integers(steps)),
                end_episode=end, end_step=0,
            )
        )  # fmt: skip
    return tuple(found)
