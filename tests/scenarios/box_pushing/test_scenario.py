"""The box-pushing scenario: episodes, their ends, and any number of robots."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.abilities import Animated
from nested_agents.core.interface.measures import measures_of
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.models.self_model import SelfModelSettings
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.prediction.twists import mean_twists
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.topologies import build, parse


@pytest.mark.parametrize("robots", [1, 2, 3, 4])
@pytest.mark.parametrize("space", ["paper", "relational"])
def test_teams_of_one_to_four_robots_act_and_learn(robots: int, space: str) -> None:
    scenario = BoxPushing(BoxPushingSettings(robots=robots, state_space=space))
    hierarchy = build(parse("chain"), scenario.agents)
    team = Team(BatchTDSettings(), scenario, hierarchy, policy_seed(0))
    for record in control_loop(scenario, team, episodes=1, steps=4, seed=0):
        assert record.states.shape == (2 * robots, scenario.state_space.n_variables)
        assert np.isfinite(record.transition.states).all()
    assert np.any(fuzzy(team).learner.theta != 0)


def test_equal_seeds_give_equal_episodes() -> None:
    def episode(seed: int) -> np.ndarray:
        scenario = BoxPushing(BoxPushingSettings())
        scenario.reset(seed)
        actions = np.random.default_rng(0).integers(4, size=(10, 4))
        return np.array([scenario.step(joint).states for joint in actions])

    np.testing.assert_array_equal(episode(5), episode(5))
    assert np.any(episode(5) != episode(6))


@pytest.mark.parametrize(("apart", "first"), [(0.3, 0), (0.072, 1)])
def test_twists_are_those_of_their_step_whenever_they_are_asked_for(
    apart: float, first: int
) -> None:
    scenario = BoxPushing(BoxPushingSettings())
    scenario.reset(0)
    scenario.world.place(np.array([[0.0, 0.0, 0.4], [0.0, apart, 0.4]]), np.array([0.5, 0, 0.1]))
    before = scenario.world.poses.copy()
    transition = scenario.step(np.array([0, 2, 0, 2]))
    after = scenario.world.poses.copy()
    scenario.step(np.zeros(4, int))
    expected = mean_twists(before, after, scenario.settings.period)[first:]
    np.testing.assert_array_equal(transition.measured_twists(), expected)
    assert np.any(expected[1 - first] != 0.0)


def with_box_at(x: float, settings: BoxPushingSettings) -> BoxPushing:
    scenario = BoxPushing(settings)
    scenario.reset(0)
    scenario.world.place(np.array([[x - 0.3, 0.1, 0.0], [x - 0.3, -0.1, 0.0]]), np.array([x, 0, 1]))
    return scenario


def test_the_goal_ends_the_episode_and_tells_whether_the_box_stays() -> None:
    end = with_box_at(0.97, BoxPushingSettings()).step(np.full(4, 3))
    assert end.terminated
    assert not end.truncated
    assert end.info["stopped_at_goal"]


def test_a_turned_box_is_not_there_if_orientation_counts() -> None:
    settings = BoxPushingSettings(orientation_tolerance=0.26)
    assert not with_box_at(0.97, settings).step(np.full(4, 3)).terminated


def test_an_episode_is_broken_off_when_the_box_leaves_the_arena() -> None:
    end = with_box_at(-0.6, BoxPushingSettings()).step(np.full(4, 3))
    assert end.truncated
    assert not end.terminated


def test_wheel_speeds_follow_the_actions() -> None:
    scenario = BoxPushing(BoxPushingSettings(speed_increment=0.5))
    scenario.reset(0)
    top = scenario.robot.max_speed
    for joint, expected in (
        ([0, 0, 1, 2], [0.5, 0.5, -0.5, 0.0]),
        ([0, 2, 1, 3], [1.0, 0.5, -1.0, 0.0]),
        ([0, 3, 1, 0], [1.0, 0.0, -1.0, 0.5]),
    ):
        info = scenario.step(np.array(joint)).info
        np.testing.assert_allclose(info["wheel_speeds"], np.array(expected) * top)


def test_a_team_finds_out_that_a_wheel_has_seized() -> None:
    failure = {"kind": "seized", "wheels": ["robot1.front-left"]}
    scenario = BoxPushing(BoxPushingSettings(robot="four-wheel", robots=1, failures=[failure]))
    hierarchy = build(parse("chain"), scenario.agents)
    settings = BatchTDSettings(
        self_model=SelfModelSettings(enabled=True), decision=DecisionSettings(rule="random")
    )
    team = Team(settings, scenario, hierarchy, policy_seed(0))
    for _ in control_loop(scenario, team, episodes=2, steps=40, seed=0):
        pass
    found, nominal = (
        fuzzy(team).model.self_model.effects[0][0, :4],
        scenario.nominal_effects[0][0, :4],
    )
    assert abs(found[0]) < 0.3 * nominal[0]
    assert (found[1:] > 0.5 * nominal[1:]).all()


def test_it_is_registered_and_its_settings_need_no_physics() -> None:
    assert SCENARIOS.model("box-pushing") is BoxPushingSettings
    assert isinstance(SCENARIOS.parsed("box-pushing").build(), BoxPushing)
    code = "import sys, nested_agents.scenarios.box_pushing.config\n"
    code += "assert not {'numba', 'Box2D', 'shapely', 'scipy'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_an_episode_is_told_by() -> None:
    scenario = with_box_at(0.97, BoxPushingSettings())
    names = ["success", "stopped_at_goal", "final_distance_m", "contact_fraction"]
    assert [measure.name for measure in measures_of(scenario.measures)] == names
    assert not scenario.measure()["stopped_at_goal"]
    scenario = with_box_at(0.7, BoxPushingSettings())
    info = scenario.step(np.full(4, 3)).info
    assert info["stopped_at_goal"] is False
    assert info["orientation_error_deg"] == np.degrees(abs(info["orientation_rad"]))
    assert info["contact_fraction"] == np.mean(info["contact_time"])


def test_the_role_of_an_agent_is_its_wheel() -> None:
    assert BoxPushing(BoxPushingSettings()).roles == ("left", "right", "left", "right")


def test_it_can_be_recorded_drawn_and_predicted_exactly(tmp_path: Path) -> None:
    scenario = BoxPushing(BoxPushingSettings(action_repeat=4, belief={"load": 2.0}))
    assert isinstance(scenario, Animated)
    exact = scenario.with_exact_prediction().settings
    assert (exact.predictor, exact.prediction_horizon, exact.action_repeat) == ("exact", 4, 4)
    assert BoxPushingSettings.model_validate(exact.model_dump()) == exact
    scenario.reset(0)
    frames = [scenario.measure(), scenario.step(np.zeros(4, int)).info]
    recording = {name: np.stack([f[name] for f in frames]) for name in scenario.recorded}
    constants = scenario.constants_of_episode()
    assert set(constants) == {"goal_pose", "dt", "robot", "box", "infrared"}
    recording |= {name: np.array(value) for name, value in constants.items()}
    scenario.animate(recording, tmp_path / "episode.gif")
    assert (tmp_path / "episode.gif").stat().st_size > 1000


def test_an_environment_can_be_drawn_before_anything_runs(tmp_path: Path) -> None:
    scenario = BoxPushing(BoxPushingSettings(robots=3, box="L"))
    scenario.draw(tmp_path / "start.png")
    assert (tmp_path / "start.png").read_bytes().startswith(b"\x89PNG")


def test_a_task_in_units_of_the_box() -> None:
    fixed, similar = (
        BoxPushingSettings(robots=8, scaling=scaling).build() for scaling in ("fixed", "similar")
    )
    for scenario in (fixed, similar):
        scenario.reset(0)
    near, far = fixed.measure(), similar.measure()
    assert near["distance_m"] == pytest.approx(1.0)
    assert far["distance_m"] == pytest.approx(4.0)
    assert similar.task.tolerance == pytest.approx(4 * fixed.task.tolerance)
    assert similar.task.r1 == pytest.approx(fixed.task.r1 / 4)
    # 2 m further from the goal the fixed task is broken off, the similar one is not yet.
    for scenario, expected in ((fixed, True), (similar, False)):
        box = scenario.measure()["goal_pose"] - [3.0, 0.0, 0.0]
        robots = box + np.column_stack([np.full(8, -0.5), np.linspace(0.35, -0.35, 8), np.zeros(8)])
        scenario.world.place(robots, box)
        assert scenario.step(np.full(16, 2)).truncated is expected


@pytest.mark.parametrize("robots", [1, 2])
def test_up_to_two_robots_there_is_one_scaling(robots: int) -> None:
    states = [
        BoxPushingSettings(robots=robots, scaling=scaling).build().reset(4)
        for scaling in ("fixed", "similar")
    ]
    np.testing.assert_array_equal(*states)


@pytest.mark.parametrize("leader", ["none", "rule"])
def test_orientation_is_a_measure_only_where_the_task_asks_for_it(leader: str) -> None:
    settings = {"robots": 2, "leader": {"policy": leader}}
    for tolerance, expected in ((None, False), (0.26, True)):
        scenario = BoxPushingSettings(**settings, orientation_tolerance=tolerance).build()
        names = [measure.name for measure in scenario.measures]
        assert ("final_orientation_deg" in names) is expected
        assert ("options" in names) is (leader == "rule")
