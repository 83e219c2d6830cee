"""Curricula, and evaluation with other agents: what is handed on, and what stays as it was."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from nested_agents.core.agents.loop import world_seed
from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios.line_up import LineUp
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.session import CURRICULUM_WORLDS, Session, run_trial
from nested_agents.studies.trials.trial import trials_of

SHORT = {
    "seeds": [7], "episodes": 2, "steps": 12, "evaluation": 2,
    "scenario": {"kind": "line-up", "carts": 3}, "learner": {"weights": "role"},
}  # fmt: skip
STAGES = [
    {"name": "one", "episodes": 2, "scenario": {"carts": 1}},
    {"name": "two", "episodes": 1, "scenario": {"carts": 2}},
]
ELSEWHERE = {"same": {}, "eight": {"carts": 8}}


def only(**table):
    (trial,) = trials_of(Spec.of(SHORT | table))
    return trial


def phases(result):
    return [(row.phase, row.episode) for row in result.rows]


@pytest.fixture(scope="module")
def plain():
    return run_trial(only())


@pytest.fixture(scope="module")
def taught():
    return run_trial(only(curriculum=STAGES, evaluations=ELSEWHERE))


def test_episodes_are_numbered_through_the_stages_and_anew_in_training(taught):
    assert phases(taught) == [
        ("training:one", 0), ("training:one", 1), ("training:two", 2),
        ("training", 0), ("training", 1), ("evaluation", 0), ("evaluation", 1),
        ("evaluation:same", 0), ("evaluation:same", 1),
        ("evaluation:eight", 0), ("evaluation:eight", 1),
    ]  # fmt: skip


def test_training_meets_the_worlds_that_it_meets_without_a_curriculum(taught, plain):
    for name in ("first", "last"):
        one, other = (result.recordings[name]["places"][0] for result in (taught, plain))
        assert np.array_equal(one, other)
    assert taught.rows[3:5] != plain.rows[:2]


def test_recordings_tell_whose_messages_fail():
    failure = {"kind": "lost", "agents": "robot1.left", "step": 2}
    table = {"seeds": [7], "episodes": 1, "steps": 4, "topology": {"failures": [failure]}}
    (trial,) = trials_of(Spec.of(table))
    (recording,) = run_trial(trial).recordings.values()
    fail = recording["messages_fail"]
    assert fail.shape == recording["wheel_speeds"].shape
    assert fail.any(axis=1).tolist() == [False, False, True, True, True]
    assert not fail[:, 1:].any()


def test_stages_have_worlds_of_their_own(monkeypatch):
    begun = []
    reset = LineUp.reset

    def noted(world, seed, episode=0):
        if isinstance(seed, np.random.SeedSequence):
            begun.append((len(world.agents), seed.spawn_key, episode))
        return reset(world, seed, episode)

    monkeypatch.setattr(LineUp, "reset", noted)
    Session(only(curriculum=STAGES)).evaluate()
    assert begun[:3] == [
        (carts, world_seed(7, CURRICULUM_WORLDS + k).spawn_key, episode)
        for k, (carts, episode) in enumerate([(1, 0), (1, 1), (2, 0)])
    ]


def test_experience_and_exploration_go_on():
    trial = only(curriculum=[{"name": "more", "episodes": 2}], learner={}, episodes=1)
    session = Session(trial)
    session.train(1)
    arrays, steps = session.team.state_dict(), [row.steps for row in session.result().rows]
    assert arrays["explorer"][0] == 2.0  # its third episode
    assert len(arrays["learner.states"]) == 3 * sum(steps)


def test_a_curriculum_is_gone_through_once_and_before_anything_else():
    trial = only(curriculum=STAGES)
    in_parts = Session(trial)
    in_parts.train(1)
    in_parts.train(1, 1)
    in_parts.evaluate()
    assert in_parts.result().rows == run_trial(trial).rows


def test_a_trial_with_stages_is_a_function_of_its_content(taught):
    trial = only(curriculum=STAGES, evaluations=ELSEWHERE)
    assert run_trial(pickle.loads(pickle.dumps(trial))).rows == taught.rows
    assert trial == pickle.loads(pickle.dumps(trial))


def test_stages_are_part_of_what_a_trial_is():
    trial = only(curriculum=STAGES)
    others = [only(), only(curriculum=STAGES[:1]), only(curriculum=STAGES[::-1])]
    assert len({t.identity for t in (trial, *others)}) == 4
    assert only(curriculum=[]).identity == only().identity


def test_evaluation_with_other_agents_leaves_the_rest_of_a_trial_as_it_is(taught):
    rows = {row.phase: row for row in taught.rows}
    assert rows["evaluation:same"]._replace(phase="evaluation") == rows["evaluation"]
    alone = run_trial(only(curriculum=STAGES, evaluations={"eight": {"carts": 8}}))
    assert alone.rows == tuple(r for r in taught.rows if r.phase != "evaluation:same")


def test_episodes_of_evaluation_may_be_longer_than_those_of_training():
    table = {"preset": "frozen", "steps": 3, "evaluations": {"same": {}}}
    trial = only(**table, evaluation_steps=5)
    steps = {row.phase: row.steps for row in run_trial(pickle.loads(pickle.dumps(trial))).rows}
    assert steps == {"training": 3, "evaluation": 5, "evaluation:same": 5}
    assert len({t.identity for t in (trial, only(**table), only(**table, evaluation_steps=4))}) == 3


def test_weights_of_a_role_decide_for_any_number_of_agents():
    """One cart is enough to learn that carts go to the line."""
    trained = only(
        episodes=8, steps=60, evaluation=5, scenario={"kind": "line-up", "carts": 1},
        evaluations={"four": {"carts": 4}}, learner={"weights": "role"},
    )  # fmt: skip
    untrained = replace(trained, episodes=1, steps=2)
    far = [
        np.mean([
            row.measures["final_distance_m"]
            for row in run_trial(trial).rows
            if row.phase == "evaluation:four"
        ])
        for trial in (trained, untrained)
    ]  # fmt: skip
    assert far[0] < 0.5 * far[1]


REFUSED = {
    "own weights": (
        {"preset": "own-value", "learner": {}, "curriculum": STAGES},
        r"curriculum\.two: learner\.weights = 'own': the 1 agents .* 2 agents",
    ),
    "own weights at the end": (
        {"preset": "own-value", "learner": {}, "curriculum": STAGES[1:]},
        r"curriculum: learner\.weights = 'own': the 2 agents .* 3 agents",
    ),
    "another state space": (
        {"curriculum": [{"name": "b", "episodes": 1, "scenario": {"kind": "box-pushing"}}]},
        r"curriculum: a team trained with 4 agents over 'relational' cannot .*spaces differ",
    ),
    "a stage that cannot be": (
        {"topology": {"kind": "chain", "order": ["cart3", "cart2", "cart1"]}, "curriculum": STAGES},
        r"curriculum\.one: topology 'chain': ",
    ),
    "an evaluation": (
        {"preset": "own-value", "learner": {}, "evaluations": {"eight": {"carts": 8}}},
        r"evaluations\.eight: learner\.weights = 'own': the 3 agents .* share theirs$",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_handed_on_is_refused_before_anything_runs(what):
    table, said = REFUSED[what]
    with pytest.raises(SpecError, match=said) as caught:
        check_conditions(Spec.of(SHORT | table))
    assert "\n" not in str(caught.value)


def test_own_weights_are_handed_on_between_the_same_agents():
    stages = [{"name": "again", "episodes": 1}]
    trial = only(curriculum=stages, learner={}, evaluations={"same": {}})
    check_conditions(Spec.of(SHORT | {"curriculum": stages, "learner": {}}))
    assert len(run_trial(trial).rows) == 7


WORLD = """
from nested_agents.scenarios.line_up import LineUp, LineUpSettings

class Mine(LineUp):
    class Settings(LineUpSettings):
        kind: str = ""

    def __init__(self, settings):
        super().__init__(settings)
"""


def test_a_scenario_of_a_users_file_has_stages_and_evaluations_too():
    table = SHORT | {
        "scenario": {"kind": "mine.py:Mine", "carts": 2},
        "curriculum": [{"name": "one", "episodes": 1, "scenario": {"carts": 1}}],
        "evaluations": {"four": {"carts": 4}},
    }
    spec = Spec.of(table, Sources(texts={"mine.py": WORLD}))
    assert check_conditions(spec)[0].name == "success"
    (trial,) = trials_of(spec)
    with trial.sources.active():
        rows = run_trial(pickle.loads(pickle.dumps(trial))).rows
    assert [row.phase for row in rows][::2] == [
        "training:one", "training", "evaluation", "evaluation:four",
    ]  # fmt: skip
