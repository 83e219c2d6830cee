"""The world's formulas without loops over edges, rays or wheels: oracles of its kernels."""

import numpy as np

from nested_agents.core.numerics import BoolArray, FloatArray
from nested_agents.scenarios.box_pushing.world.geometry import ON_SURFACE_M, BoxShape
from nested_agents.scenarios.box_pushing.world.reward import Task
from nested_agents.scenarios.box_pushing.world.robots import WheelModel
from nested_agents.scenarios.box_pushing.world.settings import InfraredSettings


def surface_numpy(shape: BoxShape, x: float, y: float) -> tuple[float, float, float, float, float]:
    """Return distance, outward normal and nearest surface point, by operations on all edges."""
    edges, radius = shape.edges, shape.radius
    point = np.array([x, y])
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    length2 = (along**2).sum(axis=1)
    dots = ((point - start) * along).sum(axis=1)
    t = np.clip(np.divide(dots, length2, out=np.zeros_like(dots), where=length2 > 0), 0, 1)
    closest = start + t[:, None] * along
    squares = ((point - closest) ** 2).sum(axis=1)
    i = int(squares.argmin())
    end_y = start[:, 1] + along[:, 1]
    spans = (start[:, 1] > y) != (end_y > y)
    slope = np.divide(along[:, 0], along[:, 1], out=np.zeros_like(dots), where=spans)
    inside = bool((spans & (x < start[:, 0] + (y - start[:, 1]) * slope)).sum() % 2)
    side = -1.0 if inside else 1.0
    distance = float(np.sqrt(squares[i]))
    normal = np.array([1.0, 0.0])
    if distance > ON_SURFACE_M:
        normal = side * (point - closest[i]) / distance
    elif length2[i] > 0:
        normal = np.array([along[i, 1], -along[i, 0]]) / np.sqrt(length2[i])
    px, py = closest[i] + radius * normal
    return side * distance - radius, float(normal[0]), float(normal[1]), float(px), float(py)


def ray_numpy(shape: BoxShape, x: float, y: float, dx: float, dy: float, reach: float) -> float:
    """Return what `ray` returns, by marching the signed distance of `surface_numpy`.

    A step as long as the distance to the surface never passes through it, so the march converges
    on the first hit; a grazing ray may take many steps and is given up after 2000.
    """
    traveled = 0.0
    for _ in range(2000):
        distance = surface_numpy(shape, x + traveled * dx, y + traveled * dy)[0]
        if distance <= 1e-10:
            break
        traveled += distance
        if traveled >= reach:
            return reach
    return traveled


def infrared_readings_numpy(
    robots: FloatArray,
    radii: FloatArray,
    sensors: FloatArray,
    box: FloatArray,
    shape: BoxShape,
    spec: InfraredSettings,
) -> FloatArray:
    """Return what `infrared_readings` returns, every ray by `ray_numpy`."""
    out = np.zeros(sensors.shape)
    turn = np.array([[np.cos(box[2]), np.sin(box[2])], [-np.sin(box[2]), np.cos(box[2])]])
    for r, k in np.ndindex(sensors.shape):
        angle = robots[r, 2] + sensors[r, k]
        along = np.array([np.cos(angle), np.sin(angle)])
        eye = robots[r, :2] + radii[r] * along
        (x, y), (dx, dy) = turn @ (eye - box[:2]), turn @ along
        distance = ray_numpy(shape, x, y, dx, dy, spec.reach)
        out[r, k] = np.exp(-distance / spec.decay) if distance < spec.reach else 0.0
    return out


def wheel_wrenches_numpy(
    motion: FloatArray,
    speeds: FloatArray,
    dt: float,
    model: WheelModel,
    last: FloatArray,
    out: FloatArray,
) -> None:
    """Compute what `wheel_wrenches` computes, by matrix operations per robot."""
    contact = model.mass * (motion[:, 1:] - last) - dt * out
    last[:] = motion[:, 1:]
    for r in range(len(motion)):
        own = slice(model.first[r], model.first[r + 1])
        cos, sin = np.cos(motion[r, 0]), np.sin(motion[r, 0])
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        x, y = model.points[own].T
        zero, one = np.zeros_like(x), np.ones_like(x)
        ahead = np.stack([one, zero, -y], axis=1)
        sideways = np.stack([zero, one, x], axis=1)
        drive = ahead.T @ (model.ahead[own] * speeds[own])
        momentum = turn.T @ (model.mass[r] * motion[r, 1:] + contact[r]) + dt * drive
        twist = model.implicit[r] @ momentum
        forces = np.stack(
            [
                model.ahead[own] * (speeds[own] - ahead @ twist),
                -model.sideways[own] * (sideways @ twist),
            ],
            axis=1,
        )
        size = np.linalg.norm(forces, axis=1)
        forces *= np.minimum(1.0, model.limit[own] / np.maximum(size, 1e-300))[:, None]
        out[r] = turn @ (ahead.T @ forces[:, 0] + sideways.T @ forces[:, 1])


def reward_numpy(
    task: Task,
    distance: FloatArray,
    approach: FloatArray,
    orientation: FloatArray,
    contact: BoolArray,
    readings: FloatArray,
) -> FloatArray:
    """Return what `reward` returns, condition by condition, from the least specific on."""
    at = np.s_[:, :, None] if task.by_robot else np.s_[:, None]
    contact, readings = contact[at], readings[at]  # (m, parties, members)
    r1 = task.c1 * np.exp(-task.r1 * distance[:, None])
    r2_r3 = (task.c2 * np.exp(-task.r2 * readings)).sum(axis=2)
    r4 = task.c4 * np.abs(orientation[:, None])
    nearer = approach[:, None] > task.least_approach
    there = task.reached(distance, orientation)[:, None] & task.pays_at_goal
    gained = np.full(r2_r3.shape, task.some_out_of_range)
    for condition, pay in (
        (~(readings > 0.0).any(axis=2), task.all_out_of_range),
        (
            (readings > 0.0).all(axis=2),
            -r2_r3 + (r1 if task.attraction_without_contact else 0.0),
        ),
        (contact.all(axis=2), task.receding),
        (contact.all(axis=2) & nearer, r1 - r2_r3 - r4),
        (there, task.c1),
    ):
        gained = np.where(condition, pay, gained)
    return gained
