"""The push of one joint action in plain Python: the oracle of `box_pushing.prediction.push`.

It says readably what the compiled lanes compute side by side, some thousand times slower.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from world_oracles import surface_numpy

from nested_agents.core.numerics import FloatArray
from nested_agents.scenarios.box_pushing.prediction.push import (
    CREEP,
    MARGIN,
    START_SPEED,
    SUBSTEPS,
    SWEEPS,
    PushModel,
)


@dataclass
class _Contact:
    """Where a robot may touch the box; wrenches are ``(fx, fy, torque)`` on the box."""

    robot: int
    normal: FloatArray
    """``(3,)`` the wrench of a unit force along n, into the box."""
    tangent: FloatArray
    """``(3,)`` of one along t, to the left of n."""
    body: FloatArray
    """``(2, 3)`` velocity of the robot's contact point along n and t, per twist in its frame."""
    want: FloatArray
    """``(2,)`` that velocity if the robot is free, less what closes the gap."""
    force: FloatArray
    """``(2,)`` along n and t, on the box."""

    @property
    def wrench(self) -> FloatArray:
        return self.force[0] * self.normal + self.force[1] * self.tangent


def push_one(robots, box, twists, choices, seconds, model):
    """Return robot poses ``(M, 3)``, the box pose ``(3,)`` and gaps ``(M,)``, as `push` does.

    The arguments are those of `push`, but for `choices` ``(M,)``.
    """
    robots, box, dt = robots.copy(), box.copy(), seconds / SUBSTEPS
    chosen = twists[np.arange(len(robots)), choices]
    for _ in range(SUBSTEPS):
        contacts = [
            contact
            for r, twist in enumerate(chosen)
            if (contact := _contact(r, robots[r], box, twist, dt, model)) is not None
        ]
        velocity = _solve(contacts, model)
        yielding = np.zeros_like(chosen)
        for contact in contacts:
            pull = contact.body.T @ -contact.force
            yielding[contact.robot] = model.compliance[contact.robot] @ pull
        robots += dt * np.array(
            [_world(pose, t, dt) for pose, t in zip(robots, chosen + yielding, strict=True)]
        )
        box += dt * velocity
    gaps = np.array([_near(pose, box, model)[0] for pose in robots]) - model.radii
    return robots, box, gaps


def _near(
    pose: FloatArray, box: FloatArray, model: PushModel
) -> tuple[float, FloatArray, FloatArray]:
    """Return distance, outward normal and nearest point from the box's center, world frame."""
    turn = np.array([[np.cos(box[2]), -np.sin(box[2])], [np.sin(box[2]), np.cos(box[2])]])
    x, y = turn.T @ (pose[:2] - box[:2])
    distance, nx, ny, px, py = surface_numpy(model.shape, x, y)
    return distance, turn @ [nx, ny], turn @ [px, py]


def _contact(
    r: int, pose: FloatArray, box: FloatArray, twist: FloatArray, dt: float, model: PushModel
) -> _Contact | None:
    distance, outward, point = _near(pose, box, model)
    gap = distance - model.radii[r]
    if gap > 2.0 * dt * np.hypot(twist[0], twist[1]) + MARGIN:
        return None
    n = -outward
    t = np.array([-n[1], n[0]])
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    to_body = np.array([[cos, sin], [-sin, cos]])
    body = np.zeros((2, 3))
    body[0, :2], body[1, :2] = to_body @ n, to_body @ t
    body[1, 2] = model.radii[r]
    return _Contact(
        robot=r,
        normal=np.array([*n, point[0] * n[1] - point[1] * n[0]]),
        tangent=np.array([*t, point[0] * t[1] - point[1] * t[0]]),
        body=body,
        want=body @ twist - [gap / dt, 0.0],
        force=np.zeros(2),
    )


def _solve(contacts: list[_Contact], model: PushModel) -> FloatArray:
    """Find the contact forces by Gauss-Seidel sweeps; return the velocity of the box."""
    per_wrench = np.array([1.0, 1.0, model.shape.friction_radius**-2])
    mobility = START_SPEED / model.friction_force
    velocity: FloatArray = np.zeros(3)
    for _ in range(SWEEPS):
        for contact in contacts:
            pair = np.array([contact.normal, contact.tangent])
            others = sum((c.wrench for c in contacts if c is not contact), np.zeros(3))
            want = contact.want - mobility * pair @ (per_wrench * others)
            # The velocity between robot and box per force between them.
            give = contact.body @ model.compliance[contact.robot] @ contact.body.T
            give += mobility * (pair * per_wrench) @ pair.T
            contact.force = _force(give, want, model.contact_friction)
        total = sum((c.wrench for c in contacts), np.zeros(3))
        velocity = mobility * per_wrench * total
        speed = float(np.sqrt(velocity**2 @ (1.0 / per_wrench)))
        mobility = max(CREEP, speed) / model.friction_force
    return velocity


def _force(give: FloatArray, want: FloatArray, friction: float) -> FloatArray:
    """Return the force that sticks, or else slips within the friction cone, or else none."""
    force: FloatArray = np.zeros(2)
    if np.linalg.det(give) > 1e-12 * give[0, 0] * give[1, 1]:
        force = np.linalg.solve(give, want)
    if abs(force[1]) > friction * force[0]:
        ratio = friction if force[1] > 0.0 else -friction
        normal = want[0] / (give[0, 0] + ratio * give[0, 1])
        force = np.array([normal, ratio * normal])
    return force if force[0] > 0.0 else np.zeros(2)


def _world(pose: FloatArray, twist: FloatArray, dt: float) -> FloatArray:
    """Return the mean velocity in the world frame under a constant twist: chords, not tangents."""
    half = 0.5 * twist[2] * dt
    level = 1.0 - 0.5 * half * half
    cos = level * np.cos(pose[2]) - half * np.sin(pose[2])
    sin = level * np.sin(pose[2]) + half * np.cos(pose[2])
    return np.array([cos * twist[0] - sin * twist[1], sin * twist[0] + cos * twist[1], twist[2]])
