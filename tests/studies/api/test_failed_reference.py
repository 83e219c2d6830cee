"""A study whose first condition has no finished trial says which condition is the reference."""

import made_up
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main
from nested_agents.studies.workers.runner import save

ERROR = "Traceback (most recent call last):\n  File f\nRuntimeError: a wheel came off\nand rolled"


@pytest.fixture
def study(tmp_path):
    spec = made_up.Spec.of(
        made_up.SPEC.table() | {"sweep": {"preset": ["default", "frozen", "own-value"]}}
    )
    with made_up.opened(tmp_path / "study", spec) as store:
        for trial in made_up.trials_of(spec):
            if trial.condition == "default":
                store.fail(trial.planned, ERROR)
            else:
                save(store, trial, made_up.measure(trial), 1.5)
    return tmp_path / "study"


@pytest.mark.parametrize("command", ["table", "compare", "report"])
def test_another_reference_is_told(command, study, capsys):
    main([command, str(study)])
    out, err = capsys.readouterr()
    page = (study / "report.html").read_text() if command == "report" else ""
    told = " ".join((out + err + page).split())
    assert "No trial of default, the first condition, has finished: frozen is the" in told


@pytest.mark.parametrize("arguments", [["table"], ["table", "--format", "csv"], ["compare"]])
def test_conditions_without_results_are_named(arguments, study, capsys):
    main([*arguments, str(study)])
    printed = "".join(capsys.readouterr())
    said = [line for line in printed.splitlines() if "no results" in line]
    assert len(said) == 1
    assert "default" in said[0]
    assert "frozen" not in said[0]


def test_the_line_of_an_error_that_says_what_went_wrong_is_kept(study):
    trials = na.load(study).trials
    assert {*trials[trials["state"] == "failed"]["error"]} == {"RuntimeError: a wheel came off"}


def test_a_choice_of_conditions_or_of_a_reference_is_no_failure(study):
    whole = na.load(study)
    assert any("No trial of default" in line for line in whole.notes)
    chosen = whole.where("preset != 'default'")
    assert not any("No trial of" in line for line in chosen.notes)
    compared = whole.compare(reference="own-value")
    assert not any("No trial of" in line for line in compared.notes)
