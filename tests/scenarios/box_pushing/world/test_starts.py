"""Start distributions: ranges, no overlaps, equal seeds, refusals."""

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.world.boxes import BOXES, BoxSpec, box_for
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS
from nested_agents.scenarios.box_pushing.world.starts import CLEARANCE, STARTS, place
from nested_agents.scenarios.box_pushing.world.world import World

ROBOT = ROBOTS["e-puck"]


@pytest.mark.parametrize("n", [1, 2, 3, 4])
@pytest.mark.parametrize("name", BOXES)
@pytest.mark.parametrize("start", STARTS)
def test_every_start(start: str, name: str, n: int) -> None:
    spec, box = STARTS[start], box_for(name, n)
    world = World([ROBOT] * n, box)
    rng = np.random.default_rng(11)
    for _ in range(20):
        robots, pose, goal = place(start, rng, world.robots, box)
        world.place(robots, pose)
        ahead = goal - pose
        assert np.hypot(*ahead[:2]) == pytest.approx(spec.distance)
        assert abs(np.arctan2(ahead[1], ahead[0])) <= spec.bearing
        assert abs(pose[2]) <= spec.angle
        assert (world.gaps >= spec.gaps[0] - 1e-6).all()
        assert (world.gaps <= spec.gaps[1] + 1e-6).all()
        assert (abs((robots[:, 2] - pose[2] + np.pi) % (2 * np.pi) - np.pi) <= spec.heading).all()
        apart = np.hypot(*(robots[:, None, :2] - robots[None, :, :2]).transpose(2, 0, 1))
        assert (apart[~np.eye(n, dtype=bool)] >= 2 * ROBOT.radius + CLEARANCE - 1e-9).all()
        if not spec.around:
            c, s = np.cos(pose[2]), np.sin(pose[2])
            local = (robots[:, :2] - pose[:2]) @ np.array([[c, -s], [s, c]])
            assert (local[:, 0] < 0).all()
            assert (np.diff(local[:, 1]) < 0).all()  # first robot leftmost
            assert (abs(local[:, 1]) <= max(map(abs, box.width)) - ROBOT.radius).all()


def test_hard_starts_cover_all_sides() -> None:
    rng = np.random.default_rng(5)
    sides = []
    for _ in range(200):
        robots, box, _ = place("hard", rng, [ROBOT] * 2, BOXES["square"])
        sides += np.arctan2(*(robots[:, :2] - box[:2]).T).tolist()
    counts, _ = np.histogram(sides, bins=8, range=(-np.pi, np.pi))
    assert counts.min() > 20


def test_the_distance_to_the_goal_in_units_of_the_box() -> None:
    box = box_for("square", 8)
    draws = [
        place("medium", np.random.default_rng(3), [ROBOT] * 8, box, unit) for unit in (1.0, 4.0)
    ]
    (near, at, goal), (robots, far, same) = draws
    np.testing.assert_array_equal(goal, same)
    np.testing.assert_allclose(goal[:2] - far[:2], 4.0 * (goal[:2] - at[:2]))
    # Robots do not grow: they stand as near to the box as ever.
    np.testing.assert_allclose(robots[:, :2] - far[:2], near[:, :2] - at[:2])


def test_equal_seeds_give_equal_starts() -> None:
    draws = [
        place("medium", np.random.default_rng(seed), [ROBOT] * 2, BOXES["square"])
        for seed in (1, 1, 2)
    ]
    for first, again, other in zip(*draws, strict=True):
        np.testing.assert_array_equal(first, again)
        assert first is not again
        if not np.array_equal(first, [1.0, 0.0, 0.0]):
            assert not np.array_equal(first, other)


@pytest.mark.parametrize(
    ("start", "robots", "box", "word"),
    [
        ("medium", 3, BOXES["square"], "3 of 0.228 m in all do not fit side by side"),
        ("hard", 30, BoxSpec("small", radius=0.05), "do not fit around box 'small'"),
    ],
)
def test_refusals(start: str, robots: int, box: BoxSpec, word: str) -> None:
    with pytest.raises(ValueError, match=word) as error:
        place(start, np.random.default_rng(0), [ROBOT] * robots, box)
    assert "\n" not in str(error.value)


def test_a_fixed_start_is_the_same_in_every_episode() -> None:
    first, second = (
        place("fixed", np.random.default_rng(seed), [ROBOT] * 2, BOXES["square"]) for seed in (0, 1)
    )
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)
    robots, box, goal = first
    np.testing.assert_allclose(goal - box, [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(robots[0, 1], -robots[1, 1])  # symmetric about the course
    np.testing.assert_array_equal(robots[:, 2], 0.0)
