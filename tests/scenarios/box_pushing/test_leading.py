"""The leader of box pushing: sides, waypoints, walking, and what it refuses."""

from math import cos, pi, sin

import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.leading import BoxOptions, LedBoxPushing
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.walking import Walk, sides_of
from nested_agents.scenarios.box_pushing.world.boxes import box_for
from nested_agents.studies.api.running import run
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import arrange


def led(**keys: object) -> LedBoxPushing:
    scenario = BoxPushingSettings(leader={"policy": "rule"}, **keys).build()
    assert isinstance(scenario, LedBoxPushing)
    return scenario


def test_the_sides_of_a_square_go_around_counterclockwise() -> None:
    sides = sides_of(box_for("square", 2))
    turns = np.diff([side.direction for side in sides], append=sides[0].direction)
    np.testing.assert_allclose(np.mod(turns, 2 * pi), pi / 2)
    for side in sides:
        assert side.half == pytest.approx(0.1)
        inward = np.array([cos(side.direction), sin(side.direction)])
        np.testing.assert_allclose(side.middle + 0.1 * inward, 0.0, atol=1e-9)


@pytest.mark.parametrize("degrees", [30, -30, 60])
def test_the_waypoint_is_the_foot_of_the_perpendicular_from_the_goal(degrees: float) -> None:
    scenario = led(robots=8)
    scenario.reset(3)
    options = scenario.options
    assert isinstance(options, BoxOptions)
    side = options._sides[options._side()]
    x, y, turn = scenario.world.box_pose
    straight = turn + side.direction
    direction = straight + np.radians(degrees)
    scenario.goal = scenario.aim = np.array(
        [x + 0.8 * cos(direction), y + 0.8 * sin(direction), 0.0]
    )
    assert options.observe() == pytest.approx([abs(np.radians(degrees)), 0.8])
    assert options.rule() == 1
    before = scenario.states_at_rest()
    states = options.begin(1)
    way = 0.8 * cos(np.radians(degrees))
    foot = [x + way * cos(straight), y + way * sin(straight)]
    np.testing.assert_allclose(scenario.aim[:2], foot)
    assert states.shape == before.shape
    assert not np.array_equal(states, before)
    assert options.joint_action() is None
    np.testing.assert_array_equal(options.begin(0), before)


@pytest.mark.parametrize(("box", "robots"), [("square", 8), ("L", 4), ("rectangle", 6)])
def test_robots_walk_to_the_next_side_and_stand_there(box: str, robots: int) -> None:
    scenario = led(robots=robots, box=box)
    scenario.reset(1)
    options = scenario.options
    assert isinstance(options, BoxOptions)
    first = options._side()
    sides = options._sides
    other = (first + 1) % len(sides)
    walk = Walk(scenario, sides[first], sides[other])
    pose = scenario.world.box_pose.copy()
    for _ in range(200):
        scenario.step(walk.joint_action())
        if walk.fraction_standing() >= 0.6:
            break
    assert walk.fraction_standing() >= 0.6
    assert options._side() == other
    assert np.hypot(*(scenario.world.box_pose - pose)[:2]) < 0.05


def test_a_goal_to_the_side_is_reached_by_two_pushes(tmp_path) -> None:
    spec = Spec.of({
        "preset": "hand-written", "seeds": 1, "episodes": 1, "evaluation": 6, "steps": 450,
        "scenario": {"robots": 8, "leader": {"policy": "rule"}},
    })  # fmt: skip
    table = run(spec, tmp_path, jobs=1).episodes
    rows = table[table["phase"] == "evaluation"]
    assert rows["success"].mean() >= 0.5
    assert rows["options"].max() > 1


LEARNS = {
    "seeds": 2, "episodes": 3, "evaluation": 2, "steps": 120, "preset": "hand-written",
    "scenario": {"robots": 2, "leader": {"policy": "learned", "limit": 30}},
    "evaluations": {"rule": {"leader": {"policy": "rule"}}},
}  # fmt: skip


def test_serial_and_parallel_runs_with_a_leader_are_equal(tmp_path) -> None:
    serial = run(Spec.of(LEARNS), tmp_path / "serial", jobs=1).episodes
    parallel = run(Spec.of(LEARNS), tmp_path / "parallel", jobs=2).episodes
    columns = ["seed", "phase", "episode", "steps", "return_", "options"]
    columns = [column for column in columns if column in serial]
    assert "options" in columns
    assert serial[columns].equals(parallel[columns])


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"scenario.box": "circle"}, "no sides"),
        ({"agents": "body"}, "agents: not"),
        ({"scenario.perception": [{"agents": "*", "noise": 0.1}]}, "scenario.perception"),
        ({"topology": {"failures": [{"kind": "lost", "agents": "*"}]}}, "topology.failures"),
        (
            {"scenario.leader": {"policy": "learned", "learner": {"mirrored": True}}},
            r"^scenario\.leader\.learner\.mirrored: ",
        ),
    ],
)
def test_what_does_not_go_with_a_leader_is_refused_in_one_line(keys: dict, words: str) -> None:
    spec = Spec.of(
        {
            "scenario": {"leader": {"policy": "rule"}},
        }
        | nested(keys)
    )
    (condition,) = spec.conditions()
    with pytest.raises(ValueError, match=words) as refused:
        arrange(condition.settings, 0)
    assert "\n" not in str(refused.value)


def nested(keys: dict) -> dict:
    """Return a table of the keys; keys of the scenario join the leader's."""
    scenario = {key.removeprefix("scenario."): keys[key] for key in keys if "scenario." in key}
    own = {key: keys[key] for key in keys if "scenario." not in key}
    return own | {"scenario": {"leader": {"policy": "rule"}} | scenario}


def test_a_leader_needs_a_team() -> None:
    with pytest.raises(ValueError, match=r"leader.policy = 'rule'.*team"):
        BoxPushing(BoxPushingSettings(leader={"policy": "rule"}))
