import io

import numpy as np
import pandas as pd
import pytest
from made_up_results import Arrays

from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.scenarios.box_pushing.measurements import MEASURES, ORIENTATION
from nested_agents.studies.catalogue.learning_curve import analyse, curves_of, draw, metrics_of
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.presentation.tables import write_rows
from nested_agents.studies.results.notation import format_estimate, format_number
from nested_agents.studies.results.results import STEPS
from nested_agents.studies.results.statistics import Estimate


def arrays(seeds, episodes, success):
    names = ("steps", *(measure.name for measure in MEASURES))
    values = {name: np.tile(np.arange(episodes, dtype=float), (seeds, 1)) for name in names}
    success = np.broadcast_to(success, (seeds, episodes)).astype(int)
    return values | {"success": success, "stopped_at_goal": success}


def made_up(seeds=4, episodes=12):
    learns = arrays(seeds, episodes, np.arange(episodes) >= 6)
    never = arrays(seeds, episodes, 0)
    greedy = {"learns": arrays(seeds, 3, 1), "never": arrays(seeds, 3, 0)}
    return Arrays({"learns": learns, "never": never}, greedy, measures=MEASURES)


def test_the_table_takes_the_ends_of_training_and_the_evaluation():
    learns, never = analyse(made_up().frames()).table
    assert (learns.condition, learns.seeds) == ("learns", 4)
    values = {title: float(e.value) for title, e in learns.estimates.items()}
    assert values["success first 5"] == 0.0
    assert values["success last 5"] == 1.0
    assert values["evaluation success"] == 1.0
    assert values["final distance last 5 [m]"] == np.mean([7, 8, 9, 10, 11])
    assert float(never.estimates["success last 5"].value) == 0.0
    assert list(learns.estimates) == [
        "success first 5", "success last 5", "evaluation success", "evaluation steps",
        "final distance last 5 [m]", "time in contact last 5",
    ]  # fmt: skip


def test_a_measure_of_one_condition_has_a_panel_with_its_curve_alone():
    results = made_up()
    results.measures = (*MEASURES, ORIENTATION)
    results.training["learns"][ORIENTATION.name] = np.full((4, 12), 20.0)
    analysis = analyse(results.frames())
    followed = {measure.heading: list(training) for measure, training in analysis.cases}
    assert followed["final orientation error [deg]"] == ["learns"]
    assert followed["success"] == ["learns", "never"]
    learns, never = (line.estimates for line in analysis.table)
    assert float(learns["final orientation error last 5 [deg]"].value) == 20.0
    assert "final orientation error last 5 [deg]" not in never
    panels = {axes.get_title(loc="left"): axes for axes in draw(analysis)["learning-curves"].axes}
    assert len(panels["final orientation error [deg]"].lines) < len(panels["success"].lines)


def test_curves_have_a_point_for_every_episode():
    curves = {m.name: curves_of(m, own) for m, own in analyse(made_up().frames()).cases}
    assert curves["final_distance_m"]["learns"].value.tolist() == list(range(12))
    assert curves["success"]["never"].value.tolist() == [0.0] * 12
    assert (curves["success"]["never"].high > 0.3).all()


def test_few_episodes_no_evaluation_and_one_seed_are_no_trouble(tmp_path):
    results = Arrays({"alone": arrays(1, 2, 1)}, {}, measures=MEASURES)
    analysis = analyse(results.frames())
    (success, *_) = analysis.cases
    assert "evaluation success" not in analysis.table[0].estimates
    assert np.isnan(curves_of(*success)["alone"].low).all()
    assert len(save(draw(analysis), tmp_path)) == 2


def test_conditions_may_have_unequal_numbers_of_seeds(tmp_path):
    results = made_up()
    results.training["never"] = arrays(2, 12, 0)
    results.evaluation.pop("never")
    analysis = analyse(results.frames())
    assert [line.seeds for line in analysis.table] == [4, 2]
    _, svg = save(draw(analysis), tmp_path)
    assert "never (2 seeds)" in svg.read_text()


def test_equal_results_give_equal_figures(tmp_path):
    once = [path.read_bytes() for path in save(draw(analyse(made_up().frames())), tmp_path)]
    again = [path.read_bytes() for path in save(draw(analyse(made_up().frames())), tmp_path)]
    assert once == again


def test_every_condition_is_in_the_legend(tmp_path):
    many = {f"condition {i}": arrays(2, 3, i % 2) for i in range(13)}
    _, svg = save(draw(analyse(Arrays(many).frames())), tmp_path)
    text = svg.read_text()
    assert all(f">{name}<" in text for name in many)


def test_the_interval_of_a_cell():
    assert format_estimate(Estimate(0.5, np.nan, np.nan)) == "0.50"
    assert format_estimate(Estimate(0.5, 0.25, 1.0)) == "0.50 [0.25, 1.00]"
    assert format_estimate(Estimate(-0.6, -0.72, -0.53)) == "-0.60 [-0.72, -0.53]"
    assert format_number(float("nan")) == "?"


@pytest.mark.parametrize("form", ["table", "csv", "json"])
def test_no_rows_can_be_written(form):
    expected = {"table": "", "csv": "condition,phase,seed\n", "json": "[]\n"}
    file = io.StringIO()
    write_rows(pd.DataFrame(columns=["condition", "phase", "seed"]), [], form, file)
    assert file.getvalue() == expected[form]


@pytest.mark.parametrize("further", range(6))
def test_there_is_a_panel_for_every_number(further, tmp_path):
    numbers = [Measure(f"x{k}", f"quantity {k}", "m") for k in range(further)]
    measures = (SUCCESS, *numbers, Measure("calm", "calm", is_rate=True))
    training = {"only": {m.name: np.ones((2, 3)) for m in measures}}
    analysis = analyse(Arrays(training, {}, measures=measures).frames())
    assert [m.name for m, _ in analysis.cases] == [
        "success",
        *(m.name for m in numbers),
    ]
    figure = draw(analysis)["learning-curves"]
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title(loc="left") for axes in shown] == [m.heading for m, _ in analysis.cases]
    assert {axes.get_xlabel() for axes in shown} == {"episode"}


def test_success_alone_makes_a_table():
    assert [title for title, *_ in metrics_of((SUCCESS,), SUCCESS, STEPS, 20)] == [
        "success first 5", "success last 5", "evaluation success", "evaluation steps",
    ]  # fmt: skip
