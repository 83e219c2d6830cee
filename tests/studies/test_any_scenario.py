"""A scenario with measures of its own, from a trial to tables and figures; no box anywhere."""

import csv
import io
import json
import sqlite3
from contextlib import closing, redirect_stdout

import made_up
import numpy as np
import pandas as pd
import pytest

import nested_agents as na
from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.line_up import LineUp, LineUpSettings
from nested_agents.studies.api.loading import load
from nested_agents.studies.catalogue import scaling
from nested_agents.studies.catalogue.study import load_study
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.report.replays import replays
from nested_agents.studies.results import published
from nested_agents.studies.results.results import read
from nested_agents.studies.spec.outline import StudyOutline
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store import database
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.keeping import pending
from nested_agents.studies.trials.session import Session, run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save
from research import study_of

SPREAD = Measure("spread_m", "greatest spread of the carts", "m", "spread_m", "max", "lower")
LEVEL = Measure("level", "ever level", source="level", gathering="max", is_rate=True)
ODD = Measure('far "off"', "distance", "m", "distance_m", "mean")
SPEC = Spec.of(
    {"seeds": 2, "episodes": 3, "steps": 4, "evaluation": 2, "sweep": {"scenario.robots": [1, 2]}}
)


class Carts(LineUp):
    """Carts that tell how far they spread, which single ones cannot; they are not recorded."""

    recorded = ()

    def __init__(self, carts: int) -> None:
        super().__init__(LineUpSettings(carts=carts))
        self.measures = (SPREAD, LEVEL, SUCCESS, ODD) if carts > 1 else ()

    def measure(self):
        spread = super().measure()["spread_m"]
        return {**super().measure(), "level": spread < 0.3}


@pytest.fixture
def carts(monkeypatch):
    """Every study is one of carts, as many as its spec has robots."""
    monkeypatch.setattr(BoxPushingSettings, "build", lambda settings: Carts(settings.robots))


@pytest.fixture
def study(carts, tmp_path):
    """A study of two scenarios whose measures differ, run and kept."""
    directory = tmp_path / "study"
    with made_up.opened(directory, SPEC, check_conditions(SPEC)) as store:
        for trial in trials_of(SPEC):
            save(store, trial, run_trial(trial), 1.0)
    return directory


def said(*arguments):
    out = io.StringIO()
    with redirect_stdout(out):
        assert main([str(argument) for argument in arguments]) == 0
    return out.getvalue()


def test_a_trial_measures_what_its_scenario_declares(carts):
    one, two = trials_of(SPEC)[:2]
    assert run_trial(one).measures == (SUCCESS,)
    result = run_trial(two)
    assert result.measures == (SUCCESS, SPREAD, LEVEL, ODD)
    assert result.recordings == {}
    for row in result.rows:
        assert list(row.measures) == ["success", "spread_m", "level", 'far "off"']
        assert row.measures["level"] is (row.measures["spread_m"] < 0.3 or row.measures["level"])
        assert row.measures['far "off"'] > 0.0


def test_a_study_knows_its_measures_without_its_scenarios(study, monkeypatch):
    monkeypatch.setattr(BoxPushingSettings, "build", None)
    with Store.open(study) as store:
        assert store.measures() == (SUCCESS, SPREAD, LEVEL, ODD)
        results = read(store)
    assert results.measures == (SUCCESS, SPREAD, LEVEL, ODD)
    names = ["steps", "success", "spread_m", "level", 'far "off"', "return"]
    assert [n for n in names if results.has("1", "training", n)] == ["steps", "success", "return"]
    assert all(results.has("2", "training", name) for name in names)
    assert results.values("2", "spread_m").shape == (2, 3)
    assert results.values("2", "level", "evaluation").dtype == int


def test_rows_in_every_form(study, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    rows = list(csv.DictReader(io.StringIO(said("results", study, "--format", "csv"))))
    assert list(rows[0]) == [
        "condition", "scenario.robots", "seed", "phase", "episode", "steps", "success",
        "spread_m", "level", 'far "off"', "return",
    ]  # fmt: skip
    assert {row["spread_m"] for row in rows if row["condition"] == "1"} == {""}
    assert {row["level"] for row in rows if row["condition"] == "2"} <= {"0", "1"}
    items = json.loads(said("results", study, "--format", "json"))
    assert {item["level"] for item in items if item["condition"] == "1"} == {None}
    assert all(type(item["level"]) is bool for item in items if item["condition"] == "2")
    lines = said("results", study).splitlines()
    assert any("greatest" in line for line in lines)
    assert max(map(len, lines)) <= 80
    monkeypatch.setenv("COLUMNS", "40")
    narrow = said("results", study).splitlines()
    assert max(map(len, narrow)) <= 40


def test_frames_hold_what_is_missing_as_missing_in_files_too(study, tmp_path):
    pytest.importorskip("pyarrow")
    na.load(study).episodes.to_parquet(tmp_path / "episodes.parquet")
    levels = pd.read_parquet(tmp_path / "episodes.parquet").groupby("condition")["level"]
    assert levels.count().tolist() == [0, levels.size()["2"]]


def test_the_learning_curve_and_its_publication(study):
    with Store.open(study) as store:
        results = read(store)
        again = published.loads(published.dumps(StudyOutline.kept(store), results)).results
    learning = load_study("learning-curve")
    analysis = learning.analyse(results)
    assert tabulate(analysis.table).titles == (
        "training success", "evaluation success", "evaluation steps",
        "training greatest spread of the carts [m]", "training distance [m]",
    )  # fmt: skip
    (figure,) = learning.draw(analysis).values()
    shown = [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()]
    assert shown == ["success", "greatest spread of the carts [m]", "distance [m]"]
    assert again.measures == results.measures
    assert (again.values("2", "level") == results.values("2", "level")).all()
    for once, twice in zip(analysis.table, learning.analyse(again).table, strict=True):
        assert once.estimates.keys() == twice.estimates.keys()
        for title, estimate in once.estimates.items():  # publication keeps three decimals
            ends = [(e.value, e.low, e.high) for e in (estimate, twice.estimates[title])]
            np.testing.assert_allclose(*ends, atol=0.003)


@pytest.mark.parametrize("name", ["ablation", study_of("chain-order")])
def test_studies_of_success_need_no_more(study, name):
    with Store.open(study) as store:
        results = read(store)
    assert len(load_study(name).analyse(results).table) == 2


def test_scaling_leaves_out_contact(carts, tmp_path):
    spec = Spec.of(SPEC.table() | {"study": "scaling"})
    with made_up.opened(tmp_path, spec, check_conditions(spec)) as store:
        for trial in trials_of(spec):
            result = scaling.measure(trial)
            assert result.numbers["robots"] == trial.settings.scenario.robots
            assert "all_touching" not in result.numbers
            save(store, trial, result, 1.0)
        analysis = scaling.analyse(read(store))
    assert "all touch" not in analysis.table[0].estimates
    assert list(scaling.draw(analysis)) == ["scaling"]


def test_shapes_leaves_out_contact(carts):
    shapes = load_study(study_of("shapes"))
    elsewhere = {"study": study_of("shapes"), "evaluations": {"other": {"box": "circle"}}}
    (trial, *_) = trials_of(Spec.of(SPEC.table() | elsewhere))
    result = shapes.measure(trial)
    assert result.numbers == {}
    assert {row.phase for row in result.rows} == {"training", "evaluation", "evaluation:other"}


def test_what_is_not_recorded_is_not_replayed(study):
    with Store.open(study) as store:
        (remark,) = replays(store, read(store), trials_of(SPEC))["remarks"]
    assert remark == "Not shown because the scenario records no episodes: 1 (2 seeds), 2 (2 seeds)."
    with pytest.raises(SpecError, match="no replay: Carts does not draw its episodes"):
        load(study).replay()


def test_a_study_whose_scenarios_now_tell_something_else_is_not_continued(study):
    changed = (SUCCESS, SPREAD)
    with pytest.raises(SpecError, match="--out"):
        made_up.opened(study, SPEC, changed).__enter__()
    with made_up.opened(study, SPEC, check_conditions(SPEC)) as store:
        assert pending(store, trials_of(SPEC)) == []


def test_a_result_with_another_measure_is_no_result_of_the_study(carts, tmp_path):
    result = run_trial(trials_of(SPEC)[1])
    with (
        made_up.opened(tmp_path, SPEC, (SUCCESS,)) as store,
        pytest.raises(ValueError, match="spread_m"),
    ):
        save(store, trials_of(SPEC)[1], result, 1.0)


def test_a_measure_that_two_scenarios_mean_otherwise_is_refused(carts, monkeypatch):
    def build(settings):
        made = Carts(settings.robots)
        made.measures = (Measure("far", "far", "m" if settings.robots > 1 else "km"),)
        return made

    monkeypatch.setattr(BoxPushingSettings, "build", build)
    with pytest.raises(SpecError, match="measure 'far': is declared as"):
        check_conditions(SPEC)


def test_results_of_an_older_version_are_read_with_a_remark(study):
    with closing(sqlite3.connect(study / database.DATABASE)) as db, db:
        db.execute("UPDATE meta SET value = '4' WHERE key = 'results_version'")
    results = na.load(study)
    assert len(results.trials)
    assert any("holds results of version 4, this is version" in line for line in results.remarks)


def test_the_world_is_asked_and_not_what_agents_see_of_it(carts):
    spec = Spec.of(SPEC.table() | {"agents": "team"})
    session = Session(trials_of(spec)[1])
    assert session.scenario is not session.world
    assert len(session.world.groups) == 2
    session.train(1)
    assert np.isfinite(session.result().rows[0].measures["spread_m"])


HALVES = {
    "Plain": "Plain must inherit nested_agents.Scenario",
    "Empty": "Empty lacks agents, state_space, action_set",
    "Gym": "Scenario; a spec names it by scenario.id, with scenario.kind = 'gymnasium'",
    "Zoo": "Scenario; a spec names it by scenario.id, with scenario.kind = 'pettingzoo'",
    "Hollow": "raises AttributeError: 'int' object has no attribute",
}
"""What is said of scenarios that lack something."""


@pytest.mark.parametrize("name", HALVES)
def test_what_is_no_scenario_is_told_before_anything_runs(tmp_path, capsys, name):
    (tmp_path / "half.py").write_text("""
import nested_agents as na
from nested_agents.scenarios.line_up import LineUp, LineUpSettings

class Plain:
    class Settings(na.ScenarioSettings):
        pass

    def __init__(self, settings):
        whole = LineUp(LineUpSettings())
        self.agents, self.action_set = whole.agents, whole.action_set
        self.state_space, self.reset = whole.state_space, whole.reset

class Empty(LineUp):
    Settings = Plain.Settings

    def __init__(self, settings):
        pass

class Hollow(Empty):
    measures = (1,)

    def __init__(self, settings):
        whole = LineUp(LineUpSettings())
        self.agents, self.action_set = whole.agents, whole.action_set
        self.state_space = whole.state_space

class Gym:
    Settings = Plain.Settings
    action_space = 1

    def __init__(self, settings):
        pass

class Zoo(Gym):
    possible_agents = ()
""")
    (tmp_path / "half.toml").write_text(f'scenario.kind = "half.py:{name}"\n')
    assert main(["run", str(tmp_path / "half.toml"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert HALVES[name] in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
