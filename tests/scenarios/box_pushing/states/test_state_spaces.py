"""State variables worked out by hand, and their mirror images."""

from math import pi

import numpy as np
import pytest
from variables_oracle import batch_of

from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.states.situations import SituationBatch
from nested_agents.scenarios.box_pushing.states.state_spaces import (
    STATE_SPACES,
    state_space_for,
)
from nested_agents.scenarios.box_pushing.states.variables import STATE_VARIABLES
from nested_agents.scenarios.box_pushing.world.boxes import BOXES

GOAL = np.array([1.0, 0.0, 0.0])
SQUARE = BOXES["square"].shape
ORIGIN = np.array([[-0.03, 0.0, 0.0]])


def situation(robots, box, gaps) -> SituationBatch:
    described = np.array([robots], float), np.array([box], float), np.array([gaps], float)
    return batch_of(*described, GOAL, ORIGIN, 3.0, SQUARE)


def shared(batch: SituationBatch, robot: int) -> dict[str, float]:
    return dict(zip(VARIABLES, EVERY.shared(batch, [robot])[0][0], strict=True))


VARIABLES = tuple(STATE_VARIABLES.built_in)
EVERY = state_space_for(VARIABLES)


@pytest.mark.parametrize("name", STATE_SPACES)
def test_functions_fill_the_space_they_describe(name: str) -> None:
    spec = state_space_for(name)
    poses = np.random.default_rng(0).uniform(-1, 1, (5, 2, 3))
    batch = batch_of(poses, poses[:, 0], np.abs(poses[:, :, 0]), GOAL, ORIGIN, 1.0, SQUARE)
    assert spec.space.n_own == 1
    assert spec.shared(batch, [1])[0].shape == (5, spec.space.n_variables - spec.space.n_own)


def test_relational_variables_by_hand() -> None:
    # The box 1 m before the goal, robot 1 straight behind it, robot 2 on its left, facing it.
    batch = situation([[-0.2, 0.0, 0.1], [0.0, 0.2, -pi / 2]], [0.0, 0.0, 0.3], [0.06, 0.08])
    first = shared(batch, 0)
    assert (first["gap"], first["others_gap"], first["box_distance"]) == (0.06, 0.08, 1.0)
    assert first["box_bearing"] == pytest.approx(-0.1)
    assert first["side"] == pytest.approx(0.0)
    # Their middle is behind on the left and pushes to the right.
    assert first["push_bearing"] == pytest.approx(-pi / 4)
    assert first["cross_track_error"] == pytest.approx(-np.sqrt(0.5))
    assert first["approach"] == pytest.approx(0.01)  # 3 cm in three periods
    assert first["box_turn"] == first["bend"] == pytest.approx(0.3)  # straight ahead
    second = shared(batch, 1)
    assert second["box_bearing"] == pytest.approx(0.0)
    assert second["side"] == pytest.approx(-pi / 2)


def test_variables_of_crowds_by_hand() -> None:
    # A square of 20 cm, turned by 0.3; robot 1 touches its back, low on it, robot 2 is far away.
    turn = np.array([np.cos(0.3), np.sin(0.3)])
    left = np.array([-turn[1], turn[0]])
    low = -(0.1 + 1e-9) * turn - 0.08 * left  # just outside
    batch = situation([[*low, 0.1], [0.0, 0.9, -pi / 2]], [0.0, 0.0, 0.3], [0.0, 0.77])
    first = shared(batch, 0)
    assert first["face_bearing"] == pytest.approx(0.2)
    assert first["others_away"] == 1.0
    second = shared(batch, 1)
    assert second["others_away"] == 0.0
    # Nearly all of the push is that of the robot in contact.
    alone = np.arctan2(*-low[::-1])
    assert first["contact_push_bearing"] == pytest.approx(alone, abs=0.005)
    assert second["contact_push_bearing"] == first["contact_push_bearing"]
    assert first["contact_cross_track_error"] == pytest.approx(np.sin(alone), abs=0.005)


def test_common_variables_are_the_same_for_all_robots() -> None:
    rng = np.random.default_rng(0)
    poses = rng.normal(size=(20, 5, 3))
    gaps = rng.normal(size=(20, 5))
    batch = batch_of(poses, poses[:, 0].copy(), gaps, GOAL, ORIGIN, 3.0, SQUARE)
    blocks = dict(enumerate(EVERY.shared(batch, [r])[0] for r in range(5)))
    for column, name in enumerate(VARIABLES):
        alike = all((blocks[r][:, column] == blocks[0][:, column]).all() for r in range(5))
        assert alike == (name in EVERY.space.common), name


def test_a_push_away_from_the_goal_misses_it_by_the_whole_distance() -> None:
    batch = situation([[0.2, 0.1, 0.0]], [0.0, 0.0, 0.0], [0.06])
    assert shared(batch, 0)["cross_track_error"] == pytest.approx(-1.0, rel=1e-15)


def test_the_arc_to_the_goal_pose_bends_twice_as_far_as_the_course() -> None:
    # 45 degrees to the left of the way to the goal: an arc begins at right angles to it.
    batch = situation([[0.0, 0.0, 0.0]], [0.0, 1.0, -pi / 2], [0.06])
    assert shared(batch, 0)["bend"] == pytest.approx(0.0)


def test_a_single_robot_has_no_others() -> None:
    alone = shared(situation([[-0.2, 0, 0]], [0, 0, 0], [0.06]), 0)
    assert alone["others_gap"] == alone["gap"] == 0.06
    assert alone["others_away"] == 1.0


def test_equation_1_by_hand() -> None:
    # The robot looks west; the goal (1, 0) is 2 m north of it, the box 3 m west.
    batch = situation([[1.0, -2.0, pi]], [-2.0, -2.0, 0.3], [0.1])
    of_box = [0.3, np.arctan2(2.0, 3.0) - 0.3, np.hypot(2.0, 3.0)]
    found = state_space_for("paper").shared(batch, [0])[0][0]
    np.testing.assert_allclose(found, [-pi, -pi / 2, 2.0, *of_box], atol=1e-12)
    found = state_space_for("paper-box").shared(batch, [0])[0][0]
    np.testing.assert_allclose(found, [-pi, 0.0, 3.0, *of_box], atol=1e-12)


def test_mirrored_worlds_have_mirrored_angles() -> None:
    rng = np.random.default_rng(2)
    robots, box = rng.uniform(-1, 1, (2, 3)), rng.uniform(-0.5, 0.5, 3)
    flip = np.array([1.0, -1.0, -1.0])
    for robot in (0, 1):
        seen = EVERY.shared(situation(robots, box, [0.1, 0.2]), [robot])[0][0]
        batch = situation(robots * flip, box * flip, [0.1, 0.2])
        mirrored = EVERY.shared(batch, [robot])[0][0]
        signs = [1 if each.mirrored == "same" else -1 for each in EVERY.space.shared]
        np.testing.assert_allclose(mirrored, seen * signs, atol=1e-12)


@pytest.mark.parametrize("name", STATE_SPACES)
def test_memberships_of_wheel_speeds_span_those_of_the_robot(name: str) -> None:
    fast, plain = state_space_for(name, 0.39).space, state_space_for(name).space
    for variable, like in zip(fast.variables, plain.variables, strict=True):
        if variable.name != "wheel_speed":
            assert variable == like
        else:
            assert (variable.low, variable.high) == pytest.approx((-0.39, 0.39))
            assert variable.centers == pytest.approx(np.multiply(3, like.centers))
            assert variable.labels == like.labels


def test_a_fast_robot_gets_them() -> None:
    wheels = [{"name": "a", "x": 0, "y": 0.02}, {"name": "b", "x": 0, "y": -0.02}]
    settings = BoxPushingSettings.model_validate({"robot": {"wheels": wheels, "max_speed": 0.26}})
    scenario = BoxPushing(settings)
    assert scenario.state_space.own[0].high == pytest.approx(0.26)
    scenario.reset(0)
    ahead = np.zeros(4, dtype=int)
    states = [scenario.step(ahead).states for _ in range(3)][-1]
    assert states[:, 0].max() == 0.26


@pytest.mark.parametrize(
    ("names", "complaint"),
    [
        (("gap", "mass"), "scenario.state_space: 'mass': .*known: approach, "),
        (("gap", "gap"), r"scenario.state_space = \['gap', 'gap'\]: variables must be distinct"),
        ((), "at least one"),
    ],
)
def test_lists_that_make_no_state_space_are_refused(names: tuple[str, ...], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        BoxPushing(BoxPushingSettings(state_space=names))


def test_a_state_space_may_be_listed() -> None:
    scenario = BoxPushing(BoxPushingSettings(state_space=("gap", "cross_track_error")))
    assert [v.name for v in scenario.state_space.variables] == [
        "wheel_speed",
        "gap",
        "cross_track_error",
    ]
    assert scenario.reset(0).shape == (4, 3)


MINE = """
import numpy as np
from nested_agents import state_variable

@state_variable("rad", -np.pi, np.pi, periodic=True)
def face(situation, robot):
    return np.remainder(situation.course - situation.box[2] + np.pi, 2 * np.pi) - np.pi

@state_variable("m", 0.0, 0.5)
def gap(situation, robot):
    return robot.gap + 1.0

number = 3
"""


def test_variables_of_users_stand_beside_compiled_ones() -> None:
    with Sources(texts={"mine.py": MINE}).active():
        names = ("mine.py:face", "cross_track_error", "mine.py:gap")
        scenario = BoxPushing(BoxPushingSettings(state_space=names))
    space = scenario.state_space
    assert [v.name for v in space.shared] == ["face", "cross_track_error", "gap"]
    assert space.bounds[1:].tolist() == [[-pi, pi], [-np.inf, np.inf], [-np.inf, np.inf]]
    sensed = scenario.reset(0)
    plain = BoxPushing(BoxPushingSettings(state_space=("gap", "cross_track_error")))
    expected = plain.reset(0)
    np.testing.assert_array_equal(sensed[:, 2:], expected[:, [2, 1]] + [0.0, 1.0])
    joint = np.random.default_rng(0).integers(4, size=(70, 4))
    for agent in range(4):
        predicted = scenario.predict().states(agent, joint)
        expected = plain.predict().states(agent, joint)
        np.testing.assert_array_equal(predicted[:, 2:], expected[:, [2, 1]] + [0.0, 1.0])
        assert (np.abs(predicted[:, 1]) <= pi).all()


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        (
            "mine.py:number",
            "scenario.state_space: 'mine.py:number': is of type int, allowed: state variable",
        ),
        ("mine.py:nothing", "scenario.state_space: 'mine.py:nothing': .* has no 'nothing'"),
        ("other.py:gap", "scenario.state_space: 'other.py:gap': "),
        ("gapp", "scenario.state_space: 'gapp': did you mean 'gap'?"),
    ],
)
def test_what_is_no_state_variable_is_refused_in_one_line(name: str, complaint: str) -> None:
    sources = Sources(texts={"mine.py": MINE})
    with sources.active(), pytest.raises(ValueError, match=complaint) as error:
        BoxPushing(BoxPushingSettings(state_space=(name,)))
    assert "\n" not in str(error.value)


def test_a_function_of_a_user_is_checked_whatever_its_name() -> None:
    text = """
from nested_agents import state_variable

@state_variable("m", 0.0, 1.0)
def gap(situation, robot):
    return situation.box
"""
    with Sources(texts={"mine.py": text}).active():
        space = state_space_for(("mine.py:gap",))
    with pytest.raises(ValueError, match="state variable 'gap': shape"):
        space.shared(situation([[-0.2, 0, 0]], [0, 0, 0], [0.06]), [0])


@pytest.mark.parametrize(
    ("returned", "complaint"),
    [
        ("situation.box", r"state variable 'wrong': shape \(3, \d+\), must be \(\d+,\)"),
        ("robot.x[:2]", r"state variable 'wrong': shape \(2,\), must be \(5,\)"),
        ("1.0", r"state variable 'wrong': shape \(\), must be \(\d+,\)"),
        ("situation.distance + np.nan", "'wrong': not all of its values are finite numbers"),
        ("situation.distance.astype(str)", "not all of its values are finite numbers"),
        ("np.add(situation.box[0], 1.0, out=situation.box[0])", "read-only"),
        ("np.add(robot.gap, 1.0, out=robot.gap)", "read-only"),
        ("np.add(situation.distance, 1.0, out=situation.distance)", "read-only"),
    ],
)
def test_what_functions_of_users_return_is_checked(returned: str, complaint: str) -> None:
    text = f"""
import numpy as np
from nested_agents import state_variable

@state_variable("m", 0.0, 1.0)
def wrong(situation, robot):
    return {returned}
"""
    with Sources(texts={"wrong.py": text}).active():
        space = state_space_for(("gap", "wrong.py:wrong"))
    poses = np.random.default_rng(0).normal(size=(5, 2, 3))
    gaps = np.abs(poses[:, :, 0])
    batch = batch_of(poses, poses[:, 0].copy(), gaps, GOAL, ORIGIN, 1.0, SQUARE)
    with pytest.raises(ValueError, match=complaint) as error:
        space.shared(batch, [0, 1])
    assert "\n" not in str(error.value)
