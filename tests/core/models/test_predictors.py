"""Mirrored experience: the image of a step is a step of the mirrored world."""

from itertools import pairwise

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.agents.loop import control_loop
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.models.predictors import Mirror
from nested_agents.core.values.rule_base import RuleBaseSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.world.settings import RobotSettings, WheelSettings
from nested_agents.scenarios.kinematic_chain.config import KinematicChainSettings

ACROSS = np.array([1.0, -1.0, -1.0])
"""What a mirror along the x axis does to a pose."""


def states(scenario, origin):
    """Return the present states of all agents; the box was at `origin` a period before."""
    return scenario.states_at(scenario._present(origin), scenario.commanded_speeds[None])[0]


@pytest.mark.parametrize("state_space", ["paper", "relational", "pose", "crowd", "wide"])
@pytest.mark.parametrize("robot", ["e-puck", "three-wheel", "four-wheel"])
def test_the_image_of_a_state_is_the_state_of_the_mirrored_world(
    state_space: str, robot: str
) -> None:
    scenario = BoxPushingSettings(robots=3, robot=robot, state_space=state_space).build()
    mirror = Mirror.of(scenario)
    scenario.reset(1)
    poses, box = scenario.world.robot_poses.copy(), scenario.world.box_pose.copy()
    scenario.commanded_speeds = np.linspace(-0.13, 0.13, len(scenario.agents))
    origin = box + np.array([-0.03, 0.01, 0.05])
    seen = states(scenario, origin)

    scenario.world.place(poses * ACROSS, box * ACROSS)
    scenario.goal = scenario.aim = scenario.goal * ACROSS
    scenario.commanded_speeds = scenario.commanded_speeds[mirror.partners]
    found = states(scenario, origin * ACROSS)[mirror.partners]
    off = found - mirror.states(seen)[len(seen) :]
    is_angle = [variable.periodic for variable in scenario.state_space.variables]
    off[:, is_angle] = np.angle(np.exp(1j * off[:, is_angle]))
    assert np.abs(off).max() < 1e-6  # Box2D reckons in single precision


def test_the_image_of_an_arm_turns_the_other_way() -> None:
    variables = ("bearing", "distance", "approach", "angle", "lever", "excess")
    scenario = KinematicChainSettings(joints=3, state_space=variables).build()
    mirror = Mirror.of(scenario)
    scenario.reset(0)
    scenario._speeds = np.array([0.2, -0.5, 0.1])

    def states() -> np.ndarray:
        return scenario.outcome(scenario._angles, scenario._speeds, scenario._goal, 0.9)[0][0]

    images = mirror.states(states())[3:]
    scenario._angles, scenario._speeds = -scenario._angles, -scenario._speeds
    scenario._goal = scenario._goal * [1.0, -1.0]
    np.testing.assert_allclose(states(), images, atol=1e-12)


def test_left_and_right_wheels_learn_the_same_function_in_the_mirror() -> None:
    scenario = BoxPushingSettings(robots=2, state_space="crowd").build()
    settings = BatchTDSettings(
        mirrored=True, weights="role", rule_base=RuleBaseSettings(order=1), interval=50
    )
    agents = scenario.agents
    chain = Hierarchy(agents, list(pairwise(agents)))
    team = Team(settings, scenario, chain, np.random.SeedSequence(0))
    list(control_loop(scenario, team, episodes=1, steps=12, seed=0))
    assert fuzzy(team).learner.theta.shape[0] == 2
    rng = np.random.default_rng(0)
    variables = scenario.state_space.variables
    states = rng.uniform(
        [v.low for v in variables], [v.high for v in variables], (50, len(variables))
    )
    rules = fuzzy(team).evaluator.problem.rules
    theta = fuzzy(team).learner.theta
    left = rules.values(theta[0], states)
    right = rules.values(theta[1], fuzzy(team).mirror.signs * states)
    assert np.abs(left).max() > 0
    np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-12)


def test_what_cannot_be_mirrored_is_refused() -> None:
    wheels = (
        WheelSettings(name="left", x=0.0, y=0.03),
        WheelSettings(name="right", x=0.0, y=-0.02),
    )
    lopsided = BoxPushingSettings(robot=RobotSettings(wheels=wheels)).build()
    with pytest.raises(ValueError, match=r"learner.mirrored: wheel 'left' .* no wheel opposite"):
        Mirror.of(lopsided)
