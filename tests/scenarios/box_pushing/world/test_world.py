"""The world: speeds and slip by hand, friction that couples force and torque, determinism."""

import gc

import numpy as np
import pytest

from nested_agents.core.numerics import FloatArray
from nested_agents.scenarios.box_pushing.world import world as world_module
from nested_agents.scenarios.box_pushing.world.boxes import BOXES, box_for
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS, compliance, nominal_effect
from nested_agents.scenarios.box_pushing.world.settings import CONTROL_PERIOD
from nested_agents.scenarios.box_pushing.world.starts import place
from nested_agents.scenarios.box_pushing.world.world import World

E_PUCK = ROBOTS["e-puck"]
FULL = 0.13


def behind(n: int, offsets: tuple[float, ...]) -> World:
    """Return e-pucks that touch the back of a square box."""
    world = World([E_PUCK] * n, BOXES["square"])
    world.place(np.array([[-0.1375, y, 0.0] for y in offsets]), np.zeros(3))
    return world


@pytest.mark.parametrize("name", ROBOTS)
def test_a_free_robot_moves_as_its_nominal_effect_says(name: str) -> None:
    robot = ROBOTS[name]
    world = World([robot], BOXES["square"])
    world.place(np.array([[-1.0, 0.0, 0.3]]), np.zeros(3))
    speeds = np.array([0.05 if wheel.y > 0 else 0.06 for wheel in robot.wheels])
    world.advance(speeds, 30)
    before = world.robot_poses[0]
    world.advance(speeds, 10)
    twist, after = world.twists[1], world.robot_poses[0]
    cos, sin = np.cos(after[2]), np.sin(after[2])
    local = np.array([cos * twist[0] + sin * twist[1], cos * twist[1] - sin * twist[0], twist[2]])
    # Rounding a bend costs a little sideways grip.
    np.testing.assert_allclose(
        local, nominal_effect(robot) @ np.append(speeds, 1.0), rtol=1e-2, atol=1e-3
    )
    assert after[2] - before[2] == pytest.approx(10 * CONTROL_PERIOD * twist[2], rel=1e-3)
    assert not world.contact[0]


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("substeps", [2, 4, 8])
def test_pushing_speed_is_that_of_servo_against_friction(
    n: int, substeps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(world_module, "SUBSTEPS", substeps)
    world = World([E_PUCK] * n, BOXES["square"])
    offsets = (0.0,) if n == 1 else (0.05, -0.05)
    world.place(np.array([[-0.1375, y, 0.0] for y in offsets]), np.zeros(3))
    world.advance(np.full(2 * n, FULL), 40)
    # Box2D's friction joints let 4% of the friction point sideways, see World.
    slip = compliance(E_PUCK)[0, 0] * 0.956 * BOXES["square"].friction_force / n
    np.testing.assert_allclose(world.twists[1:, 0], FULL - slip, rtol=3e-3)
    assert world.twists[0, 0] == pytest.approx(FULL - slip, rel=3e-3)
    assert (world.contact_time > 0.9).all()
    assert world.contact.all()
    # What the servo stiffness was chosen for.
    assert slip == pytest.approx(0.06 if n == 1 else 0.03, abs=0.003)


def test_friction_couples_force_and_torque() -> None:
    world = behind(1, (0.05,))
    world.advance(np.full(2, FULL), 60)
    assert world.box_pose[2] < -0.5


def test_the_box_stops_at_once_and_stays() -> None:
    world = behind(2, (0.05, -0.05))
    world.advance(np.full(4, FULL), 30)
    world.advance(np.zeros(4), 2)
    resting = world.box_pose.copy()
    np.testing.assert_allclose(world.twists[0], 0, atol=1e-5)
    world.advance(np.full(4, -FULL), 30)
    np.testing.assert_allclose(world.box_pose, resting, atol=1e-6)
    np.testing.assert_array_equal(world.contact, False)
    assert world.contact_time.max() < 0.2


@pytest.mark.parametrize("name", BOXES)
def test_robots_do_not_enter_the_box_or_each_other(name: str) -> None:
    rng = np.random.default_rng(2)
    world = World([E_PUCK] * 3, box_for(name, 3))
    robots, box, _ = place("hard", rng, world.robots, world.box)
    world.place(robots, box)
    for _ in range(30):
        toward = world.box_pose[:2] - world.robot_poses[:, :2]
        error = np.arctan2(toward[:, 1], toward[:, 0]) - world.robot_poses[:, 2]
        turn = np.sin(error) * 0.05
        ahead = 0.08 * np.cos(error)
        world.advance(np.stack([ahead - turn, ahead + turn], axis=1).ravel(), 8)
        assert world.gaps.min() > -0.002
        apart = [np.hypot(*(world.robot_poses[i] - world.robot_poses[j])[:2])
                 for i, j in ((0, 1), (0, 2), (1, 2))]  # fmt: skip
        assert min(apart) > 2 * E_PUCK.radius - 0.002
    assert world.contact.any()


def run(world: World, seed: int, decisions: int) -> list[FloatArray]:
    """Let robots wander about; return every pose."""
    rng = np.random.default_rng(seed)
    trace = []
    for _ in range(decisions):
        world.advance(rng.uniform(-0.03, FULL, world.n_wheels), 8)
        trace += [world.robot_poses.copy(), world.box_pose.copy(), world.infrared()]
    return trace


def equal(first: list[FloatArray], second: list[FloatArray]) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_equal_placements_give_equal_bits() -> None:
    start = place("medium", np.random.default_rng(0), [E_PUCK] * 3, box_for("square", 3))
    one, two = (World([E_PUCK] * 3, box_for("square", 3)) for _ in range(2))
    one.place(*start[:2])
    first = run(one, 1, 30)
    two.place(*start[:2])
    assert equal(run(two, 1, 30), first)
    one.place(*start[:2])  # the same world again
    assert equal(run(one, 1, 30), first)
    assert not equal(run(two, 2, 30), first)


def test_saved_worlds_go_on_with_equal_bits() -> None:
    start = place("medium", np.random.default_rng(0), [E_PUCK] * 3, box_for("hexagon", 3))
    one, two = (World([E_PUCK] * 3, box_for("hexagon", 3)) for _ in range(2))
    one.place(*start[:2])
    run(one, 1, 10)
    saved = one.state()
    on = run(one, 2, 20)
    two.restore(saved)
    np.testing.assert_array_equal(two.contact_time, saved.contact_time)
    assert equal(run(two, 2, 20), on)
    one.restore(saved)
    assert equal(run(one, 2, 20), on)


def test_a_free_wheel_turns_the_robot() -> None:
    world = World([E_PUCK], BOXES["square"])
    world.place(np.array([[-0.5, 0.0, 0.0]]), np.zeros(3))
    world.set_grip(np.array([0.0, 1.0]))
    world.advance(np.full(2, 0.1), 20)
    # Nothing holds the free wheel, so the robot turns about it: forces on the other one vanish.
    assert world.robot_poses[0, 2] > 0.1
    assert world.twists[1, 0] < 0.1
    world.set_grip(np.ones(2))
    world.place(np.array([[-0.5, 0.0, 0.0]]), np.zeros(3))
    world.advance(np.full(2, 0.1), 20)
    np.testing.assert_allclose(world.twists[1], [0.1, 0, 0], atol=1e-4)


@pytest.mark.parametrize(
    ("name", "ahead", "oblique"),
    [("square", 0.956, 1.0), ("circle", 0.956, 1.0), ("bar", 0.993, 1.0), ("L", 1.0, 0.954)],
)
def test_ground_friction_is_as_documented(name: str, ahead: float, oblique: float) -> None:
    def lost(vx: float, vy: float, omega: float) -> tuple[float, float]:
        """Return force and torque of the ground on a moving box in one physics step."""
        world = World([E_PUCK], BOXES[name])
        body = world._box
        body.linearVelocity, body.angularVelocity = (10 * vx, 10 * vy), omega
        world.advance(np.zeros(2), 1)
        after = world.twists[0]
        slowed = np.hypot(vx - after[0], vy - after[1]) / CONTROL_PERIOD
        return slowed * world.box.mass, (omega - after[2]) / CONTROL_PERIOD * world.box.inertia

    greatest = BOXES[name].friction_force
    assert lost(2.0, 0.0, 0.0)[0] / greatest == pytest.approx(ahead, abs=0.002)
    assert lost(1.4, 1.4, 0.0)[0] / greatest == pytest.approx(oblique, abs=0.002)
    assert lost(0.0, 0.0, 9.0)[1] / greatest == pytest.approx(BOXES[name].friction_radius, rel=2e-3)


def test_bodies_keep_their_world() -> None:
    box = World([E_PUCK], BOXES["square"])._box
    gc.collect()
    others = [World([E_PUCK], BOXES["bar"]) for _ in range(20)]  # would take freed memory
    for other in others:
        other.advance(np.full(2, FULL), 1)
    assert (box.mass, tuple(box.position)) == (pytest.approx(0.4), (0.0, 0.0))


def test_bad_arguments_are_refused() -> None:
    world = World([E_PUCK] * 2, BOXES["square"])
    with pytest.raises(ValueError, match="grip"):
        world.set_grip(np.ones(3))
