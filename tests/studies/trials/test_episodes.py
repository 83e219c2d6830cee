"""What is measured of an episode, and what of several scenarios; frames of a recording."""

import json

import numpy as np
import pytest

from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.core.interface.recording import EpisodeRecorder
from nested_agents.core.interface.scenario import Transition
from nested_agents.scenarios.box_pushing.scenario import MEASURES
from nested_agents.studies.errors import SpecError
from nested_agents.studies.store.database import columns, measures_from, tables
from nested_agents.studies.trials.episodes import EpisodeMeter, EpisodeRow, join_measures

ENERGY = Measure("energy_j", "energy", "J", "joules", "sum", "lower")


def test_scenarios_share_columns_that_mean_the_same():
    titled = Measure("energy_j", "work", "J", "watts", "sum")
    assert join_measures([(SUCCESS,), (SUCCESS, ENERGY), (titled,)]) == (SUCCESS, ENERGY)
    assert columns((SUCCESS, ENERGY)) == (
        "phase", "episode", "steps", "success", "energy_j", "return",
    )  # fmt: skip


@pytest.mark.parametrize(
    "other",
    [
        Measure("energy_j", "energy", "kJ", "joules", "sum"),
        Measure("energy_j", "energy", "J", "joules", "mean"),
        Measure("energy_j", "energy", "J", "joules", "sum", is_rate=True),
        Measure("Energy_J", "energy", "J", "joules", "sum"),
    ],
)
def test_one_name_for_two_things_is_refused(other):
    with pytest.raises(SpecError, match="is declared as") as caught:
        join_measures([(ENERGY,), (other,)])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["steps", "Return", "seed", "identity", "scenario.robots"])
def test_names_of_other_columns_are_refused(name):
    with pytest.raises(SpecError, match="is the name of another column"):
        join_measures([(SUCCESS, Measure(name, "a measure"))], ["scenario.robots"])


def test_measures_can_be_written_down():
    assert measures_from(json.loads(json.dumps(tables((SUCCESS, ENERGY))))) == (SUCCESS, ENERGY)
    with pytest.raises(TypeError):
        measures_from([{"color": "red"}])


def transition(reward=0.5, terminated=False, **info):
    measured = {
        "distance_m": 0.3, "contact_fraction": 0.75,
        "stopped_at_goal": False,
        "robot_poses": np.zeros((2, 3)), "box_pose": np.ones(3), "goal_pose": np.ones(3),
        "wheel_speeds": np.zeros(4), "contact": np.array([True, False]),
        "failed": np.zeros(4, dtype=bool),
    }  # fmt: skip
    return Transition(np.zeros((4, 7)), reward, terminated, False, measured | info)


def test_an_episode_is_summed_up_by_hand():
    meter = EpisodeMeter("training", 3, MEASURES)
    last = transition(0.25, terminated=True, contact_fraction=0.25)
    for step in (transition(0.5), last):
        meter.add(step)
    assert meter.row() == EpisodeRow(
        "training", 3, 2,
        {
            "success": True, "stopped_at_goal": False, "final_distance_m": 0.3,
            "contact_fraction": 0.5,
        },
        0.75,
    )  # fmt: skip


def test_stopping_at_the_goal_is_what_the_scenario_says():
    meter = EpisodeMeter("training", 0, MEASURES)
    meter.add(transition(terminated=True, stopped_at_goal=True))
    assert meter.row().measures["stopped_at_goal"] is True


@pytest.mark.parametrize(
    ("gathering", "is_rate", "expected"),
    [("last", False, -1.0), ("mean", False, -1.5), ("sum", False, -4.5), ("max", False, -0.5),
     ("max", True, True), ("last", True, True)],
)  # fmt: skip
def test_the_steps_of_an_episode_make_one_number(gathering, is_rate, expected):
    measure = Measure("x", "x", source="here", gathering=gathering, is_rate=is_rate)
    meter = EpisodeMeter("training", 0, [measure])
    for value in (-0.5, -3.0, np.float64(-1.0)):
        meter.add(transition(here=value))
    (value,) = meter.row().measures.values()
    assert value == expected
    assert type(value) is type(expected)


def test_agents_that_are_rewarded_one_by_one_return_their_mean():
    meter = EpisodeMeter("training", 0, [SUCCESS])
    for _ in range(2):
        meter.add(transition(np.array([1.0, 2.0])))
    assert meter.row().return_ == 3.0


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("nowhere", "measure 'x': its source 'nowhere' is not in the info of a step"),
        ("box_pose", "measure 'x': its source 'box_pose' must be one number at every step"),
    ],
)
def test_what_a_measure_is_not_taken_from_is_told(source, said):
    meter = EpisodeMeter("training", 0, [Measure("x", "x", source=source)])
    with pytest.raises(ValueError, match=said) as caught:
        meter.add(transition())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("what", [{"reward": np.nan}, {"distance_m": np.inf}, {"reward": -1e101}])
def test_what_is_not_finite_or_huge_fails_the_trial(what):
    meter = EpisodeMeter("training", 4, MEASURES)
    meter.add(transition(**what))
    with pytest.raises(FloatingPointError, match=r"= (nan|inf|-1e\+101) in training episode 4"):
        meter.row()


class Recorded:
    """What a recorder asks of a scenario."""

    recorded = ("box_pose", "contact")

    def measure(self):
        return transition().info

    def constants_of_episode(self):
        return {"dt": 0.5, "box": "square"}

    def animate(self, recording, path):
        raise NotImplementedError


def test_frames_are_copies():
    recorder = EpisodeRecorder(Recorded())
    step = transition()
    recorder.add(step)
    step.info["box_pose"][:] = 9.0
    recording = recorder.recording()
    assert list(recording) == ["box_pose", "contact", "reward", "dt", "box"]
    assert (recording["box_pose"] == 1.0).all()
    assert recording["box_pose"].shape == (2, 3)
    assert float(recording["dt"]) == 0.5


def test_rewards_of_each_agent_are_recorded_one_by_one():
    recorder = EpisodeRecorder(Recorded())
    for _ in range(3):
        recorder.add(transition(np.array([1.0, 2.0])))
    assert recorder.recording()["reward"].shape == (3, 2)
