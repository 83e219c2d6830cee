"""Failures of wheels: the schedule of any failures, and what a wheel without a drive adds to it.

A free wheel has no drive at all: it resists sideways motion only. All other kinds of failure are
described in `nested_agents.scenarios.faults.schedule`.
"""

import numpy as np

from ....core.numerics.arrays import FloatArray
from ...faults.schedule import Failures
from ...faults.settings import Free
from .world import World


class WheelFailures(Failures):
    """The failures that a spec schedules, and the wheels under them."""

    @property
    def grip(self) -> FloatArray:
        """What multiplies the drive stiffness of every wheel ``(n,)``: 0 for free ones, else 1."""
        grip = np.ones(len(self.failed))
        for failure, wheels in self.active():
            if isinstance(failure, Free):
                grip[wheels] = 0.0
        return grip

    def advance(self, world: World, commands: FloatArray, step: int, periods: int) -> None:
        """Let a world go on through (a part of) a step, its wheels being commanded `commands`."""
        if self.strike(step):
            world.set_grip(self.grip)
        if not self._settings:
            world.advance(commands, periods)
            return
        touched = np.zeros(len(world.robots))
        for speeds in self.driven(commands, periods):
            world.advance(speeds, 1)
            touched += world.contact_time
        world.contact_time = touched / periods
