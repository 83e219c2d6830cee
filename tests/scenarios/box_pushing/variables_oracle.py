"""The built-in state variables as NumPy formulas of whole batches: the reference of the kernel."""

from math import pi

import numpy as np

from nested_agents.core.numerics import FloatArray, wrap
from nested_agents.scenarios.box_pushing.states.situations import SituationBatch
from nested_agents.scenarios.box_pushing.world.geometry import BoxShape, surface


def _direction(vectors: FloatArray) -> FloatArray:
    return np.arctan2(vectors[..., 1], vectors[..., 0])


def batch_of(
    robots: FloatArray,
    boxes: FloatArray,
    gaps: FloatArray,
    goal: FloatArray,
    origins: FloatArray,
    periods: float,
    shape: BoxShape,
) -> SituationBatch:
    """Return a batch of situations that are given on the first axis."""
    last = [np.ascontiguousarray(np.moveaxis(each, 0, -1)) for each in (robots, boxes, gaps)]
    return SituationBatch(*last, goal, np.ascontiguousarray(origins.T), periods, shape)


def _inward(batch: SituationBatch, points: FloatArray) -> FloatArray:
    directions = []
    for (x, y), (box_x, box_y, turn) in zip(points, batch.boxes.T, strict=True):
        cos, sin, dx, dy = np.cos(turn), np.sin(turn), x - box_x, y - box_y
        local = cos * dx + sin * dy, cos * dy - sin * dx
        _, nx, ny = surface(batch.shape, *local)
        directions.append(turn + np.arctan2(-ny, -nx))
    return np.array(directions)


def variables(batch: SituationBatch, robot: int) -> dict[str, FloatArray]:
    """Return every built-in variable ``(m,)`` of a robot by name."""
    goal, periods, shape = batch.goal, batch.periods, batch.shape
    robots, gaps = batch.robots.transpose(2, 0, 1), batch.gaps.T
    boxes, origins = batch.boxes.T, batch.origins.T
    count = gaps.shape[1]
    others = [r for r in range(count) if r != robot] or [robot]
    ahead = goal[:2] - boxes[:, :2]
    distance, course = np.hypot(*ahead.T), _direction(ahead)
    azimuth = _direction(boxes[:, :2] - robots[:, robot, :2])
    heading = robots[:, robot, 2]
    push = boxes[:, :2] - robots[:, :, :2].mean(axis=1)
    weights = (np.exp(-np.maximum(gaps, 0.0) / 0.02) + 0.001)[..., None]
    contact = (weights * robots[:, :, :2]).sum(axis=1) / weights.sum(axis=1)
    contact_push = boxes[:, :2] - contact
    inward = _inward(batch, contact)
    along = np.stack([np.cos(inward), np.sin(inward)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    way = boxes[:, :2] - origins[:, :2]
    drift = np.arctan2((way * across).sum(1), abs((way * along).sum(1)) + 0.005 * periods)
    reach = 2.0 * shape.friction_radius**2 / np.maximum(distance, 0.1)
    depth, lever = (contact_push * along).sum(1), (contact_push * across).sum(1)
    path = inward + 0.7 * drift + np.arctan2(lever, np.maximum(depth, reach))
    turn = wrap(boxes[:, 2] - goal[2])
    bearings = {
        "push_bearing": wrap(_direction(push) - course),
        "contact_push_bearing": wrap(_direction(contact_push) - course),
        "path_bearing": wrap(path - course),
    }
    errors = {
        name.replace("push_bearing", "cross_track_error").replace("bearing", "cross_track_error"):
        distance * np.sin(np.clip(bearing, -pi / 2, pi / 2))
        for name, bearing in bearings.items()
    }  # fmt: skip
    before = np.hypot(*(goal[:2] - origins[:, :2]).T)
    return {
        **bearings,
        **errors,
        "gap": gaps[:, robot],
        "heading": wrap(heading),
        "robot_box_distance": np.hypot(*(boxes[:, :2] - robots[:, robot, :2]).T),
        "box_bearing": wrap(azimuth - heading),
        "side": wrap(azimuth - course),
        "others_gap": gaps[:, others].max(axis=1),
        "box_distance": distance,
        "approach": (before - distance) / periods,
        "box_turn": turn,
        "bend": wrap(turn - 2.0 * wrap(course - goal[2])),
        "face_bearing": wrap(_inward(batch, robots[:, robot, :2]) - heading),
        "others_away": np.clip(gaps[:, others] / 0.03, 0.0, 1.0).mean(axis=1),
        "goal_bearing": wrap(_direction(goal[:2] - robots[:, robot, :2]) - heading),
        "goal_distance": np.hypot(*(goal[:2] - robots[:, robot, :2]).T),
        "box_orientation": wrap(boxes[:, 2]),
        "box_goal_bearing": wrap(course - boxes[:, 2]),
    }
