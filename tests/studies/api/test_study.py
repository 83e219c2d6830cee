"""A study in Python, with made-up results: nothing here simulates."""

import pickle
from dataclasses import replace

import made_up
import pytest

import nested_agents as na
from nested_agents.studies.api import running as studies_run
from nested_agents.studies.catalogue import learning_curve

TABLE = {"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2,
         "sweep": {"preset": ["default", "frozen"]}}  # fmt: skip


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory):
    """Two finished studies, the second of other seeds."""
    here = [tmp_path_factory.mktemp("studies") / name for name in ("one", "two")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(learning_curve, "measure", made_up.measure)
        patch.setattr(studies_run, "check_conditions", lambda spec, **_: made_up.MEASURES)
        na.run(TABLE, here[0], jobs=1, progress=False)
        na.run(na.Spec(**{**TABLE, "seeds": [0, 1, 2, 3]}), str(here[1]), jobs=1, progress=False)
    return here


@pytest.fixture
def study(places):
    return na.load(places[0])


def test_a_study_tells_its_conditions_table_and_notes(study) -> None:
    assert study.conditions == ("default", "frozen")
    assert study.outline.seeds == (0, 1, 2)
    table = study.table(["training success"])
    assert str(table).splitlines()[1].split()[0] == "default"
    assert table._repr_html_().count("<tr>") == 2
    assert "<th>default, 3 seeds</th>" in study._repr_html_()
    assert "3 seeds cannot give a p below 0.05" in " ".join(study.power)
    assert set(study.power) <= set(study.compare().notes), "one number of power for a study"


def test_a_name_is_text_in_html(study, monkeypatch) -> None:
    table = study.table()
    monkeypatch.setattr(na.StudyResults, "table", lambda _: table)
    named = replace(study, outline=study.outline._replace(study="<b>.py:Mine"))
    assert named._repr_html_().startswith("<h4>&lt;b&gt;.py:Mine</h4>")


def test_rows_are_data_frames_whose_columns_are_told(study) -> None:
    trials, episodes = study.trials, study.episodes
    assert len(trials) == 6
    assert len(episodes) == 6 * (4 + 2)
    assert set(episodes["phase"]) == {"training", "evaluation"}
    assert episodes["success"].dtype == bool
    for frame in (trials, episodes):
        assert set(frame.attrs["columns"]) == set(frame.columns)
    assert episodes.attrs["columns"]["final_distance_m"]["unit"] == "m"
    assert trials.attrs["columns"]["seconds.total"] == {"unit": "s", "meaning": "time spent"}
    part = study.where("seed < 2 and condition == 'frozen'")
    assert set(part.episodes["seed"]) == {0, 1}
    assert len(part.trials) == 2


def test_what_a_user_changes_changes_no_result(study, places) -> None:
    episodes, trials = study.episodes, study.trials
    episodes["success"] = True
    episodes.attrs["columns"].clear()
    trials.loc[:, "state"] = "failed"
    for condition in study.conditions:
        study.results.values(condition, "success")[:] = 1
        for values in study.results.numbers(condition).values():
            values[:] = 0
    untouched = na.load(places[0])
    assert str(study) == str(untouched)
    assert study.episodes.equals(untouched.episodes)
    assert study.trials.equals(untouched.trials)
    assert study.episodes.attrs == untouched.episodes.attrs
    assert str(pickle.loads(pickle.dumps(study)).compare()) == str(untouched.compare())


def test_conditions_are_compared(study) -> None:
    found = study.compare(measure="steps")
    (difference,) = found.differences
    assert difference.condition == "frozen"
    assert difference.seeds == 3
    assert "3 seeds cannot give" in str(found)
    assert "<table" in found._repr_html_()
    assert found.table.latex.startswith("% needs \\usepackage{booktabs}")


@pytest.mark.parametrize(
    ("method", "options", "complaint"),
    [
        ("where", {"choice": None}, "where = None"),
        ("as_study", {"name": 5}, "study = 5"),
        ("scalability", {"budget": 5}, "budget = 5"),
        ("scalability", {"criterion": "a", "size": "seed"}, "size = 'seed'"),
    ],
)
def test_wrong_arguments_are_named(study, method, options, complaint) -> None:
    with pytest.raises(ValueError, match=complaint):
        getattr(study, method)(**options)


@pytest.mark.parametrize("jobs", ["2", 1.5, True, 0])
def test_jobs_are_a_whole_number(jobs, tmp_path) -> None:
    with pytest.raises(ValueError, match="jobs"):
        na.run({"seeds": 1}, tmp_path / "out", jobs=jobs)
    assert not (tmp_path / "out").exists()


def test_trials_are_asked_again_by_another_study(study) -> None:
    again = study.as_study("ablation")
    assert again.table().titles[0] == "training success"
    assert any("adjusted over 2 comparisons" in note for note in again.notes)
    for name, complaint in (("ablaton", "did you mean 'ablation'"), ("scaling", "needs robots")):
        with pytest.raises(na.SpecError, match=complaint):
            study.as_study(name).table()
    with pytest.raises(na.SpecError, match="report: needs a whole study"):
        again.report()


def test_studies_are_loaded_together(places) -> None:
    both = na.load(*places)
    assert both.conditions == ("default (one)", "frozen (one)", "default (two)", "frozen (two)")
    found = both.compare(by="directory")
    assert [group.setting for group in found.analysis.groups] == ["default", "frozen"]
    # Equal trials, equal results: the made-up numbers are functions of the trial.
    assert all(d.estimate.value == 0.0 for d in found.differences)
    with pytest.raises(na.SpecError, match="named more than once"):
        na.load(places[0], places[0])
    with pytest.raises(na.SpecError, match="not the results of one study"):
        both.replay()


def test_the_figure_is_matplotlib_s(study) -> None:
    assert study.figure().axes
    with pytest.raises(na.SpecError, match="did you mean 'learning-curves'"):
        study.figure("learning-curve")


def test_the_report_is_a_file(study, tmp_path) -> None:
    path = study.report(tmp_path / "study.html")
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    with pytest.raises(na.SpecError, match=r"suffix must be \.html"):
        study.report(tmp_path / "study.pdf")


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"condition": "defaut"}, "did you mean 'default'"),
        ({"seed": 9}, "seed = 9: known: 0, 1, 2"),
        ({"episode": "middle"}, "episode = 'middle': known: first, last"),
    ],
)
def test_a_replay_there_is_not_is_refused(study, options: dict, complaint: str) -> None:
    with pytest.raises(na.SpecError, match=complaint):
        study.replay(**options)


def test_what_holds_no_study_is_refused_in_one_line(tmp_path) -> None:
    with pytest.raises(na.SpecError, match="holds no study"):
        na.load(tmp_path)
    with pytest.raises(na.SpecError, match="needs a directory"):
        na.load()


def test_the_status_and_a_team_in_words(study, places) -> None:
    assert str(study.status).splitlines()[1] == "done     6 of 6 trials"
    assert study.status.left == 0
    with pytest.raises(na.SpecError, match="not the results of one study"):
        _ = na.load(*places).status


@pytest.mark.slow
def test_a_trained_team_is_explained_and_played(tmp_path) -> None:
    spec = {"seeds": 1, "episodes": 2, "steps": 8, "evaluation": 1}
    study = na.run(spec, tmp_path, jobs=1, progress=False)
    explained = study.explain()
    assert "The unit is that of the return" in " ".join(explained.text.split())
    assert "functions" in explained.figures
    assert explained._repr_html_().startswith("<pre>default, seed 0")
    html = study.replay()._repr_html_()
    assert html.startswith("<img alt='default, seed 0, last episode' src='data:image/gif;base64,")
