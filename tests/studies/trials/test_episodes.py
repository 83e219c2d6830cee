import numpy as np
import pytest

from nested_agents.core.protocols import Transition
from nested_agents.studies.trials.episodes import EpisodeMeter, EpisodeRecorder


def transition(reward=0.5, terminated=False, **info):
    measured = {
        "distance_m": 0.3, "orientation_rad": -0.2, "contact_time": np.array([0.5, 1.0]),
        "robot_poses": np.zeros((2, 3)), "box_pose": np.ones(3), "goal_pose": np.ones(3),
        "wheel_speeds": np.zeros(4), "contact": np.array([True, False]),
        "failed": np.zeros(4, dtype=bool),
    }  # fmt: skip
    return Transition(np.zeros((4, 7)), reward, terminated, False, measured | info)


def test_an_episode_is_summed_up_by_hand():
    meter = EpisodeMeter("training", 3)
    last = transition(0.25, terminated=True, contact_time=np.array([0.0, 0.5]))
    for step in (transition(0.5), last):
        meter.add(step)
    row = meter.row(last)
    assert row[:3] == ("training", 3, 2)
    assert (row.success, row.stopped_at_goal) == (True, False)
    assert (row.final_distance_m, row.final_orientation_rad) == (0.3, 0.2)
    assert (row.contact_fraction, row.return_) == (0.5, 0.75)


def test_stopping_at_the_goal_is_what_the_scenario_says():
    last = transition(terminated=True, stopped_at_goal=True)
    meter = EpisodeMeter("training", 0)
    meter.add(last)
    assert meter.row(last).stopped_at_goal is True


@pytest.mark.parametrize("what", [{"reward": np.nan}, {"distance_m": np.inf}])
def test_what_is_not_finite_fails_the_trial(what):
    last = transition(**what)
    meter = EpisodeMeter("training", 4)
    meter.add(last)
    with pytest.raises(FloatingPointError, match=r"= (nan|inf) in training episode 4"):
        meter.row(last)


def test_frames_are_copies():
    opening = transition().info
    recorder = EpisodeRecorder(opening)
    step = transition()
    recorder.add(step)
    step.info["box_pose"][:] = 9.0
    recording = recorder.recording(dt=0.5, box="square")
    assert (recording["box_pose"] == 1.0).all()
    assert recording["box_pose"].shape == (2, 3)
    assert float(recording["dt"]) == 0.5
