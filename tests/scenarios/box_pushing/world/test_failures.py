"""Failures: what wheels do by hand, when, their effect on free motion against theory."""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.linalg import expm

from nested_agents.core.agents.loop import world_seed
from nested_agents.core.numerics import FloatArray
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS, nominal_effect
from nested_agents.scenarios.box_pushing.world.settings import (
    Failure,
    FailureSettings,
    RobotSettings,
)
from nested_agents.scenarios.box_pushing.world.world import World
from nested_agents.scenarios.faults.settings import Failures

WHEELS = ("robot1.left", "robot1.right", "robot2.left", "robot2.right")
KINDS = ("seized", "free", "weak", "reversed", "stuck", "delayed", "noisy")


def failure(kind: str, wheels: str = "robot1.left", **table: Any) -> FailureSettings:
    table |= {"kind": kind, "wheels": wheels}
    return TypeAdapter(Failure).validate_python(table)


def failures(*settings: FailureSettings) -> Failures:
    return Failures(settings, WHEELS, np.full(4, 2.0))


def scenario(*settings: FailureSettings, **table: Any) -> BoxPushing:
    return BoxPushing(BoxPushingSettings(failures=settings, **table))


def episode(world: BoxPushing, seed: int = 4, number: int = 0, steps: int = 8) -> FloatArray:
    """Return the states of an episode of random actions."""
    rng = np.random.default_rng(7)
    states = [world.reset(world_seed(seed, number), number)]
    for _ in range(steps):
        states.append(world.step(rng.integers(4, size=4)).states)
    return np.array(states)


def test_the_kinds_are_all_there_are() -> None:
    with pytest.raises(ValidationError) as refusal:
        failure("tired")
    assert refusal.value.errors()[0]["ctx"]["expected_tags"] == ", ".join(map(repr, KINDS))


@pytest.mark.parametrize(
    ("kind", "table", "held"),
    [
        ("seized", {}, 0.0),
        ("free", {}, 0.6),
        ("weak", {"gain": 0.25}, 0.15),
        ("reversed", {}, -0.6),
        ("stuck", {"speed": -0.5}, -1.0),
    ],
)
def test_what_a_failed_wheel_holds(kind: str, table: dict[str, float], held: float) -> None:
    ill = failures(failure(kind, **table))
    speeds = ill.driven(np.array([0.6, 0.5, 0.4, 0.3]), 3)
    np.testing.assert_allclose(speeds, [[held, 0.5, 0.4, 0.3]] * 3, rtol=1e-15)
    np.testing.assert_array_equal(ill.failed, [True, False, False, False])
    np.testing.assert_array_equal(ill.grip, [0.0 if kind == "free" else 1.0, 1, 1, 1])


def test_a_delayed_wheel_does_what_it_was_told_before() -> None:
    ill = failures(failure("delayed", periods=3))
    told = [0.1, 0.2, 0.3, 0.4]
    done = np.concatenate([ill.driven(np.full(4, u), 2) for u in told])
    np.testing.assert_array_equal(done[:, 0], [0, 0, 0, 0.1, 0.1, 0.2, 0.2, 0.3])
    np.testing.assert_array_equal(done[:, 1], np.repeat(told, 2))
    ill.begin(0, 0)
    assert ill.driven(np.full(4, 0.5), 1)[0, 0] == 0  # the episode before is forgotten


def test_a_delay_that_sets_in_knows_what_was_told_before() -> None:
    ill = failures(failure("delayed", periods=1, step=1))
    ill.driven(np.full(4, 0.1), 2)
    ill.strike(1)
    np.testing.assert_array_equal(ill.driven(np.full(4, 0.2), 2)[:, 0], [0.1, 0.2])


def test_noise_has_its_deviation_and_stays_within_the_motor() -> None:
    ill = failures(failure("noisy", deviation=0.3))
    speeds = ill.driven(np.zeros(4), 20_000)
    # Of the normal distribution cut at 1 / 0.3 deviations next to nothing is lost.
    assert speeds[:, 0].std() == pytest.approx(0.6, rel=0.02)
    assert abs(speeds[:, 0].mean()) < 0.02
    assert np.abs(speeds).max() <= 2.0
    np.testing.assert_array_equal(speeds[:, 1:], 0)


def test_failures_of_one_wheel_add_up_delays_first() -> None:
    ill = failures(failure("weak", gain=0.5), failure("reversed"), failure("delayed", periods=1))
    assert ill.driven(np.full(4, 1.0), 1)[0, 0] == 0
    assert ill.driven(np.full(4, 0.0), 1)[0, 0] == -0.5


@pytest.mark.parametrize(
    ("names", "hit"),
    [
        (("robot2.left",), [2]),
        (("robot1.*",), [0, 1]),
        (("*.left",), [0, 2]),
        (("robot1.left", "robot2.right"), [0, 3]),
        ("*", [0, 1, 2, 3]),
    ],
)
def test_wheels_by_name_and_pattern(names: Any, hit: list[int]) -> None:
    assert np.flatnonzero(failures(failure("seized", names)).failed).tolist() == hit


def test_it_lasts_from_onset_to_end_over_episodes() -> None:
    ill = failures(failure("seized", episode=1, step=2, end_episode=3, end_step=1))
    seen = {}
    for number in range(5):
        ill.begin(0, number)
        seen[number] = [bool(ill.failed[0])]
        for step in range(1, 4):
            ill.strike(step)
            seen[number].append(bool(ill.failed[0]))
    assert seen == {
        0: [False] * 4,
        1: [False, False, True, True],
        2: [True] * 4,
        3: [True, False, False, False],
        4: [False] * 4,
    }


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        ({"wheels": "robot3.left"}, "no such wheel, allowed robot1.left"),
        ({"wheels": ("robot1.left", "Robot1.*")}, "'Robot1.*'"),
        ({"episode": 2, "step": 1, "end_episode": 2, "end_step": 1}, "after its beginning"),
        ({"end_step": 1}, "needs an end_episode"),
        ({"wheels": ()}, "at least 1"),
        ({"episode": -1}, "greater than or equal to 0"),
        ({"gain": 0.5}, "not permitted"),
    ],
)
def test_refusals(table: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint.replace("*", r"\*")):
        scenario(failure("seized", **table))


# Theory of free motion: the wheels as springs between speeds, M v' = B u - K v in the body frame.


def balance(robot: RobotSettings, grip: FloatArray) -> tuple[FloatArray, ...]:
    """Return M, K ``(3, 3)`` and B ``(3, w)`` with every wheel's grip."""
    M = np.diag([robot.mass, robot.mass, robot.inertia])
    K, B = np.zeros((3, 3)), np.zeros((3, len(robot.wheels)))
    for w, wheel in enumerate(robot.wheels):
        jacobian = np.array([[1.0, 0.0, -wheel.y], [0.0, 1.0, wheel.x]])
        stiffness = np.diag([robot.stiffness * grip[w], robot.lateral_stiffness])
        K += jacobian.T @ stiffness @ jacobian
        B[:, w] = robot.stiffness * grip[w] * jacobian[0]
    return M, K, B


def free_twist(robot: RobotSettings, settings: FailureSettings, speeds: FloatArray) -> FloatArray:
    """Return the twist, own frame, of a free robot under a failure after 40 control periods."""
    world = World([robot], BOXES["square"])
    world.place(np.array([[-1.0, 0.0, 0.3]]), np.zeros(3))
    agents = [f"robot1.{name}" for name in robot.wheel_names]
    ill = Failures([settings], agents, np.full(len(agents), robot.max_speed))
    world.set_grip(ill.grip)
    for held in ill.driven(speeds, 40):
        world.advance(held, 1)
    (vx, vy, omega), angle = world.twists[1], world.robot_poses[0, 2]
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([cos * vx + sin * vy, cos * vy - sin * vx, omega])


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=lambda robot: robot.name)
@pytest.mark.parametrize("kind", ["seized", "weak", "reversed", "stuck", "delayed"])
def test_free_motion_is_that_of_the_nominal_effect_with_one_column_changed(
    robot: RobotSettings, kind: str
) -> None:
    settings = failure(kind, f"robot1.{robot.wheel_names[0]}")
    speeds = np.linspace(0.03, 0.04, len(robot.wheels))
    effect = nominal_effect(robot)
    effect[:, -1] = effect[:, 0] * (0.5 * robot.max_speed if kind == "stuck" else 0.0)
    effect[:, 0] *= {"seized": 0, "weak": 0.3, "reversed": -1, "stuck": 0, "delayed": 1}[kind]
    expected = effect @ np.append(speeds, 1.0)
    found = free_twist(robot, settings, speeds)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=0.002)
    # Not what a healthy robot would do.
    healthy = nominal_effect(robot) @ np.append(speeds, 1.0)
    assert kind == "delayed" or np.abs(found - healthy).max() > 0.05


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=lambda robot: robot.name)
def test_free_motion_with_a_free_wheel(robot: RobotSettings) -> None:
    # Nothing resists an e-puck that turns about its only driven wheel: there the twist follows
    # from the inertia, so that the motion is integrated rather than balanced.
    w = len(robot.wheels)
    grip = np.ones(w)
    grip[0] = 0.0
    speeds = np.linspace(0.03, 0.04, w)
    M, K, B = balance(robot, grip)
    system = np.zeros((6, 6))
    system[:3, :3] = -np.linalg.solve(M, K)
    system[:3, 3:] = np.diag(np.linalg.solve(M, B @ speeds))
    expected = expm(system * 40 * 0.064)[:3, 3:].sum(axis=1)
    found = free_twist(robot, failure("free", f"robot1.{robot.wheel_names[0]}"), speeds)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=0.002)
    if robot.name == "e-puck":
        lever = robot.mass * robot.wheels[1].y ** 2 / robot.inertia
        assert found[0] == pytest.approx(0.04 / (1 + lever), rel=0.02)


def test_a_noisy_wheel_does_on_average_what_it_is_told() -> None:
    robot = ROBOTS["e-puck"]
    world = World([robot], BOXES["square"])
    ill = Failures([failure("noisy", "*")], ["robot1.left", "robot1.right"], np.full(2, 0.13))
    ahead = []
    for seed in range(40):
        world.place(np.array([[-2.0, 0.0, 0.0]]), np.zeros(3))
        ill.begin(seed, 0)
        for held in ill.driven(np.array([0.05, 0.05]), 10):
            world.advance(held, 1)
        ahead.append(world.robot_poses[0, 0] + 2.0)
    # A wheel's path in 10 periods deviates by 0.3 x 0.13 x 0.064 sqrt(10) m, the robot's by half
    # the square root of two of it.
    assert np.mean(ahead) == pytest.approx(0.032, abs=3 * 0.0056 / np.sqrt(40))
    assert np.std(ahead) == pytest.approx(0.0056, rel=0.35)


# In the scenario.


def test_a_world_without_failures_and_one_that_waits_for_them_are_equal_to_the_bit() -> None:
    waiting = [failure(kind, "*", episode=5) for kind in KINDS]
    np.testing.assert_array_equal(episode(scenario()), episode(scenario(*waiting)))
    assert not np.array_equal(episode(scenario(), number=5), episode(scenario(*waiting), number=5))


@pytest.mark.parametrize("kind", KINDS)
def test_every_failure_repeats_itself_and_heals(kind: str) -> None:
    ill = scenario(failure(kind, "robot1.*", episode=1, end_episode=2, end_step=2))
    healthy, first = episode(ill), episode(ill, number=1)
    np.testing.assert_array_equal(episode(scenario(), number=0), healthy)
    np.testing.assert_array_equal(episode(ill, number=1), first)
    assert not np.array_equal(episode(scenario(), number=1), first)
    np.testing.assert_array_equal(episode(ill, number=3), episode(scenario(), number=3))
    np.testing.assert_array_equal(ill.world._grip, 1.0)


def test_noise_follows_from_the_seed_of_the_episode() -> None:
    ill = scenario(failure("noisy", "*"), start="easy")
    runs = [episode(ill, seed=s, number=n) for s, n in ((1, 0), (1, 1), (2, 0))]
    starts = {run[0].tobytes() for run in runs}
    assert len(starts) == 3
    alone = [failures(failure("noisy", "*")) for _ in range(2)]
    alone[0].begin(world_seed(1, 0), 0)
    alone[1].begin(world_seed(1, 1), 1)
    assert (alone[0].driven(np.zeros(4), 3) != alone[1].driven(np.zeros(4), 3)).all()
    # A further failure leaves the noise of the first alone.
    more = failures(failure("noisy", "*"), failure("noisy", "robot2.*"))
    more.begin(world_seed(1, 0), 0)
    alone[0].begin(world_seed(1, 0), 0)
    np.testing.assert_array_equal(
        more.driven(np.zeros(4), 3)[:, :2], alone[0].driven(np.zeros(4), 3)[:, :2]
    )


def test_agents_see_their_commands_and_pictures_the_failure() -> None:
    ill = scenario(failure("seized", "robot1.left", step=2))
    ill.reset(0)
    own = [v.name for v in ill.state_space.own]
    assert own == ["wheel_speed"]
    for step in range(4):
        transition = ill.step(np.zeros(4, dtype=int))
        np.testing.assert_array_equal(transition.states[0, 0], transition.states[1, 0])
        assert transition.info["failed"].tolist() == [step >= 2, False, False, False]
    assert transition.info["wheel_speeds"][0] == ill.robot.max_speed


def test_contact_time_is_that_of_the_whole_decision_period() -> None:
    healthy, ill = scenario(start="easy"), scenario(failure("stuck", "*", speed=1.0), start="easy")
    for world in (healthy, ill):
        world.reset(3)
    ahead = np.zeros(4, dtype=int)
    told = [healthy.step(ahead).info["contact_time"] for _ in range(8)]
    stuck = [ill.step(ahead).info["contact_time"] for _ in range(8)]
    assert any((0 < time[0] < 1) for time in (*told, *stuck))
    assert all(((time >= 0) & (time <= 1)).all() for time in stuck)
