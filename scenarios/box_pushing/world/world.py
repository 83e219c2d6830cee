"""The physical world: robots and a box on a plane, seen from above, in Box2D.

The rest of the package speaks SI; Box2D wants bodies of 0.1 to 10 units, so that this module and
`stepping`, and nothing else, talk to it in decimeters. A control period is a whole number of
physics steps: forces of all wheels, and one step of Box2D. All steps of a decision are one compiled
call, see `stepping`. Where that is not possible, the same is done from Python.

Box2D keeps impulses from step to step to start its solver from ("warm starting"); that is switched
off, so that the future depends on poses and velocities alone and a saved world can be restored.

The box rubs on the ground by one friction joint at each of its friction points. Such a joint cuts
its force to the limit after weighting it with the box's mass as seen from the joint, which leaves
force not quite against the motion: sliding along its axes, a square meets 4% less than its
`friction_force`; along its diagonals and in turning, all of it.

A wheel that fails as free has no drive at all: it resists sideways motion only. All other kinds of
failure are described in `nested_agents.scenarios.faults.settings`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import Box2D
import numpy as np

from ....core.numerics import BoolArray, FloatArray, IntArray
from ...faults.settings import Failures
from .boxes import BoxSpec
from .geometry import gaps
from .infrared import InfraredSensors, infrared_readings
from .polygons import UNIT
from .robots import sensor_directions, wheel_model, wheel_wrenches
from .settings import CONTROL_PERIOD, InfraredSettings, RobotSettings
from .stepping import (
    POSITION_ITERATIONS,
    VELOCITY_ITERATIONS,
    Physics,
    advance,
    step_address,
)

TOUCHING = 0.001
"""Gap [m] below which a robot counts as touching: Box2D keeps polygons `SKIN` apart, up to a slop
of 0.5 mm."""
SKIN = 0.005
"""Rounding of polygons in Box2D [dm]; its default is twice that."""
SUBSTEPS = 4
"""Physics steps of a control period."""


class WorldState(NamedTuple):
    """All that the future of a `World` depends on, besides the wheel speeds to come."""

    poses: FloatArray
    """``(M + 1, 3)`` of the box and the robots, world frame."""
    twists: FloatArray
    """``(M + 1, 3)`` of the box and the robots, world frame."""
    last: FloatArray
    """``(M, 3)`` what the wheel model remembers of the last step: twists, in units of Box2D."""
    wrenches: FloatArray
    """``(M, 3)`` what it remembers of wrenches, in units of Box2D."""
    contact_time: FloatArray
    """Attribute of `World`."""


class World:
    """Robots, a box and the ground.

    Parameters
    ----------
    robots
        The robots; their wheels, in this order, are the actuators.
    box
        The box.
    infrared
        Response of the infrared sensors; none: the e-Puck's. The world adds no noise to it.

    Attributes
    ----------
    poses
        ``(M + 1, 3)`` of the box and the robots [m, m, rad]; another array after every step.
    robot_poses
        ``(M, 3)`` [m, m, rad].
    box_pose
        ``(3,)`` [m, m, rad].
    gaps
        ``(M,)`` distance between the surfaces of robot and box [m].
    contact
        ``(M,)`` whether each robot touches the box.
    addresses
        ``(M + 2,)`` memory addresses of the world, the box and the robots; valid until `restore`.
    physics, sensors
        Constants of the simulation and of the infrared sensors, for kernels.
    contact_time
        ``(M,)`` fraction of the control periods of the last `advance` that ended in contact.

    Examples
    --------
    >>> from nested_agents.scenarios.box_pushing.world.boxes import BOXES
    >>> from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
    >>> world = World([ROBOTS["e-puck"]], BOXES["square"])
    >>> world.place(np.array([[-0.2, 0.0, 0.0]]), np.zeros(3))
    >>> world.advance(np.array([0.13, 0.13]), periods=30)
    >>> bool(world.contact[0]), bool(world.box_pose[0] > 0.02)
    (True, True)
    """

    def __init__(
        self,
        robots: Sequence[RobotSettings],
        box: BoxSpec,
        *,
        infrared: InfraredSettings | None = None,
    ) -> None:
        self.robots = tuple(robots)
        self.box = box
        self.sensor = infrared or InfraredSettings()
        self.n_wheels = sum(len(robot.wheels) for robot in robots)
        self.dt = CONTROL_PERIOD / SUBSTEPS
        self._radii: FloatArray = np.array([robot.radius for robot in robots])
        self.sensors = InfraredSensors(self._radii, sensor_directions(robots), self.sensor.response)
        self.set_grip(np.ones(self.n_wheels))
        around = 2.0 * box.reach * np.arange(1, len(robots) + 1)
        self.place(np.stack([-around, 0 * around, 0 * around], axis=1), np.zeros(3))

    def set_grip(self, grip: FloatArray) -> None:
        """Set the factors ``(n_wheels,)`` of the wheels' drive stiffness, and rebuild the physics.

        At 0 a wheel runs free; it still resists sideways motion.
        """
        self._grip: FloatArray = np.array(grip, dtype=float)
        if self._grip.shape != (self.n_wheels,) or not (self._grip >= 0).all():
            raise ValueError(f"grip: {grip}, must be {self.n_wheels} numbers >= 0")
        self.physics = Physics(
            step_address() or 0,
            SUBSTEPS,
            self.dt,
            UNIT,
            wheel_model(self.robots, self.dt, self._grip, UNIT),
            self.box.shape,
            self._radii,
            TOUCHING,
        )

    def place(self, robot_poses: FloatArray, box_pose: FloatArray) -> None:
        """Reset the world to the poses of robots ``(M, 3)`` and box ``(3,)``, all at rest."""
        n = len(self.robots)
        poses = np.vstack([box_pose, robot_poses])
        rest = np.zeros((n, 3))
        self.restore(WorldState(poses, np.zeros((n + 1, 3)), rest, rest, np.zeros(n)))

    def state(self) -> WorldState:
        """Return all that the future depends on.

        The world is restored from this state, too. Otherwise Box2D might process its contacts in
        another order than those of a restored world, and the last bits would differ.
        """
        state = WorldState(
            poses=np.vstack([self.box_pose, self.robot_poses]),
            twists=self.twists,
            last=self._last.copy(),
            wrenches=self._wrenches.copy(),
            contact_time=self.contact_time.copy(),
        )
        self.restore(state)
        return state

    def restore(self, state: WorldState) -> None:
        """Restore a saved state of this world or of an equal one."""
        self._world = Box2D.b2World(
            gravity=(0, 0), doSleep=False, warmStarting=False, continuousPhysics=False
        )
        ground = self._world.CreateStaticBody()
        self._box, *self._bodies = [
            self._world.CreateDynamicBody(
                position=(x * UNIT, y * UNIT),
                angle=heading,
                linearVelocity=(vx * UNIT, vy * UNIT),
                angularVelocity=omega,
            )
            for (x, y, heading), (vx, vy, omega) in zip(
                state.poses.tolist(), state.twists.tolist(), strict=True
            )
        ]
        self._add_box(ground)
        for body, robot in zip(self._bodies, self.robots, strict=True):
            body.CreateCircleFixture(
                radius=robot.radius * UNIT, density=1.0, friction=self.box.contact_friction
            )
            body.massData = Box2D.b2MassData(
                mass=robot.mass, center=(0, 0), I=robot.inertia * UNIT**2
            )
        for body in (self._box, *self._bodies):
            # Box2D frees bodies with their world, and access to a freed body crashes Python.
            # Therefore each body keeps its world alive.
            body.world_kept = self._world
        everything = (self._box, *self._bodies)
        self.addresses: IntArray = np.array(
            [int(thing.this) for thing in (self._world, *everything)]
        )
        self._last = state.last.copy()
        self._wrenches = state.wrenches.copy()
        self._observe()
        self.contact_time = state.contact_time.copy()

    def advance(self, wheel_speeds: FloatArray, periods: int) -> None:
        """Simulate control periods with wheel speeds [m/s].

        They are held, ``(n_wheels,)``, or those of each period, ``(periods, n_wheels)``.
        """
        speeds = np.full((periods, self.n_wheels), wheel_speeds) * UNIT
        if not self.physics.step:
            self._advance_by_steps(speeds)
            return
        poses, self.gaps, self.contact_time = advance(
            self.physics, self.addresses, speeds, self._last, self._wrenches
        )
        self._know(poses)

    def advance_failing(
        self, failures: Failures, commands: FloatArray, step: int, periods: int
    ) -> None:
        """Simulate control periods of a step with commands ``(n_wheels,)``, subject to failures."""
        if failures.strike(step):
            self.set_grip(failures.grip)
        self.advance(failures.driven(commands, periods) if failures.settings else commands, periods)

    def _advance_by_steps(self, speeds: FloatArray) -> None:
        """Simulate control periods with speeds ``(periods, n_wheels)``, step by step."""
        touched = np.zeros(len(self.robots))
        for of_period in speeds:
            for _ in range(SUBSTEPS):
                self._step(of_period)
            self._observe()
            touched += self.contact
        self.contact_time = touched / len(speeds)

    @property
    def twists(self) -> FloatArray:
        """Velocities (vx, vy, omega) of the box and the robots ``(M + 1, 3)``, world frame."""
        bodies = (self._box, *self._bodies)
        velocities = [(*body.linearVelocity, body.angularVelocity) for body in bodies]
        return np.array(velocities) / (UNIT, UNIT, 1.0)

    def infrared(self) -> FloatArray:
        """Return the noise-free readings of the box by all infrared sensors ``(M, S)``."""
        return infrared_readings(
            self.robot_poses, self.box_pose, self.gaps, self.box.shape, self.sensors
        )

    def _step(self, speeds: FloatArray) -> None:
        """Advance by one physics step."""
        motion = np.array(
            [(body.angle, *body.linearVelocity, body.angularVelocity) for body in self._bodies]
        )
        wheel_wrenches(motion, speeds, self.dt, self.physics.wheels, self._last, self._wrenches)
        for body, (fx, fy, torque) in zip(self._bodies, self._wrenches.tolist(), strict=True):
            body.ApplyForceToCenter((fx, fy), True)
            body.ApplyTorque(torque, True)
        self._world.Step(self.dt, VELOCITY_ITERATIONS, POSITION_ITERATIONS)

    def _observe(self) -> None:
        """Read poses and find contacts."""
        poses = np.array([(*body.position, body.angle) for body in (self._box, *self._bodies)])
        poses /= UNIT, UNIT, 1.0
        self.gaps = gaps(poses[1:], poses[0], self.box.shape, self._radii)
        self._know(poses)

    def _know(self, poses: FloatArray) -> None:
        """Set the current poses ``(M + 1, 3)`` of box and robots."""
        self.poses = poses
        self.contact: BoolArray = self.gaps < TOUCHING
        self.box_pose = poses[0]
        self.robot_poses = poses[1:]

    def _add_box(self, ground: Box2D.b2Body) -> None:
        """Give the box its shape, its mass and its friction on the ground."""
        box = self.box
        polygons = [
            Box2D.b2PolygonShape(vertices=(piece * UNIT).tolist(), radius=SKIN)
            for piece in box.fixtures
        ]
        for shape in polygons or [Box2D.b2CircleShape(radius=box.radius * UNIT)]:
            self._box.CreateFixture(shape=shape, density=1.0, friction=box.contact_friction)
        # Set after the fixtures, which would bring masses of their own.
        self._box.massData = Box2D.b2MassData(mass=box.mass, center=(0, 0), I=box.inertia * UNIT**2)
        for point in (box.friction_points * UNIT).tolist():
            self._world.CreateFrictionJoint(
                bodyA=ground,
                bodyB=self._box,
                localAnchorB=point,
                maxForce=box.friction_force * UNIT / len(box.friction_points),
                maxTorque=0.0,
                collideConnected=True,
            )
