"""Faults of the actuators of any environment: the kinds that there are.

The kinds are those of `nested_agents.scenarios.faults.settings`; what is added is the field that
names actuators. A fault names them by pattern, ``"0"``, ``"walker_0.*"``, or by number. The policy
is told nothing of it.
"""

from __future__ import annotations

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
