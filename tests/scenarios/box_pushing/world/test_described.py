"""Robots and boxes that a spec describes, and robots in number."""

import itertools

import numpy as np
import pytest

from nested_agents.core.agents.loop import world_seed
from nested_agents.core.plugins.settings import SettingsError
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS, robot_for
from nested_agents.scenarios.box_pushing.world.settings import BoxSettings, RobotSettings, label
from nested_agents.scenarios.checking.checker import check_scenario
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of

SPEC = """
preset = "frozen"
seeds = 1
episodes = 1
steps = 2
evaluation = 0

[scenario]
box = { vertices = [[0, 0], [0.3, 0], [0.3, 0.1], [0.1, 0.1], [0.1, 0.3], [0, 0.3]], mass = 0.3 }

[scenario.robot]
radius = 0.05
wheels = [{ name = "left", x = 0.0, y = 0.03 }, { name = "right", x = 0.0, y = -0.03 }]
"""


def test_an_e_puck_described_is_an_e_puck() -> None:
    wheels = tuple({"name": w.name, "x": w.x, "y": w.y} for w in ROBOTS["e-puck"].wheels)
    robot = robot_for(RobotSettings.model_validate({"name": "e-puck", "wheels": wheels}))
    assert robot == ROBOTS["e-puck"]


def test_a_spec_that_describes_its_box_and_robot_runs_and_can_be_drawn() -> None:
    spec = Spec.parse(SPEC)
    check_conditions(spec)
    settings = spec.conditions()[0].settings.scenario
    assert isinstance(settings.box, BoxSettings)
    assert "predictions" in check_scenario(lambda: BoxPushing(settings), steps=10).passed
    recording = run_trial(trials_of(spec)[0]).recordings["last"]
    from nested_agents.scenarios.box_pushing.pictures.rendering import picture

    assert picture(recording, 1).std() > 0
    assert Spec.of(spec.table()) == spec
    assert robot_for(label(settings.robot)) == robot_for(settings.robot)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ("scenario.box={vertices=[[0,0],[1,1],[1,0],[0,1]]}", "not a simple polygon"),
        ("scenario.box={vertices=[[0,0],[1,1]]}", "scenario.box.vertices"),
        ("scenario.box={vertices=[[0,0],[1,1],[0,1]], wait=1}", "scenario.box.wait"),
        ("scenario.box=3", "scenario.box = 3"),
        ("scenario.robot.wheels=[]", "scenario.robot.wheels"),
        ("scenario.robot.wheels=[{name='a', x=0, y=0.2}]", "within the body"),
        ("scenario.robot.wheels=[{name='a b', x=0, y=0.2}]", "wheels[0].name"),
        ("scenario.robot=tank", "scenario.robot = 'tank': known: e-puck"),
        ("scenario.box=egg", "scenario.box = 'egg': known: L"),
        ("scenario.robots=9", "do not fit side by side"),
        ("scenario.robot.mass=1e39", "scenario.robot.mass = 1e+39: must be at most 1000000000"),
        (
            "scenario.robot.traction=1e-40",
            "scenario.robot.traction = 1e-40: must be at least 0.00",
        ),
        ("scenario.robot.stiffness=1e300", "scenario.robot.stiffness = 1e+300: must be at most"),
        ("scenario.box.friction=1e39", "scenario.box.friction = 1e+39: must be at most 1000000"),
        ("scenario.box.mass=1e-46", "scenario.box.mass = 1e-46: must be at least 0.00"),
    ],
)
def test_refusals(change: str, complaint: str) -> None:
    with pytest.raises(SpecError) as error:
        check_conditions(Spec.parse(SPEC, [change]))
    assert complaint in str(error.value)


@pytest.mark.parametrize("wheels", [7, 14, 1000])
def test_robots_of_more_wheels_than_a_table_holds_are_refused_at_once(wheels: int) -> None:
    places = [{"name": f"w{i}", "x": 0.0, "y": 1e-5 * i} for i in range(wheels)]
    with pytest.raises(SpecError) as error:
        Spec.of({"scenario": {"robot": {"wheels": places}}})
    assert f"must have at most 6 items, not {wheels}" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("extreme", [1e-9, 1e9])
def test_the_least_and_the_greatest_quantities_can_be_simulated(extreme: float) -> None:
    changes = [f"scenario.robot.mass={extreme}", f"scenario.box.mass={1 / extreme}"]
    (trial,) = trials_of(Spec.parse(SPEC, changes))
    (row,) = run_trial(trial).rows
    assert all(np.isfinite(value) for value in row.measures.values())


def test_quantities_out_of_range_are_refused() -> None:
    with pytest.raises(SettingsError, match="mass"):
        BoxSettings(vertices=((0, 0), (1, 0), (0, 1)), mass=0.0)


@pytest.mark.parametrize("start", ["easy", "hard"])
@pytest.mark.parametrize("robots", [1, 2, 8, 64])
def test_robots_in_number_stand_free_of_each_other_and_of_the_box(robots: int, start: str) -> None:
    scenario = BoxPushing(BoxPushingSettings(robots=robots, start=start))  # type: ignore[arg-type]
    for number in range(3):
        scenario.reset(world_seed(5, number), number)
        places = scenario.measure()["robot_poses"][:, :2]
        assert (scenario.world.gaps > 0).all()
        for one, other in itertools.combinations(places, 2):
            assert np.hypot(*(one - other)) > 2 * scenario.robot.radius
    assert len(scenario.agents) == 2 * robots
    assert np.isfinite(scenario.step(np.zeros(2 * robots, dtype=int)).states).all()


def test_vertices_are_read_from_a_csv_file_beside_the_spec(tmp_path) -> None:
    (tmp_path / "outline.csv").write_text("x,y\n0,0\n0.3, 0\n\n0.3,0.2\n0,0.2\n")
    (tmp_path / "hole.csv").write_text("0.1,0.05\n0.2,0.05\n0.2,0.1\n")
    box = '{ vertices = "outline.csv", holes = ["hole.csv"], center_of_mass = [0.1, 0.1] }'
    path = tmp_path / "spec.toml"
    path.write_text(f"seeds = 1\n[scenario]\nbox = {box}\n")
    spec = Spec.load(path)
    settings = spec.conditions()[0].settings.scenario
    assert settings.box.vertices == ((0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.0, 0.2))
    assert settings.box.holes == (((0.1, 0.05), (0.2, 0.05), (0.2, 0.1)),)
    assert {*spec.sources.texts} == {"outline.csv", "hole.csv"}
    again = Spec.of(spec.table(), spec.sources)
    assert again.conditions()[0].settings.scenario == settings
    assert BoxPushing(settings).box.rings[0].min() == pytest.approx(-0.1)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("0,0\n1,0\n1,one\n", r"outline.csv:3: '1,one', must be two numbers x,y in meters"),
        ("x,y\n0,0\n1,0,2\n", r"outline.csv:3: '1,0,2', must be two numbers"),
        ("0,0\n1,0\n", "vertices"),
        ("0,0\n1,0\n1,nan\n", "vertices"),
        (None, "outline.csv: No such file"),
    ],
)
def test_a_csv_file_is_refused_in_one_line(text, complaint, tmp_path) -> None:
    if text is not None:
        (tmp_path / "outline.csv").write_text(text)
    path = tmp_path / "spec.toml"
    path.write_text('seeds = 1\n[scenario]\nbox = { vertices = "outline.csv" }\n')
    with pytest.raises(SpecError, match=complaint) as caught:
        Spec.load(path)
    assert "\n" not in str(caught.value)
    assert "scenario.box" in str(caught.value)
