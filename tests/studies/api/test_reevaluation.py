"""Trained teams that are kept: the same bytes from everybody, acting and evaluated as they were."""

import shutil

import made_up
import numpy as np
import pytest
from acting import fuzzy

import nested_agents as na
from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.durable import TEAM
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import run_trials, save
from nested_agents.studies.workers.workers import start_workers

TABLE = {
    "seeds": [3, 5], "episodes": 2, "steps": 12, "evaluation": 3, "keep_teams": True,
    "scenario": {"kind": "line-up", "carts": 3},
    "curriculum": [{"name": "one", "episodes": 1}],
    "overrides": [
        {"name": "batch", "learner": {"weights": "role"}},
        {"name": "online", "topology": "tree:2",
         "learner": {"kind": "td-lambda", "step_size": 0.1, "averaging": 5.0,
                     "decision": {"teammates": "conditional", "evaluator": "exact"}}},
        {"name": "random", "learner": {"kind": "frozen", "decision": {"rule": "random"}}},
    ],
}  # fmt: skip
SPEC = Spec.of(TABLE)


def kept_at(directory, spec=SPEC):
    """Run a study here, one trial after the other."""
    trials = trials_of(spec)
    measures = check_conditions(spec)
    with made_up.opened(directory, spec, measures) as store:
        for trial in trials:
            save(store, trial, run_trial(trial), 1.0)
    return directory


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return kept_at(tmp_path_factory.mktemp("kept") / "out")


def recordings(directory):
    return {path.name: path.read_bytes() for path in (directory / "recordings").iterdir()}


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_workers_of_all_kinds_keep_the_same_bytes(backend, place, tmp_path):
    trials = trials_of(SPEC)
    with (
        made_up.opened(tmp_path, SPEC, check_conditions(SPEC)) as store,
        start_workers(backend, 2, None, len(trials)) as workers,
    ):
        assert [o.error for o in run_trials(trials, store, run_trial, workers)] == [None] * 6
    assert recordings(tmp_path) == recordings(place)


def test_a_study_that_keeps_no_teams_is_as_it_was():
    without = Spec.of({**TABLE, "keep_teams": False})
    assert "keep_teams" not in without.table()
    for one, other in zip(trials_of(SPEC), trials_of(without), strict=True):
        assert one.identity == other.identity
    (kept, plain) = (run_trial(trials_of(spec)[0]) for spec in (SPEC, without))
    assert kept.rows == plain.rows
    assert {*kept.recordings} - {*plain.recordings} == {TEAM}


def test_a_kept_team_acts_as_the_trained_one_did(place):
    study = na.load(place)
    scenario, team = study.team("online", 5)
    steps = list(na.control_loop(
        scenario, team, episodes=3, steps=12, seed=5, first_episode=10**6, learn=False
    ))  # fmt: skip
    own = study.episodes.query("condition == 'online' and seed == 5 and phase == 'evaluation'")
    assert [sum(r.episode == 10**6 + k for r in steps) for k in range(3)] == own["steps"].tolist()
    assert fuzzy(study.team()[1]).learner.theta.any()


def test_under_what_it_was_trained_with_a_team_does_the_same_again(place, capsys):
    study = na.load(place)
    own = study.episodes.query("phase == 'evaluation'").reset_index(drop=True)
    frame = na.reevaluate(study, topology=["chain", "tree:2"], jobs=2)
    trials = len(study.trials)
    assert f"{trials} of {trials} trials, " in capsys.readouterr().err  # shows its progress
    assert set(frame.attrs["columns"]) == set(frame.columns)
    assert set(frame["phase"]) == {"evaluation:chain", "evaluation:tree:2"}
    trained = np.where(frame["condition"] == "online", "tree:2", "chain")
    again = frame[frame["entry"] == trained].drop(columns="entry").assign(phase="evaluation")
    assert again.reset_index(drop=True).equals(own)
    pairs = frame.pivot(index=["condition", "seed", "episode"], columns="entry", values="return")
    assert (pairs["chain"] != pairs["tree:2"]).any()


def test_decisions_are_crossed_with_topologies_and_a_part_is_enough(place):
    part = na.load(place).where("seed == 5 and condition == 'batch'")
    frame = na.reevaluate(
        part, ["independent", {"communication": "none"}], [{"unseen": "last"}, {}], jobs=1
    )
    assert set(zip(frame["condition"], frame["seed"], strict=True)) == {("batch", 5)}
    assert len(frame) == 4 * 3
    assert "topology={communication = 'none'}, decision={unseen = 'last'}" in set(frame["entry"])


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({}, r"topology = \[\], decision = \[\]: must be lists, one of them not empty"),
        ({"topology": "chain"}, r"topology = 'chain', decision = \[\]: must be lists"),
        ({"topology": ["chian"]}, "did you mean 'chain'"),
        ({"topology": ["edges:a>b"]}, "unknown agent 'a' in edges and alone, known: cart1"),
        ({"decision": [{"unseen": "lst"}]}, "decision.unseen = 'lst': must be 'maintain'"),
        ({"decision": ["x"]}, "learner.decision = 'x': must be a table"),
    ],
)
def test_what_no_team_can_act_by_is_refused_in_one_line(options, complaint, place):
    with pytest.raises(na.SpecError, match=complaint) as caught:
        na.reevaluate(place, **options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [(("bach", 3), "did you mean 'batch'"), (("batch", 4), "seed = 4: known: 3, 5")],
)
def test_a_team_there_is_not_is_refused(arguments, complaint, place):
    with pytest.raises(na.SpecError, match=complaint):
        na.load(place).team(*arguments)


def test_a_study_without_teams_says_which_key_keeps_them(tmp_path):
    spec = Spec.of({**TABLE, "seeds": 1, "keep_teams": False, "evaluation": 0})
    study = na.load(kept_at(tmp_path, spec))
    for asked in (study.team, lambda: na.reevaluate(study, ["chain"])):
        with pytest.raises(na.SpecError, match="keeps no teams: its spec has no keep_teams = true"):
            asked()


def test_without_evaluation_a_team_is_kept_and_not_evaluated_again(tmp_path):
    spec = Spec.of({**TABLE, "seeds": 1, "evaluation": 0})
    study = na.load(kept_at(tmp_path, spec))
    assert fuzzy(study.team()[1]).learner.theta.any()
    with pytest.raises(na.SpecError, match="evaluation = 0: kept teams are"):
        na.reevaluate(study, ["chain"])


@pytest.mark.parametrize("damage", ["missing", "damaged"])
def test_a_team_that_is_not_as_it_was_written_is_told_everywhere(damage, place, tmp_path, capsys):
    directory = shutil.copytree(place, tmp_path / "out")
    trial = trials_of(SPEC)[0]
    path = directory / "recordings" / f"{trial.identity}.npz"
    if damage == "missing":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:-9])
    line, study = f"{path}: is {damage} (batch, seed 3)", na.load(directory)
    for asked in (study.team, lambda: na.reevaluate(study, ["chain"])):
        with pytest.raises(na.SpecError) as caught:
            asked()
        assert line in str(caught.value)
    assert main(["explain", str(directory)]) == 2
    assert line in capsys.readouterr().err
    main(["status", str(directory)])
    assert line in capsys.readouterr().out
    with made_up.opened(directory, SPEC, check_conditions(SPEC)) as store:
        assert trial.identity not in store.states()
        save(store, trial, run_trial(trial), 1.0)
    assert recordings(directory) == recordings(place)


@pytest.mark.slow
def test_explaining_a_kept_team_trains_nothing_and_says_the_same(place, monkeypatch, capsys):
    def said(directory, *arguments):
        assert main(["explain", str(directory), *arguments]) == 0
        shown = capsys.readouterr()
        return shown.out.replace(str(directory), "DIR"), shown.err

    spec = {**TABLE, "seeds": [3], "overrides": TABLE["overrides"][1:2], "keep_teams": False}
    again = kept_at(place.parent / "again", Spec.of(spec))
    explained = said(again, "--condition", "online")
    monkeypatch.setattr("nested_agents.studies.explain.team._train", None)
    assert said(place, "--condition", "online") == explained


PEER = """
import numpy as np
import nested_agents as na

class Mine(na.Peer):
    class Settings(na.PeerSettings):
        pass

    def __init__(self, settings, scenario, seed):
        super().__init__(seed)
        self.n = len(scenario.agents)
        self.taken = self.rng.integers(len(scenario.action_set), size=(1,))

    def act(self, seen, *, explore=True):
        return np.repeat(self.taken, self.n)

    def state_dict(self):
        return {"taken": self.taken}
"""
RESTORE = """
    def load_state_dict(self, state):
        self.taken = state["taken"]
"""


def test_a_learner_that_acts_by_itself_is_kept_if_it_can_be_restored(tmp_path):
    table = {**TABLE, "seeds": [3], "curriculum": [], "overrides": [],
             "learner": {"kind": "mine.py:Mine"}}  # fmt: skip
    with pytest.raises(na.SpecError, match=r"keep_teams = true: .* has no method load_state_dict"):
        check_conditions(Spec.of(table, Sources(texts={"mine.py": PEER})))
    spec = Spec.of(table, Sources(texts={"mine.py": PEER + RESTORE}))
    with spec.sources.active():
        study = na.load(kept_at(tmp_path, spec))
    scenario, team = study.team()
    seen = team.observe(scenario, scenario.reset(0))
    assert team.state_dict()["taken"] == team.act(seen).joint_action[0]
    own = study.episodes.query("phase == 'evaluation'")["return"]
    assert na.reevaluate(study, ["chain"], jobs=1)["return"].tolist() == own.tolist()
    with pytest.raises(na.SpecError, match="Mine has no warm_start"):
        na.reevaluate(study, ["tree:2"])


def test_arrays_of_objects_are_no_arrays_that_are_kept(monkeypatch):
    monkeypatch.setattr(na.Team, "state_dict", lambda team: {"seen": np.array([{}])})
    with pytest.raises(na.SpecError, match="its array 'seen' holds objects"):
        check_conditions(SPEC)


@pytest.mark.slow
def test_what_robots_learned_of_themselves_is_kept_too(tmp_path):
    table = {
        "seeds": [4], "episodes": 3, "steps": 15, "evaluation": 2, "keep_teams": True,
        "scenario": {"start": "easy", "failures": [
            {"kind": "seized", "wheels": "robot1.left", "episode": 1}]},
        "learner": {"self_model": {"enabled": True}, "calibration": {"enabled": True}},
        "sweep": {"agents": ["actuator", "body"]},
    }  # fmt: skip
    study = na.load(kept_at(tmp_path, Spec.of(table)))
    own = study.episodes.query("phase == 'evaluation'").reset_index(drop=True)
    again = na.reevaluate(tmp_path, topology=["chain"], jobs=1)
    columns = ["condition", "seed", "episode", "steps", "final_distance_m", "return"]
    assert again[columns].equals(own[columns])
    with Store.open(tmp_path) as store:
        kept = store.recording(trials_of(Spec.of(table))[0].identity, TEAM)
    assert {"self_model.effect0", "calibration.constants", "learner.theta"} <= set(kept)
    assert main(["explain", str(tmp_path)]) == 0
