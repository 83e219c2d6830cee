import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from acting import fuzzy
from made_up_results import NOTHING, ablation, wheel_failure
from matplotlib.patches import Rectangle

from nested_agents.studies.catalogue import wheel_failure as module
from nested_agents.studies.catalogue.study import draw_figures
from nested_agents.studies.catalogue.wheel_failure import (
    AT_END,
    Course,
    analyse,
    check,
    draw,
    measure,
)
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.report.sentences import condition_sentences, main_title
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.measured import default_measure, values_of
from nested_agents.studies.results.recovery import (
    LOWER_BOUND,
    RECOVERY,
    TIMES,
    FailureCourse,
    failure_course,
)
from nested_agents.studies.results.results import KEPT
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session, run_trial
from nested_agents.studies.trials.trial import trials_of
from research import SPECS

ENDS = {
    "4 wheels, seized": {"nothing": 0.05, "weights": 0.4, "self-model": 0.7, "both": 0.95},
    "2 wheels, seized": {"nothing": 0.0, "weights": 0.0, "self-model": 0.0, "both": 0.0},
}
SEIZED = {"kind": "seized", "wheels": "robot1.left", "episode": 5}
SHORT = {
    "study": "wheel-failure", "seeds": [7], "episodes": 10, "steps": 4, "evaluation": 0,
    "scenario": {"failures": [SEIZED]}, "learner": {"self_model": {"enabled": True}},
}  # fmt: skip


def test_levels_recovery_and_area_by_hand() -> None:
    success = np.array([[1] * 6 + [0, 0, 1, 1, 1, 1, 1, 1], [1] * 6 + [0] * 8], dtype=float)
    steps = np.full(success.shape, 10.0)
    course = FailureCourse((6,), success, steps, (0, 1))
    assert {name: values.tolist() for name, values in course.measured.items()} == {
        "recovered": [1.0, 0.0],
        "cumulative_loss": [2.0, 8.0],
        "recovery_time": [2.0, 8.0],
        "recovery_decisions": [20.0, 80.0],
    }
    assert (course.before.mean(), course.end.mean()) == (1.0, 0.5)


def test_loss_is_against_the_level_of_each_seed() -> None:
    """A seed at 0.4 before and after loses nothing; the mean level of both would be 0.7."""
    before = [[1, 1, 1, 1, 1], [0, 1, 0, 1, 0]]
    after = [[0, 0, 0, 0, 0, 1, 1, 1, 1, 1], [0, 1, 0, 1, 0] * 2]
    success = np.hstack([before, after]).astype(float)
    course = FailureCourse((5,), success, np.full(success.shape, 3.0), (4, 9))
    assert course.measured["cumulative_loss"].tolist() == [5.0, pytest.approx(0.0)]
    assert course.measured["recovered"].tolist() == [1.0, 1.0]
    assert course.measured["recovery_time"].tolist() == [5.0, 0.0]
    line = Course("fault", "both", ((5, None),), course, 3).summary
    low, high = (float(end) for end in line.estimates["cumulative loss [episodes]"][1:])
    spread = 12.706 * 2.5  # Student's t of one degree of freedom, standard error of 5 and 0
    assert (low, high) == (-10.0, 10.0), f"2.5 +- {spread:.1f}, within what 10 episodes can lose"


def test_recovery_is_compared_from_the_failure_on() -> None:
    results = wheel_failure(ENDS).frames()
    course = failure_course(results, "4 wheels, seized, enabled=false")
    for name in RECOVERY:
        compared = compare_conditions(results, name)
        own = compared.groups[0].values["4 wheels, seized, enabled=false"]
        assert own.tolist() == course.measured[name].tolist()
    compared = compare_conditions(results, "recovery time [episodes]", by="enabled")
    assert {d.condition for d in compared.differences} == {"self_model.enabled=true"}
    kept = compare_conditions(results, "recovered", "weights kept")
    assert kept.title == "recovered, weights kept"
    assert kept.differences[0].estimate.value > 0.5, "the self-model adapts, nothing does not"
    with pytest.raises(SpecError, match=r"'recoverd': did you mean 'recovered'"):
        compare_conditions(results, "recoverd")
    with pytest.raises(SpecError, match="phase = 'evaluation'"):
        compare_conditions(results, "recovered", "evaluation")


def test_hierarchies_are_compared_with_the_first_by_recovery() -> None:
    made = wheel_failure(ENDS)
    for columns in made.columns.values():
        del columns[module.SWEPT]
    results = made.frames()
    analysis = analyse(results)
    assert results.main.name == "success", "a mean over episodes before and after the failure"
    assert default_measure(results) == "recovered"
    compared = compare_conditions(results, default_measure(results)).differences
    assert analysis.differences["recovered"] == tuple(
        replace(d, measure="recovered") for d in compared
    )
    assert [d.condition for d in compared] == [*made.columns][1:]
    assert any(note.startswith("Power:") for note in analysis.notes)


def test_recovery_is_no_measure_of_an_evaluation() -> None:
    made = wheel_failure(ENDS)
    made.evaluation = made.training
    with pytest.raises(SpecError, match=r"phase = 'evaluation'.*'weights kept'"):
        compare_conditions(made.frames(), "recovered", "evaluation")


def test_mean_recovery_times_are_said_to_be_lower_bounds() -> None:
    results = wheel_failure(ENDS).frames()
    compared = {name: compare_conditions(results, name).notes for name in RECOVERY}
    notes = {"study": analyse(results).notes, **compared}
    said = {name for name, lines in notes.items() if LOWER_BOUND in " ".join(map(str.strip, lines))}
    assert said == {"study", "recovery_time", "recovery_decisions"}


@pytest.mark.parametrize("name", TIMES)
def test_times_of_seeds_that_never_recover_are_printed_as_lower_bounds(name: str) -> None:
    results = wheel_failure(ENDS).frames()
    lines = [*analyse(results).table, *compare_conditions(results, name).table]
    title = RECOVERY[name].heading
    table = tabulate([line for line in lines if title in line.estimates])
    nothing, both = (
        next(row[title] for label, row in table.cells.set_axis(labels).iterrows() if end in label)
        for labels in [[line.condition for line in table.lines]]
        for end in ("2 wheels, seized: nothing", "4 wheels, seized: both")
    )
    assert nothing.startswith(">= ")
    assert "[" not in nothing
    assert "[" in both, "all seeds recovered"
    assert "Lower bounds (>=)" in " ".join(table.legend)
    assert main_title(table) == AT_END
    assert f"$\\ge{nothing.removeprefix('>= ')}$" in table.latex
    (row,) = (r for r in json.loads(table.json) if "2 wheels, seized: nothing" in r["condition"])
    assert row["estimates"][title]["high"] is None
    with pytest.raises(SpecError, match="never recovers"):
        values_of(results, name)


def test_each_condition_has_the_range_of_its_own_failure() -> None:
    """A condition that fails late cannot need more episodes than it has left."""
    made = wheel_failure(ENDS)
    late = "4 wheels, seized, enabled=true"
    made.numbers[late]["onset"] = made.numbers[late]["onset"] + 10
    lines = compare_conditions(made.frames(), "recovery_time").table
    highest = {line.condition: line.estimates["recovery time [episodes]"].value for line in lines}
    assert highest[late] <= 10 < max(highest.values())


def test_recovery_is_no_measure_where_nothing_fails() -> None:
    results = ablation({"a": 0.5, "b": 0.5}).frames()
    with pytest.raises(SpecError, match="measure = 'recovered'"):
        compare_conditions(results, "recovered")


def test_the_end_of_a_transient_failure_is_marked(tmp_path: Path) -> None:
    made = wheel_failure(ENDS, onset=20, episodes=40)
    for condition in made.numbers:
        made.numbers[condition]["failure_end"] = np.full_like(
            made.numbers[condition]["onset"], 30.0
        )
    analysis = analyse(made.frames())
    for line in analysis.table:
        assert float(line.estimates["failure ends [episode]"].value) == 30.0
        assert "success after its end" in line.estimates
    assert any("not adaptation" in note for note in analysis.notes)
    figure = draw(analysis)["wheel-failure"]
    (area,) = [p for p in figure.axes[0].patches if isinstance(p, Rectangle)]
    assert (area.get_x(), area.get_x() + area.get_width()) == (19.5, 29.5)
    lasting = draw(analyse(wheel_failure(ENDS).frames()))["wheel-failure"]
    assert not lasting.axes[0].patches
    assert not any(
        "ends" in t for line in analyse(wheel_failure(ENDS).frames()).table for t in line.estimates
    )


def test_spans_of_failures_survive_as_numbers() -> None:
    spans = [(9, 12), (5, None), (7, 8)]
    numbers = {name: np.array([value]) for name, value in module._numbers_of(spans).items()}
    assert module._failure_spans(numbers) == ((5, None), (7, 8), (9, 12))


def test_cases_are_told_apart_by_what_adapts() -> None:
    analysis = analyse(wheel_failure(ENDS).frames())
    assert [line.condition.rpartition(": ")[2] for line in analysis.table] == [
        "nothing", "weights", "self-model", "both",
    ] * 2  # fmt: skip
    ends = {line.condition: float(line.estimates[AT_END].value) for line in analysis.table}
    assert ends["4 wheels, seized: both"] > 0.85
    assert ends["4 wheels, seized: nothing"] < 0.2
    gains = {gain.condition: gain for gain in analysis.differences[AT_END]}
    assert len(gains) == 6
    assert gains["4 wheels, seized: both"].p < 0.001
    assert gains["2 wheels, seized: both"].p == 1.0


def test_training_is_compared_with_kept_weights_where_no_self_model_is_swept() -> None:
    """Both cases of each fault share their seeds; how often teams recover is a second question."""
    made = wheel_failure(ENDS)
    for columns in made.columns.values():
        del columns[module.SWEPT]
    analysis = analyse(made.frames())
    gains = {gain.condition: gain for gain in analysis.differences[AT_END]}
    assert set(gains) == {f"{condition}: training" for condition in made.columns}
    ends = {line.condition: float(line.estimates[AT_END].value) for line in analysis.table}
    for condition in made.columns:
        gain = float(gains[f"{condition}: training"].estimate.value)
        kept = ends[f"{condition}: {KEPT}"]
        assert gain == pytest.approx(ends[f"{condition}: training"] - kept)
    sentences = condition_sentences(tabulate(analysis.table), AT_END, analysis)
    assert ["difference in" in text for text in sentences] == [False, True] * len(made.columns)


def test_what_never_succeeded_has_nothing_to_recover() -> None:
    results = wheel_failure({"fault": dict.fromkeys(ENDS["4 wheels, seized"], 0.0)})
    for phase in (results.training, results.phases[KEPT]):
        for arrays in phase.values():
            arrays["success"][:] = 0
    analysis = analyse(results.frames())
    for line in analysis.table:
        assert list(line.estimates) == ["success before", "success just after", AT_END]
    text = " ".join(" ".join(analysis.notes).split())
    assert "not measured for seeds without success before the failure: fault (" in text
    with pytest.raises(SpecError, match="'recovered': no seed succeeded before a failure began"):
        compare_conditions(results.frames(), "recovered")
    assert default_measure(results.frames()) == "success"


def test_rows_with_other_seeds_without_success_are_named_apart() -> None:
    results = wheel_failure(ENDS)
    results.training["4 wheels, seized, enabled=false"]["success"][:2] = 0
    results.training["4 wheels, seized, enabled=true"]["success"][:1] = 0
    notes = analyse(results.frames()).notes
    seeds = len(results.seeds["4 wheels, seized, enabled=true"])
    assert f"  4 wheels, seized (nothing, weights): 2 of {seeds} seeds" in notes
    assert f"  4 wheels, seized (self-model, both): 1 of {seeds} seeds" in notes
    assert not any("2 wheels" in note and "of" in note.split(": ")[-1] for note in notes)


def test_a_comparison_names_the_seeds_without_success_before_the_failure() -> None:
    results = wheel_failure(ENDS)
    label = "4 wheels, seized, enabled=false"
    results.training[label]["success"][:2] = 0
    compared = compare_conditions(results.frames(), "recovered")
    total = len(compared.groups[0].values["2 wheels, seized, enabled=false"])
    assert len(compared.groups[0].values[label]) == total - 2
    text = " ".join(" ".join(compared.notes).split())
    assert f"without success before the failure, left out: {label}, 2 of {total}." in text


def test_seeds_without_success_before_the_failure_do_not_recover() -> None:
    success = np.zeros((3, 15))
    success[0] = 1.0
    success[1, :5] = 1.0
    course = FailureCourse((5,), success, np.full(success.shape, 3.0), (0, 1, 2))
    for name, values in course.measured.items():
        assert np.isnan(values).tolist() == [False, False, True], name
    line = Course("fault", "both", ((5, None),), course, 3).summary
    assert float(line.estimates["recovered"].value) == 0.5
    assert float(line.estimates["cumulative loss [episodes]"].value) == 5.0


def test_a_team_that_recovers_between_failures_and_collapses_has_not_recovered() -> None:
    success = np.ones((2, 30))
    success[:, 5:7] = 0.0
    success[0, 20:] = 0.0
    course = FailureCourse((5, 20), success, np.full(success.shape, 3.0), (0, 1))
    assert course.measured["recovered"].tolist() == [0.0, 1.0]
    assert course.measured["recovery_time"].tolist() == [25.0, 15.0]


def test_a_level_after_a_failure_needs_as_many_episodes_as_all_levels() -> None:
    success = np.ones((2, 16))
    course = FailureCourse((6,), success, success, (0, 1))
    short = Course("fault", "both", ((6, 14),), course, 3).summary
    assert "failure ends [episode]" in short.estimates
    assert "success after its end" not in short.estimates
    long = Course("fault", "both", ((6, 11),), course, 3).summary
    assert "success after its end" in long.estimates


@pytest.mark.parametrize(
    ("columns", "faults"),
    [
        ({"learner.self_model.enabled": "{}"}, ["the failure"]),
        ({"learner.self_model.enabled": "{}", "scenario.box": "circle"}, ["circle"]),
        (
            {"name": "a", "scenario.action_repeat": 4, "learner.self_model.enabled": "{}"},
            ["a, action_repeat=4"],
        ),
        ({"name": "a", "scenario.action_repeat": "", "learner.self_model.enabled": "{}"}, ["a"]),
        ({"learner.calibration.enabled": "{}"}, None),
    ],
)
def test_twins_are_found_by_what_is_swept(columns: dict, faults: list | None) -> None:
    results = wheel_failure({"fault": ENDS["4 wheels, seized"]})
    for condition in results.training:
        enabled = condition.rpartition("=")[2]
        results.columns[condition] = {
            k: v.format(enabled) if v == "{}" else v for k, v in columns.items()
        }
    analysis = analyse(results.frames())
    found = [tuple(line.condition.split(": ")) for line in analysis.table]
    if faults is None:  # nothing is said of self-models
        assert {adapts for _, adapts in found} == {"training", KEPT}
        assert {fault for fault, _ in found} == set(results.training)
        gains = [difference.condition for difference in analysis.differences[AT_END]]
        assert gains == [f"{fault}: training" for fault in results.training]
    else:
        cases = ("nothing", "weights", "self-model", "both")
        assert found == [(fault, adapts) for fault in faults for adapts in cases]
        assert len(analysis.differences[AT_END]) == 3


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    paths = save(draw(analyse(wheel_failure(ENDS).frames())), tmp_path)
    assert [path.name for path in paths] == ["wheel-failure.png", "wheel-failure.svg"]
    assert draw_figures(module, analyse(NOTHING)) == {}


def test_training_goes_through_the_failure_and_a_copy_keeps_its_weights() -> None:
    (trial,) = trials_of(Spec.of(SHORT))
    result = measure(trial)
    plain = run_trial(trial)
    training = tuple(row for row in result.rows if row.phase == "training")
    assert training == plain.rows
    kept = [row for row in result.rows if row.phase == KEPT]
    assert [row.episode for row in kept] == [5, 6, 7, 8, 9]
    assert kept[0] == training[5]._replace(phase=KEPT), "no learning ends before the first episode"
    assert result.numbers == {"onset": 5.0}
    assert list(result.recordings) == ["first", "before", "after", "last"]
    assert not result.recordings["before"]["failed"].any()
    assert result.recordings["after"]["failed"][1:].any()


def test_the_copy_keeps_weights_but_not_its_model_of_itself() -> None:
    (trial,) = trials_of(Spec.of(SHORT))
    session = Session(trial)
    session.train(5)
    copy = module._keeping_weights(session)
    theta, effects = (
        fuzzy(copy).learner.theta.copy(),
        fuzzy(copy).model.self_model.effects[0].copy(),
    )
    assert (theta == fuzzy(session.team).learner.theta).all()
    session.train(3, 5, phase=KEPT, team=copy)
    assert (fuzzy(copy).learner.theta == theta).all()
    assert (fuzzy(copy).model.self_model.effects[0] != effects).any()
    assert (fuzzy(session.team).model.self_model.effects[0] == effects).all()


@pytest.mark.parametrize(
    ("failures", "said"),
    [([], "needs one"), ([SEIZED | {"episode": 4}], "allowed 5 to 5 of 10"),
     ([SEIZED | {"episode": 6}], "begins in episode 6")],
)  # fmt: skip
def test_a_spec_without_a_failure_in_the_midst_is_refused(failures: list, said: str) -> None:
    with pytest.raises(SpecError, match=said):
        check(Spec.of(SHORT | {"scenario": {"failures": failures}}))


def test_too_few_episodes_for_the_two_levels_are_refused() -> None:
    with pytest.raises(SpecError, match=r"episodes = 9: wheel-failure needs 10 or more"):
        check(Spec.of(SHORT | {"episodes": 9}))


def test_an_unfinished_condition_is_left_out() -> None:
    results = wheel_failure(ENDS)
    results = replace(results, phases={})
    assert analyse(results.frames()).table == ()


def test_the_spec_can_be_run_and_crosses_faults_with_self_models() -> None:
    spec = Spec.load(Path(module.__file__).parent / "wheel_failure.toml")
    check(spec)
    labels = [condition.label for condition in spec.conditions()]
    assert len(spec.seeds) >= 20
    assert "4 wheels, seized, enabled=true" in labels
    others = Spec.load(SPECS / "wheel-faults.toml")
    check(others)
    assert "2 wheels, seized, enabled=false" in [c.label for c in others.conditions()]


def test_large_teams_lose_more_and_more_wheels_of_different_robots() -> None:
    spec = Spec.load(SPECS / "large-failures.toml")
    check(spec)
    lost = []
    for condition in spec.conditions():
        scenario = condition.settings.scenario
        (failure,) = scenario.failures
        wheels = [failing.partition(".") for failing in failure.wheels]
        assert len({robot for robot, *_ in wheels}) == len(wheels)
        lost.append((scenario.robots, len(wheels)))
    assert list(dict.fromkeys(lost)) == [(n, k) for n in (8, 16) for k in (1, 2, 4, 8)]
