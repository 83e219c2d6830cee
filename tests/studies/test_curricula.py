"""A study with a curriculum and evaluations elsewhere, as users see it: rows, tables, words."""

import csv
import io

import made_up
import pytest

from nested_agents.studies.catalogue.study import load_study
from nested_agents.studies.cli.main import main
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.report import page as words
from nested_agents.studies.results.results import read
from nested_agents.studies.spec.outline import StudyOutline
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

SPEC = Spec.of(
    {
        "seeds": 2,
        "episodes": 3,
        "steps": 4,
        "evaluation": 2,
        "scenario": {"kind": "line-up", "carts": 4},
        "learner": {"weights": "role"},
        "curriculum": [
            {"name": "two", "episodes": 2, "scenario": {"carts": 2}},
            {"name": "three", "episodes": 1, "scenario": {"carts": 3}},
        ],
        "evaluations": {"six": {"carts": 6}, "eight": {"carts": 8}},
    }
)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    directory = tmp_path_factory.mktemp("study")
    with made_up.opened(directory, SPEC, check_conditions(SPEC)) as store:
        for trial in trials_of(SPEC):
            save(store, trial, run_trial(trial), 1.0)
    return directory


def said(capsys, *arguments):
    assert main([str(argument) for argument in arguments]) == 0
    return capsys.readouterr().out


def test_an_export_names_the_phases_that_its_form_cannot_hold(study, tmp_path, capsys):
    for form in ("csv", "marl-eval"):
        assert main(["export", str(study), "--out", str(tmp_path), "--format", form]) == 0
        left_out = "training:two, training:three, evaluation:six, evaluation:eight"
        assert (f"left out: {left_out}" in capsys.readouterr().err) == (form == "marl-eval")


def test_stages_are_kept_in_the_order_in_which_they_were_trained(study):
    with Store.open(study) as store:
        names, rows = store.episodes()
        rows = list(rows)
        phases = store.phases()
    at = [names.index(name) for name in ("seed", "phase", "episode")]
    assert [tuple(row[i] for i in at) for row in rows[:6]] == [
        (0, "training:two", 0), (0, "training:two", 1), (0, "training:three", 2),
        (0, "training", 0), (0, "training", 1), (0, "training", 2),
    ]  # fmt: skip
    assert phases == [
        "training", "evaluation", "training:two", "training:three", "evaluation:six",
        "evaluation:eight",
    ]  # fmt: skip


def test_learning_curves_are_of_the_condition_itself_and_tables_tell_all_evaluations(study):
    with Store.open(study) as store:
        results = read(store)
    (condition,) = results.conditions
    assert results.success(condition).shape == (2, 3)
    assert list(results.other_evaluations(condition)) == ["six", "eight"]
    analysis = load_study("learning-curve").analyse(results)
    titles = tabulate(analysis.table).titles
    assert titles[1:4] == ("evaluation success", "success, six", "success, eight")


def test_the_rows_of_any_phase_can_be_asked_for(study, capsys):
    text = said(capsys, "results", study, "--phase", "training:three", "--format", "csv")
    assert [row["episode"] for row in csv.DictReader(io.StringIO(text))] == ["2", "2"]
    assert "evaluation:eight" in said(capsys, "results", study, "--phase", "evaluation:eight")
    assert main(["results", str(study), "--phase", "training:tree"]) == 2
    assert "did you mean 'training:three'?" in capsys.readouterr().err


def test_a_team_is_trained_again_through_its_stages_to_be_explained(study, capsys):
    text = said(capsys, "explain", study, "--full")
    assert text.startswith("default, seed 0: the team after 2 + 1 + 3 episodes")


def test_the_lengths_of_several_curricula_are_told():
    stages = [{"name": "more", "episodes": 9}]
    overrides = [{"name": "a"}, {"name": "b", "curriculum": stages}]
    assert StudyOutline.of(SPEC.model_copy(update={"overrides": overrides})).lengths == (
        "2 + 1 + 3 or 9 + 3 episodes"
    )


def test_extent(study):
    with Store.open(study) as store:
        assert words.extent(StudyOutline.kept(store)) == (
            "1 condition × 2 seeds, each 2 + 1 + 3 training episodes of up to 4 steps, "
            "2 evaluation episodes after them and as many in each of 2 other scenarios"
        )
