"""The push predictor: limits that can be worked out, and the world that it predicts."""

from typing import Any

import numpy as np
import pytest
from push_oracle import push_one

from nested_agents.core.numerics import FloatArray, IntArray
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.prediction import push as kernels
from nested_agents.scenarios.box_pushing.prediction.models import PushModel
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS, compliance
from nested_agents.scenarios.box_pushing.world.settings import RobotSettings, WheelSettings

BOX, ROBOT = BOXES["square"], ROBOTS["e-puck"]
BEHIND = -0.1 - ROBOT.radius


LOPSIDED = RobotSettings(
    wheels=(
        WheelSettings(name="front", x=0.03, y=0.01),
        WheelSettings(name="back", x=-0.01, y=-0.03),
    )
)
"""Robot that turns and moves to both sides under any force: its compliance has no zeros."""


def model(n: int, *, rigid: bool = False, robot: RobotSettings = ROBOT) -> PushModel:
    yielding = np.zeros((3, 3)) if rigid else compliance(robot)
    return PushModel(
        shape=BOX.shape,
        radii=np.full(n, ROBOT.radius),
        compliance=np.stack([yielding] * n),
        friction_force=BOX.friction_force,
        contact_friction=0.0 if rigid else BOX.contact_friction,
    )


def push(
    robots: FloatArray, box: FloatArray, twists: FloatArray, choices: IntArray, *rest: Any
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return poses and gaps with combinations on the first axis, for choices ``(m, M)``."""
    pushed = kernels.push(robots, box, twists, np.ascontiguousarray(choices.T), *rest)
    after, boxes, gaps = (np.moveaxis(each, -1, 0) for each in pushed)
    return after, boxes, gaps


def ahead(poses, speed: float, believed: PushModel, seconds: float = 0.512):
    robots = np.array(poses, dtype=float)
    twists = np.zeros((len(robots), 1, 3))
    twists[:, 0, 0] = speed
    choices = np.zeros((1, len(robots)), dtype=np.int64)
    after, box, gaps = push(robots, np.zeros(3), twists, choices, seconds, believed)
    return after[0], box[0], gaps[0]


def test_a_free_robot_drives_an_arc() -> None:
    robots, box = np.array([[-1.0, 0.0, 0.3]]), np.zeros(3)
    twists = np.array([[[0.1, 0.0, 0.8]]])
    after, moved, gaps = push(robots, box, twists, np.zeros((1, 1), np.int64), 0.512, model(1))
    turned, radius = 0.3 + 0.8 * 0.512, 0.1 / 0.8
    expected = [
        -1.0 + radius * (np.sin(turned) - np.sin(0.3)),
        radius * (np.cos(0.3) - np.cos(turned)),
        turned,
    ]
    np.testing.assert_allclose(after[0, 0], expected, atol=1e-4)
    np.testing.assert_array_equal(moved[0], 0.0)
    assert gaps[0, 0] == pytest.approx(-after[0, 0, 0] - 0.1 - ROBOT.radius, abs=1e-12)


def test_rigid_robots_carry_the_box_along() -> None:
    after, box, gaps = ahead([[BEHIND, 0.05, 0.0], [BEHIND, -0.05, 0.0]], 0.1, model(2, rigid=True))
    # The sweeps visit one robot after the other and stop before they have wholly agreed.
    np.testing.assert_allclose(box, [0.1 * 0.512, 0.0, 0.0], atol=5e-3)
    np.testing.assert_allclose(after[:, 0], BEHIND + 0.1 * 0.512, atol=1e-12)
    np.testing.assert_allclose(gaps, 0.0, atol=5e-4)


def test_two_soft_robots_slip_by_compliance_times_half_the_load() -> None:
    _, box, _ = ahead([[BEHIND, 0.05, 0.0], [BEHIND, -0.05, 0.0]], 0.13, model(2))
    slip = compliance(ROBOT)[0, 0] * BOX.friction_force / 2
    np.testing.assert_allclose(box[0], (0.13 - slip) * 0.512, rtol=0.02)
    np.testing.assert_allclose(box[1:], 0.0, atol=5e-3)


def test_a_robot_that_drives_away_leaves_the_box() -> None:
    _, box, gaps = ahead([[BEHIND, 0.0, 0.0]], -0.1, model(1))
    np.testing.assert_array_equal(box, 0.0)
    assert gaps[0] == pytest.approx(0.0512, abs=1e-9)


def test_a_push_off_the_center_turns_the_box_away() -> None:
    _, left, _ = ahead([[BEHIND, 0.06, 0.0]], 0.13, model(1))
    _, right, _ = ahead([[BEHIND, -0.06, 0.0]], 0.13, model(1))
    assert left[2] < -0.05
    np.testing.assert_allclose(right, left * [1, -1, -1], atol=1e-9)


@pytest.mark.parametrize("name", ["square", "L", "circle", "star"])
@pytest.mark.parametrize("kind", ["e-puck", "lopsided", "rigid"])
def test_the_lanes_compute_what_is_written(name: str, kind: str) -> None:
    rng = np.random.default_rng(0)
    box_spec = BOXES[name]
    robot = LOPSIDED if kind == "lopsided" else ROBOT
    believed = model(3, rigid=kind == "rigid", robot=robot)._replace(shape=box_spec.shape)
    for count in (1, 37):
        angles = rng.uniform(-np.pi, np.pi, 3)
        distances = rng.uniform(0.8, 1.2, 3) * (box_spec.reach + ROBOT.radius)
        robots = np.stack([distances * np.cos(angles), distances * np.sin(angles), angles + 3], 1)
        box = np.array([0.0, 0.0, rng.uniform(-9, 9)])
        twists = rng.uniform(-0.1, 0.13, (3, 5, 3)) * [1, 0.2, 9]
        choices = rng.integers(5, size=(count, 3))
        found = push(robots, box, twists, choices, 0.512, believed)
        for c in range(count):
            written = push_one(robots, box, twists, choices[c], 0.512, believed)
            for a, b in zip(found, written, strict=True):
                np.testing.assert_allclose(a[c], b, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", ["square", "pentagon", "L"])
def test_a_joint_action_has_the_same_bits_alone_and_among_others(name: str) -> None:
    rng = np.random.default_rng(0)
    reach = BOXES[name].reach
    believed = model(3)._replace(shape=BOXES[name].shape)
    robots = rng.uniform(-1.2, 1.2, (3, 3)) * [reach, reach, np.pi]
    box = np.array([0.01, 0.02, 0.3])
    twists = rng.uniform(-0.1, 0.13, (3, 40, 3)) * [1, 0.2, 9]
    choices = rng.integers(40, size=(70, 3))
    choices[32:64, 0] = 5  # all of a block the same
    among = push(robots, box, twists, choices, 0.512, believed)
    for c in (0, 31, 32, 40, 69):
        alone = push(robots, box, twists, choices[c : c + 1], 0.512, believed)
        for a, b in zip(alone, among, strict=True):
            np.testing.assert_array_equal(a[0], b[c])


def test_it_predicts_the_world_within_millimeters() -> None:
    scenario = BoxPushing(BoxPushingSettings(start="easy"))
    rng = np.random.default_rng(1)
    errors, moves = [], []
    for episode in range(6):
        scenario.reset(20_000 + episode)
        joint = np.zeros(4, dtype=np.int64)
        for _ in range(12):
            predicted = scenario.predict().poses(joint[None])
            before = scenario.world.box_pose.copy()
            scenario.step(joint)
            errors.append(np.hypot(*(predicted.boxes[:, 0] - scenario.world.box_pose)[:2]))
            moves.append(np.hypot(*(before - scenario.world.box_pose)[:2]))
            joint = rng.choice([0, 2, 2, 2], size=4)
    pushed = np.array(moves) > 0.005
    assert pushed.sum() > 20
    assert np.mean(np.array(errors)[pushed]) < 0.2 * np.mean(np.array(moves)[pushed])
