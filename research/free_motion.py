"""What failures do to a robot that nothing hinders: ``python -m research.free_motion``.

A robot is told to go ahead with its wheels at slightly different speeds, and its first wheel fails.
Its twist after 40 control periods is held against theory: the speeds of wheels turn into a twist by
the nominal effect of the robot, in which a failure changes one column. A free wheel leaves an
equation of motion, solved by a matrix exponential. What delays and noise do is not a twist; they
are measured by the way a robot makes with both sides failing.
"""

from typing import Any

import numpy as np
from pydantic import TypeAdapter
from scipy.linalg import expm

from nested_agents.boxes import (
    BOXES,
    CONTROL_PERIOD,
    ROBOTS,
    Failure,
    Failures,
    RobotSettings,
    World,
    nominal_effect,
)

PERIODS, SPEED = 40, 0.04
COLUMN = {"none": 1.0, "seized": 0.0, "weak": 0.3, "reversed": -1.0, "stuck": 0.0}
"""What multiplies the column of the failed wheel; a stuck wheel adds a constant."""
NOISY_SEEDS, NOISY_PERIODS = 1000, 10


def commands_of(robot: RobotSettings) -> Any:
    """Return the commanded wheel speeds [m/s]."""
    return np.linspace(0.75, 1.0, len(robot.wheels)) * SPEED


def driven(robot: RobotSettings, failure: dict[str, Any] | None) -> Any:
    """Return the twist, in the robot's frame, that the world shows [m/s, m/s, rad/s]."""
    world, ill = start(robot, failure)
    for held in ill.driven(commands_of(robot), PERIODS):
        world.advance(held, 1)
    (vx, vy, omega), heading = world.twists[1], world.robot_poses[0, 2]
    cos, sin = np.cos(heading), np.sin(heading)
    return np.array([cos * vx + sin * vy, cos * vy - sin * vx, omega])


def start(robot: RobotSettings, failure: dict[str, Any] | None) -> tuple[World, Failures]:
    """Return a robot far from any box, and its failure."""
    world = World([robot], BOXES["square"])
    world.place(np.array([[-2.0, 0.0, 0.0]]), np.zeros(3))
    agents = [f"robot1.{name}" for name in robot.wheel_names]
    settings = [] if failure is None else [TypeAdapter(Failure).validate_python(failure)]
    ill = Failures(settings, agents, np.full(len(agents), robot.max_speed))
    world.set_grip(ill.grip)
    return world, ill


def expected(robot: RobotSettings, kind: str) -> Any:
    """Return the twist that theory gives."""
    effect = nominal_effect(robot)
    if kind == "free":
        return freely(robot)
    if kind == "stuck":
        effect[:, -1] = 0.5 * robot.max_speed * effect[:, 0]
    effect[:, 0] *= COLUMN[kind]
    return effect @ np.append(commands_of(robot), 1.0)


def freely(robot: RobotSettings) -> Any:
    """Return the twist with the first wheel free: of M v' = B u - K v, from rest."""
    resistance, drive = np.zeros((3, 3)), np.zeros((3, len(robot.wheels)))
    for w, wheel in enumerate(robot.wheels):
        jacobian = np.array([[1.0, 0.0, -wheel.y], [0.0, 1.0, wheel.x]])
        ahead = robot.stiffness * (w > 0)
        resistance += jacobian.T @ np.diag([ahead, robot.lateral_stiffness]) @ jacobian
        drive[:, w] = ahead * jacobian[0]
    mass = np.diag([robot.mass, robot.mass, robot.inertia])
    system = np.zeros((6, 6))
    system[:3, :3] = -np.linalg.solve(mass, resistance)
    system[:3, 3:] = np.diag(np.linalg.solve(mass, drive @ commands_of(robot)))
    return expm(system * PERIODS * CONTROL_PERIOD)[:3, 3:].sum(axis=1)


def ways(robot: RobotSettings, failure: dict[str, Any], periods: int, seeds: int) -> Any:
    """Return how far the robot comes straight ahead, seed by seed [m]."""
    world, ill = start(robot, failure)
    result = []
    for seed in range(seeds):
        world.place(np.array([[-2.0, 0.0, 0.0]]), np.zeros(3))
        ill.begin(seed, 0)
        for held in ill.driven(np.full(len(robot.wheels), SPEED), periods):
            world.advance(held, 1)
        result.append(world.robot_poses[0, 0] + 2.0)
    return np.array(result)


def table(robot: RobotSettings) -> None:
    """Print a table in Markdown."""
    print(f"| {robot.name} | ahead [mm/s] | theory | yaw rate [rad/s] | theory |")
    print("|---|---|---|---|---|")
    for kind in (*COLUMN, "free"):
        wheel = f"robot1.{robot.wheel_names[0]}"
        failure = None if kind == "none" else {"kind": kind, "wheels": wheel}
        seen, theory = driven(robot, failure), expected(robot, kind)
        print(
            f"| {kind} | {1000 * seen[0]:.1f} | {1000 * theory[0]:.1f} "
            f"| {round(seen[2], 3) + 0.0:.3f} | {round(theory[2], 3) + 0.0:.3f} |"
        )
    print()


def main() -> None:
    """Print the tables, and what delays and noise do."""
    for name in ("e-puck", "four-wheel"):
        table(ROBOTS[name])
    robot = ROBOTS["e-puck"]
    healthy = {"kind": "delayed", "wheels": "*", "episode": 1}  # not in this episode
    late = {"kind": "delayed", "wheels": "*", "periods": 8}
    lost = (ways(robot, healthy, PERIODS, 1) - ways(robot, late, PERIODS, 1))[0]
    print(f"delayed by 8: {1000 * lost:.2f} mm less", end="; ")
    print(f"theory {1000 * 8 * CONTROL_PERIOD * SPEED:.2f} mm")
    noisy = ways(robot, {"kind": "noisy", "wheels": "*"}, NOISY_PERIODS, NOISY_SEEDS)
    # The path of each wheel deviates by a sum of independent errors, their mean by less.
    spread = 0.3 * robot.max_speed * CONTROL_PERIOD * np.sqrt(NOISY_PERIODS / len(robot.wheels))
    print(f"noisy 0.3: a way of {1000 * noisy.mean():.1f} +- {1000 * noisy.std():.1f} mm", end="; ")
    print(f"theory {1000 * NOISY_PERIODS * CONTROL_PERIOD * SPEED:.1f} +- {1000 * spread:.1f} mm")


if __name__ == "__main__":
    main()
