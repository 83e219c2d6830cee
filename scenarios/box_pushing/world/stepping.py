"""Simulation of a whole decision period in one compiled call.

From Python a step of Box2D takes a pose, a force and a torque for each body, calls that take
several times as long as the step itself. Here a kernel reads and writes the bodies where they lie
in memory and calls ``b2World::Step`` by its exported symbol, with the same bits. Where bodies lie
otherwise, or there is no such symbol, nothing of this is used, see `step_address`.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import Box2D
import numpy as np
from Box2D import _Box2D

from ....core.numerics import FloatArray, IntArray, njit
from .geometry import BoxShape, gaps
from .infrared import InfraredSensors, infrared_readings
from .robots import WheelModel, wheel_wrenches

if TYPE_CHECKING:
    from .memory import call, load, set_bits, store

FLAGS = 4
POSITION = 12
ANGLE = 56
VELOCITY = 64
TURNING = 72
FORCE = 76
TORQUE = 84
"""Offsets of the members of a ``b2Body`` of Box2D 2.3 [bytes]; vectors are two numbers."""
AWAKE = 2
"""Flag of bodies in motion, which Box2D simulates; set it when a force is applied."""
STEP = "_ZN7b2World4StepEfii"
"""Symbol of ``b2World::Step(float, int, int)``."""
VELOCITY_ITERATIONS = 8
POSITION_ITERATIONS = 3
PUSH = (0.5, -0.75, 0.25)
"""Force and torque of the check in `step_address`, exact in single precision."""


class Physics(NamedTuple):
    """Constants of the simulation of M robots and a box."""

    step: int
    """Address of ``b2World::Step``; 0 if bodies are not to be written to."""
    substeps: int
    """Steps of Box2D in a control period."""
    dt: float
    """Duration of a step [s]."""
    unit: float
    """Units of Box2D per meter."""
    wheels: WheelModel
    """Wheels, in units of Box2D."""
    shape: BoxShape
    """Outline of the box."""
    radii: FloatArray
    """``(M,)`` radii of the robots [m]."""
    touching: float
    """Gap below which a robot is in contact [m]."""


@njit(cache=True, names_of="memory")
def advance(
    physics: Physics,
    addresses: IntArray,
    speeds: FloatArray,
    last: FloatArray,
    wrenches: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Simulate control periods; return poses ``(M + 1, 3)``, gaps and contact time ``(M,)``.

    Parameters
    ----------
    physics
        Constants of the simulation.
    addresses
        ``(M + 2,)`` addresses of a world, its box and its robots.
    speeds
        ``(periods, n)`` wheel speeds in units of Box2D.
    last, wrenches
        ``(M, 3)`` state of the wheels, see `wheel_wrenches`; modified.
    """
    dt, unit, bodies = physics.dt, physics.unit, addresses[1:]
    n_robots = len(bodies) - 1
    motion = np.empty((n_robots, 4))
    poses = np.empty((n_robots + 1, 3))
    apart: FloatArray = np.empty(n_robots)
    touched = np.zeros(n_robots)
    for period in range(len(speeds)):
        for _ in range(physics.substeps):
            for r in range(n_robots):
                body = bodies[r + 1]
                motion[r, 0] = load(body + ANGLE)
                motion[r, 1] = load(body + VELOCITY)
                motion[r, 2] = load(body + VELOCITY + 4)
                motion[r, 3] = load(body + TURNING)
            wheel_wrenches(motion, speeds[period], dt, physics.wheels, last, wrenches)
            for r in range(n_robots):
                body = bodies[r + 1]
                set_bits(body + FLAGS, np.int16(AWAKE))
                for k in range(3):  # force and torque lie side by side, and are added to
                    at = body + FORCE + 4 * k
                    store(at, load(at) + np.float32(wrenches[r, k]))
            call(
                physics.step,
                addresses[0],
                np.float32(dt),
                VELOCITY_ITERATIONS,
                POSITION_ITERATIONS,
            )
        for r in range(n_robots + 1):
            poses[r, 0] = load(bodies[r] + POSITION) / unit
            poses[r, 1] = load(bodies[r] + POSITION + 4) / unit
            poses[r, 2] = load(bodies[r] + ANGLE)
        apart = gaps(poses[1:], poses[0], physics.shape, physics.radii)
        for r in range(n_robots):
            touched[r] += apart[r] < physics.touching
    return poses, apart, touched / len(speeds)


@njit(cache=True, names_of="memory")
def advance_many(
    physics: Physics,
    sensors: InfraredSensors,
    addresses: IntArray,
    speeds: FloatArray,
    periods: int,
    last: FloatArray,
    wrenches: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Simulate control periods in W equal worlds, see `advance`.

    The first axis of arrays is that of worlds; speeds ``(W, n)`` are held for all periods. Returned
    are poses ``(W, M + 1, 3)``, gaps ``(W, M)``, and the strongest infrared reading of the box by
    each robot ``(W, M)``.
    """
    count = len(addresses)
    n_bodies = addresses.shape[1] - 1
    poses = np.empty((count, n_bodies, 3))
    apart = np.empty((count, n_bodies - 1))
    strongest = np.empty((count, n_bodies - 1))
    held = np.empty((periods, speeds.shape[1]))
    for w in range(count):
        held[:] = speeds[w]
        poses[w], apart[w], _ = advance(physics, addresses[w], held, last[w], wrenches[w])
        robots = poses[w, 1:]
        readings = infrared_readings(robots, poses[w, 0], apart[w], physics.shape, sensors)
        for r in range(n_bodies - 1):
            strongest[w, r] = readings[r].max()
    return poses, apart, strongest


@cache
def step_address() -> int | None:
    """Return the address of ``b2World::Step``; None if bodies are not to be written to.

    The check compares the memory of a body with what Box2D's own functions return.
    """
    from .memory import config  # importing numba takes a second

    if config.DISABLE_JIT:
        return None
    try:
        function = ctypes.CDLL(_Box2D.__file__)[STEP]
    except (OSError, AttributeError):
        return None
    address = ctypes.cast(function, ctypes.c_void_p).value or 0
    world = Box2D.b2World(gravity=(0, 0), doSleep=False, warmStarting=False)
    body = world.CreateDynamicBody(
        position=(1.25, -0.5), angle=0.75, linearVelocity=(0.5, -1.5), angularVelocity=2.5
    )
    body.CreateCircleFixture(radius=1.0, density=1.0)
    numbers = (ctypes.c_float * (TORQUE // 4 + 1)).from_address(int(body.this))
    memory = np.ctypeslib.as_array(numbers)  # changes with the body
    flags = ctypes.c_uint16.from_address(int(body.this) + FLAGS)
    body.awake = False
    was_awake = bool(flags.value & AWAKE)
    flags.value |= AWAKE
    body.ApplyForceToCenter(PUSH[:2], True)
    body.ApplyTorque(PUSH[2], True)
    pushed = memory[[FORCE // 4, FORCE // 4 + 1, TORQUE // 4]].tolist()
    before = tuple(body.position)
    step = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_float, ctypes.c_int32, ctypes.c_int32)(
        address
    )
    step(int(world.this), 0.016, VELOCITY_ITERATIONS, POSITION_ITERATIONS)
    places = np.array([POSITION, POSITION + 4, ANGLE, VELOCITY, VELOCITY + 4, TURNING])
    state = [*body.position, body.angle, *body.linearVelocity, body.angularVelocity]
    is_as_expected = (
        not was_awake
        and body.awake
        and pushed == list(PUSH)
        and before != tuple(body.position)
        and memory[places // 4].tolist() == state
    )
    return address if is_as_expected else None
