"""The same world, driven the way that manuals of pybox2d show: its Python classes throughout.

Every substep asks the bodies for their motion, computes each wheel in plain Python and applies its
force where it stands; every ray is a query with a callback. Bodies, shapes, joints and the solver
are those of `World`, so that the two must agree to single precision.
"""

from __future__ import annotations

from math import cos, exp, hypot, sin
from typing import Any

import Box2D
import numpy as np

from nested_agents.core.numerics import FloatArray
from nested_agents.scenarios.box_pushing.world.boxes import UNIT
from nested_agents.scenarios.box_pushing.world.world import (
    POSITION_ITERATIONS,
    SUBSTEPS,
    VELOCITY_ITERATIONS,
    World,
    WorldState,
)


class Nearest(Box2D.b2RayCastCallback):
    """Finds the nearest fixture of other bodies along a ray."""

    def __init__(self, own: Any) -> None:
        super().__init__()
        self.own, self.fraction = own, 1.0

    def ReportFixture(self, fixture: Any, point: Any, normal: Any, fraction: float) -> float:  # noqa: N802
        """Take in a fixture that the ray meets; Box2D calls this."""
        if fixture.body == self.own:
            return -1.0
        self.fraction = fraction
        return fraction


class NaiveWorld(World):
    """A `World` with a naive inner loop."""

    def restore(self, state: WorldState) -> None:
        """Go back to a saved state."""
        super().restore(state)
        self._before = state.last.tolist()
        self._applied = state.wrenches.tolist()

    def advance(self, wheel_speeds: FloatArray, periods: int) -> None:
        """Let control periods pass with held wheel speeds ``(n_wheels,)`` [m/s]."""
        speeds = [float(speed) * UNIT for speed in wheel_speeds]
        touched = np.zeros(len(self.robots))
        for _ in range(periods):
            for _ in range(SUBSTEPS):
                for r in range(len(self.robots)):
                    self._drive(r, speeds)
                self._world.Step(self.dt, VELOCITY_ITERATIONS, POSITION_ITERATIONS)
            x, y = self._box.position
            self.box_pose = np.array([x / UNIT, y / UNIT, self._box.angle])
            places = [(*body.position, body.angle) for body in self._bodies]
            self.robot_poses = np.array([(x / UNIT, y / UNIT, angle) for x, y, angle in places])
            self.contact = np.array(
                [
                    any(edge.contact.touching and edge.other == self._box for edge in body.contacts)
                    for body in self._bodies
                ]
            )
            touched += self.contact
        self.contact_time = touched / periods

    def _drive(self, r: int, speeds: list[float]) -> None:
        """Apply the forces of a robot's wheels, see `scenarios.box_pushing.world.boxes`."""
        body, model = self._bodies[r], self._wheels
        vx, vy = body.linearVelocity
        omega = body.angularVelocity
        mass, inertia = body.mass, body.inertia
        before, applied = self._before[r], self._applied[r]
        px = 2 * mass * vx - mass * before[0] - self.dt * applied[0]
        py = 2 * mass * vy - mass * before[1] - self.dt * applied[1]
        turn = 2 * inertia * omega - inertia * before[2] - self.dt * applied[2]
        ahead, aside = body.GetLocalVector((px, py))
        wheels = range(model.first[r], model.first[r + 1])
        for i in wheels:
            pull = self.dt * model.ahead[i] * speeds[i]
            ahead += pull
            turn -= model.points[i, 1] * pull
        v0, v1, v2 = model.implicit[r] @ (ahead, aside, turn)
        total = [0.0, 0.0, 0.0]
        for i in wheels:
            x, y = model.points[i]
            fx = model.ahead[i] * (speeds[i] - v0 + y * v2)
            fy = -model.sideways[i] * (v1 + x * v2)
            cut = min(1.0, model.limit[i] / max(hypot(fx, fy), 1e-300))
            force = body.GetWorldVector((fx * cut, fy * cut))
            body.ApplyForce(force, body.GetWorldPoint((x, y)), True)
            total[0] += force[0]
            total[1] += force[1]
            total[2] += (x * fy - y * fx) * cut
        self._before[r], self._applied[r] = [vx, vy, omega], total

    def infrared(self) -> FloatArray:
        """Return what the infrared sensors read, ``(1, M, S)`` in [0, 1], of box and robots."""
        reach, decay = self.sensor.reach, self.sensor.decay
        readings: FloatArray = np.zeros(self._sensors.shape)
        for r, (body, robot) in enumerate(zip(self._bodies, self.robots, strict=True)):
            x, y = body.position
            for k, direction in enumerate(self._sensors[r]):
                angle = body.angle + direction
                dx, dy = UNIT * cos(angle), UNIT * sin(angle)
                near, far = robot.radius, robot.radius + reach
                nearest = Nearest(body)
                self._world.RayCast(
                    nearest, (x + near * dx, y + near * dy), (x + far * dx, y + far * dy)
                )
                if nearest.fraction < 1.0:
                    readings[r, k] = exp(-nearest.fraction * reach / decay)
        return readings[None]
