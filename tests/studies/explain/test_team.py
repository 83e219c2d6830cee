"""A small trial, run for real, explained; and what is refused."""

import sqlite3

import made_up
import pytest

from nested_agents.scenarios.box_pushing.scenario import MEASURES
from nested_agents.studies.cli.main import main
from nested_agents.studies.explain import team as explain
from nested_agents.studies.explain import text as explain_text
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store import database
from nested_agents.studies.store.database import DATABASE, RESULTS_VERSION
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import finished_trial
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

SPEC = Spec.of(
    {
        "seeds": [3],
        "episodes": 3,
        "steps": 15,
        "evaluation": 1,
        "scenario": {
            "start": "easy",
            "failures": [{"kind": "seized", "wheels": "robot1.left", "episode": 1}],
        },
        "learner": {"self_model": {"enabled": True}},
        "overrides": [
            {"name": "order 1"},
            {"name": "a pair", "learner": {"rule_base": {"products": [["gap", "side"]]}}},
            {"name": "random", "learner": {"kind": "frozen", "decision": {"rule": "random"}}},
            {
                "name": "learned",
                "learner": {"self_model": {"enabled": False}, "predictor": {"kind": "learned"}},
            },
            {"name": "unfinished", "learner": {"kind": "frozen"}},
        ],
    }
)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Finished are all conditions but the last."""
    directory = tmp_path_factory.mktemp("study") / "out"
    with made_up.opened(directory, SPEC, MEASURES) as store:
        for trial in trials_of(SPEC)[:4]:
            save(store, trial, run_trial(trial), 1.0)
    return directory


def run(capsys, *arguments):
    status = main(["explain", *map(str, arguments)])
    return status, capsys.readouterr()


@pytest.mark.slow
def test_the_first_trial_in_words_and_figures(study, capsys):
    status, said = run(capsys, study)
    assert status == 0
    out = said.out
    assert out.startswith("order 1, seed 3: the team after 3 episodes\n")
    assert "the functions below are all of f" in out
    assert "IF gap is touching" in out
    assert "before the first failure, after all training" in " ".join(out.split())
    folder = study / "explain" / "order-1-seed3"
    assert {path.name for path in folder.iterdir()} == {
        "explanation.txt",
        *(f"{n}.{s}" for n in ("functions", "policy") for s in ("png", "svg")),
    }
    lines = [line for line in out.splitlines() if str(study) not in line]
    assert max(map(len, lines)) <= 80
    assert not [line for line in lines if line != line.rstrip()]


@pytest.mark.slow
def test_several_variables_together_and_nothing_learned(study, capsys):
    status, said = run(capsys, study, "--condition", "a pair", "--seed", 3)
    assert status == 0
    assert "Several variables together do " in said.out
    status, said = run(capsys, study, "--condition", "random")
    assert status == 0
    assert "the agents have learned nothing" in said.out
    assert "Not drawn: actions are drawn at random." in said.out


@pytest.mark.slow
def test_errors_of_a_learned_predictor_stand_beside_persistence(study, capsys):
    status, said = run(capsys, study, "--condition", "learned")
    assert status == 0
    lines = said.out.splitlines()
    at = lines.index("PREDICTOR")
    head = next(line for line in lines[at:] if "learned  " in line)
    assert head.split() == ["learned", "as", "it", "is", "given"]
    rows = {line.split()[0]: line.split()[1:] for line in lines[lines.index(head) + 1 :] if line}
    # Within three short episodes it has been learned what an action does to the own wheel.
    assert float(rows["wheel_speed"][0]) < float(rows["wheel_speed"][1])
    assert len(rows["gap"]) == 3


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--condition", "oder 1"], "did you mean 'order 1'"),
        (["--seed", "4"], "seed = 4: known: 3"),
        (["--condition", "unfinished"], "unfinished, seed 3: has not finished"),
    ],
)
def test_what_the_user_can_mend(arguments, complaint, study, capsys):
    status, said = run(capsys, study, *arguments)
    assert (status, said.out) == (2, "")
    assert complaint in said.err.splitlines()[-1]


def test_no_study(tmp_path, capsys):
    status, said = run(capsys, tmp_path)
    assert status == 2
    assert said.err.count("\n") == 1


def changed(study, tmp_path, statement):
    """Return a copy of the study in which a statement has changed the database."""
    import shutil

    copy = shutil.copytree(study, tmp_path / "copy")
    connection = sqlite3.connect(copy / DATABASE)
    connection.execute(statement)
    connection.commit()
    connection.close()
    return copy


def test_results_of_another_version_are_refused(study, monkeypatch, capsys):
    monkeypatch.setattr(database, "RESULTS_VERSION", 99)
    status, said = run(capsys, study)
    assert status == 2
    assert f"holds results of version {RESULTS_VERSION}, this is version 99" in said.err


def test_another_team_than_the_one_that_was_measured_is_not_explained(study, monkeypatch):
    with Store.open(study) as store:
        trial = finished_trial(store, None, None)
        kept = explain._kept(store, trial)
        monkeypatch.setattr(explain, "_kept", lambda *_: [*kept[:2], (*kept[2][:-1], 0.0)])
        with pytest.raises(ValueError, match="gives another episode 2 than the one that is kept"):
            explain.explain(store, trial)


def test_a_topology_file_that_has_changed_since(tmp_path, capsys):
    file = tmp_path / "mine.py"
    file.write_text("def mine(agents, groups): return list(zip(agents, agents[1:]))")
    spec = Spec.of({"seeds": [3], "episodes": 1, "steps": 1, "topology": f"{file}:mine"})
    (trial,) = trials_of(spec)
    with made_up.opened(tmp_path / "out", spec, MEASURES) as store:
        save(store, trial, run_trial(trial), 1.0)
    file.write_text("def mine(agents, groups): return []")
    status, _ = run(capsys, tmp_path / "out")
    assert status == 0  # by the study's own copy


@pytest.mark.slow
def test_an_agent_for_each_robot(tmp_path, capsys):
    one = {"overrides": (), "agents": "body", "evaluation": 0, "episodes": 2}
    spec = Spec.of({**SPEC.table(), **one})
    (trial,) = trials_of(spec)
    with made_up.opened(tmp_path, spec, MEASURES) as store:
        save(store, trial, run_trial(trial), 1.0)
    status, said = run(capsys, tmp_path)
    assert status == 0
    assert "Not drawn: the scenario has no method show_policy for agents such as these." in said.out
    assert "turning built" in said.out


def test_folders_of_conditions_differ(tmp_path):
    from types import SimpleNamespace

    names = ["a/b", "a b", "x", "§"]
    folders = [
        explain.folder_of(tmp_path, SimpleNamespace(condition=name, seed=0), names).name
        for name in names
    ]
    assert folders == ["condition1-seed0", "condition2-seed0", "x-seed0", "condition4-seed0"]


def test_percents_stay_with_their_numbers():
    sentence = "x" * 76 + " 3 %, y"
    assert [line.strip() for line in explain_text._wrapped(sentence).splitlines()] == [
        "x" * 76,
        "3 %, y",
    ]
