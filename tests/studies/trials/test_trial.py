"""A trial is a function of its content; what is measured of its episodes, and refused."""

import hashlib
import json
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from nested_agents.core.plugins.settings import changed_values
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.settings import InfraredSettings
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import RESULTS_VERSION
from nested_agents.studies.trials import trial as trial_module
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of

SHORT = {"seeds": [7], "episodes": 2, "steps": 6, "evaluation": 1}


def only(**table):
    (trial,) = trials_of(Spec.of(SHORT | table))
    return trial


@pytest.fixture(scope="module")
def result():
    return run_trial(only())


def equal(a, b):
    return a.rows == b.rows and all(
        np.array_equal(a.recordings[name][key], array)
        for name, recording in b.recordings.items()
        for key, array in recording.items()
    )


@pytest.mark.parametrize("preset", ["default", "random"])
def test_a_trial_is_a_function_of_its_content(preset):
    trial = only(preset=preset)
    assert equal(run_trial(trial), run_trial(pickle.loads(pickle.dumps(trial))))


def test_seeds_differ(result):
    assert not equal(result, run_trial(replace(only(), seed=8)))


def test_rows_are_training_then_evaluation(result):
    assert [(row.phase, row.episode) for row in result.rows] == [
        ("training", 0), ("training", 1), ("evaluation", 0),
    ]  # fmt: skip
    for row in result.rows:
        assert 1 <= row.steps <= 6
        assert 0.0 <= row.measures["contact_fraction"] <= 1.0
        assert row.measures["final_distance_m"] > 0.0


def test_conditions_of_equal_seed_meet_equal_worlds(result):
    other = run_trial(only(preset="random"))
    for name in ("first", "last"):
        for key in ("goal_pose", "box_pose", "robot_poses"):
            one, two = (r.recordings[name][key] for r in (result, other))
            start = ... if key == "goal_pose" else 0
            assert np.array_equal(one[start], two[start])


def test_a_recording_has_a_frame_for_every_step_and_the_beginning(result):
    recording = result.recordings["last"]
    steps = result.rows[1].steps
    assert all(len(recording[name]) == steps + 1 for name in BoxPushing.recorded)
    assert recording["reward"].shape == (steps, 4)
    assert recording["robot_poses"].shape == (steps + 1, 2, 3)
    assert recording["contact"].dtype == bool
    assert not recording["failed"].any()
    assert recording["wheel_speeds"].shape == (steps + 1, 4)
    assert (recording["wheel_speeds"][0] == 0.0).all()
    assert recording["reward"].mean(axis=1).sum() == pytest.approx(result.rows[1].return_)
    assert (str(recording["robot"]), str(recording["box"])) == ("e-puck", "square")
    infrared = InfraredSettings.model_validate_json(str(recording["infrared"]))
    assert infrared == InfraredSettings()
    assert float(recording["dt"]) == pytest.approx(0.512)
    final = np.hypot(*(recording["box_pose"][-1] - recording["goal_pose"])[:2])
    assert final == pytest.approx(result.rows[1].measures["final_distance_m"])


def test_one_episode_is_recorded_once():
    assert list(run_trial(only(episodes=1, evaluation=0)).recordings) == ["last"]


def test_time_is_split(result):
    assert set(result.seconds) == {"decision", "physics", "sensors", "learning"}
    assert all(value > 0.0 for value in result.seconds.values())


def test_success_ends_the_episode_and_says_whether_the_box_stayed():
    # A tolerance that every start is within.
    result = run_trial(only(scenario={"tolerance": 10.0}))
    ends = [(row.measures["success"], row.measures["stopped_at_goal"]) for row in result.rows]
    assert ends == [(True, True)] * 3
    assert {row.steps for row in result.rows} == {1}


def test_a_team_with_self_models_is_measured_too():
    result = run_trial(only(learner={"self_model": {"noise": 0.01}}))
    assert len(result.rows) == 3
    assert result.rows == run_trial(only(learner={"self_model": {"noise": 0.01}})).rows


def test_the_identity_is_of_the_content_not_of_its_wording():
    trial = only(topology="chain:listed", preset="default")
    assert trial.identity == only(learner={"ridge": 10}).identity
    assert trial.identity == replace(trial, condition="by another name").identity
    assert trial == replace(trial, condition="by another name")


def test_the_identity_is_that_of_the_changed_values_with_sorted_keys():
    (_, trial) = trials_of(Spec.of(SHORT | {"seeds": [3, 8]}))
    content = {
        "version": RESULTS_VERSION, "study": trial.study, "seed": 8, "episodes": trial.episodes,
        "steps": trial.steps, "evaluation": trial.evaluation,
        "settings": changed_values(trial.settings), "evaluation_steps": None, "decisions": None,
        "evaluations": [], "curriculum": [], "sources": {},
    }  # fmt: skip
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    assert trial.identity == hashlib.sha256(text.encode()).hexdigest()[:32]


def test_the_identity_is_the_same_in_another_process():
    program = (
        "from nested_agents.studies.spec.spec import Spec; "
        "from nested_agents.studies.trials.trial import trials_of; "
        f"print(trials_of(Spec.of({SHORT!r}))[0].identity)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip() == only().identity


def test_everything_that_matters_is_in_the_identity(monkeypatch):
    trial = only()
    others = [
        replace(trial, seed=8),
        replace(trial, episodes=3),
        replace(trial, steps=7),
        replace(trial, evaluation=2),
        replace(trial, study="another"),
        only(topology="teams"),
        only(scenario={"reward": {"c1": 0.02}}),
        only(learner={"exploration": {"rate": 0.2}}),
    ]
    identities = {trial.identity, *(other.identity for other in others)}
    assert len(identities) == 1 + len(others)
    monkeypatch.setattr(trial_module, "RESULTS_VERSION", 99)
    assert only().identity not in identities


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"scenario": {"robot": "e-puk"}}, "e-puk"),
        ({"scenario": {"box": "squire"}}, "squire"),
        ({"topology": {"kind": "chain", "order": ["a", "b"]}}, "a"),
        ({"learner": {"rule_base": {"order": 9}}}, "9"),
    ],
)
def test_settings_that_do_not_fit_are_refused_before_anything_runs(table, said):
    with pytest.raises(SpecError, match=said) as caught:
        check_conditions(Spec.of(SHORT | table))
    assert "\n" not in str(caught.value)


def test_which_condition_does_not_fit_is_named():
    spec = Spec.of(SHORT | {"sweep": {"learner.rule_base.order": [1, 9]}})
    with pytest.raises(SpecError, match=r"\(condition '9'\)"):
        check_conditions(spec)


def test_further_evaluations_leave_the_rest_of_a_trial_as_it_is(result):
    elsewhere = {"circle": {"box": "circle"}, "square": {}}
    other = run_trial(only(evaluations=elsewhere))
    assert other.rows[: len(result.rows)] == result.rows
    further = other.rows[len(result.rows) :]
    assert [row.phase for row in further] == ["evaluation:circle", "evaluation:square"]
    assert further[1]._replace(phase="evaluation") == result.rows[-1]
    alone = run_trial(only(evaluations={"square": {}}))
    assert alone.rows[-1] == further[1]


def test_evaluations_are_part_of_what_a_trial_is():
    one, two = only(), only(evaluations={"circle": {"box": "circle"}})
    assert one.identity != two.identity
    assert one.identity == only(evaluations={}).identity


OWN = SHORT | {"preset": "own-value"}


@pytest.mark.parametrize(
    "change", [{"robots": 3}, {"robot": "four-wheel"}, {"state_space": "paper"}]
)
def test_a_team_is_not_evaluated_where_it_cannot_act(change):
    with pytest.raises(SpecError, match=r"evaluations\.other: .* 4 agents"):
        check_conditions(Spec.of(OWN | {"evaluations": {"other": change}}))
    several = OWN | {"sweep": {"learner.ridge": [1.0, 2.0]}, "evaluations": {"other": change}}
    with pytest.raises(SpecError, match=r"evaluations\.other: .* \(condition '1.0'\)$"):
        check_conditions(Spec.of(several))
