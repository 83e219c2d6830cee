"""Faults of the actuators of any environment: the kinds that there are.

The kinds are those of `nested_agents.scenarios.faults.settings`; what is added is the field that
names actuators. A fault names them by pattern, ``"0"``, ``"walker_0.*"``, or by number. The policy
is not informed of it.
"""

from typing import ClassVar

from ...core.plugins.scheduled import Names
from . import settings
from .settings import FailureSettings, befalling


class ActuatorFault(FailureSettings):
    """From when to when actuators are faulty, see `nested_agents.scenarios.faults.settings`."""

    part: ClassVar[str] = "actuators"

    actuators: Names
    """Actuators by name, pattern or number, one or a list."""
    kind: str = ""
    """What is wrong with them."""


KINDS = befalling(ActuatorFault, **settings.KINDS)
"""The kinds of fault by name."""
Seized, Free, Weak, Reversed, Stuck, Delayed, Noisy = KINDS.values()
