import pickle
from dataclasses import replace
from pathlib import Path

import pytest
from made_up_results import NOTHING, SEEDS, Arrays, shapes

from nested_agents.studies.catalogue.hierarchies import DECIDING
from nested_agents.studies.catalogue.study import draw_figures
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from research import SPECS, study_of
from research.studies import edges as module
from research.studies.edges import TRAINED, analyse, check, draw, measure

SILENT = {"topology": {"communication": "none"}}
ALONE = {"topology": {"communication": "none", "lookahead": "none"}}
OUTCOMES = {"told only": 0.3, "considered only": 0.93}


def made_up(outcomes: dict[str, float] = OUTCOMES) -> Arrays:
    base = shapes(outcomes)
    names = (TRAINED, *outcomes)
    base.numbers["own-value"] = {f"messages.{name}": [6.0] * SEEDS for name in names}
    base.numbers["own-value"]["robots"] = [2.0] * SEEDS
    base.usage["own-value"] = {f"decision.{name}": [0.008] * SEEDS for name in names}
    return base


def test_every_hierarchy_is_compared_with_that_of_training() -> None:
    analysis = analyse(made_up().frames())
    names = [TRAINED, *OUTCOMES]
    assert [line.condition for line in analysis.table] == names
    ((told, considered),) = analysis.differences.values()
    assert (told.condition, considered.condition) == tuple(OUTCOMES)
    assert told.estimate.high < -0.4
    assert told.p < 0.01 < considered.p
    assert any(note.startswith("  worse: told only, -0.") for note in analysis.notes)
    found = "  no significant difference: considered only"
    assert any(note.startswith(found) for note in analysis.notes)
    values = analysis.table[1].estimates
    assert (float(values["messages"].value), float(values[DECIDING].value)) == (6.0, 8.0)


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    paths = save(draw(analyse(made_up().frames())), tmp_path)
    assert [path.name for path in paths] == ["differences.png", "differences.svg"]
    assert draw_figures(module, analyse(NOTHING)) == {}


def test_the_legend_fits_a_narrow_figure() -> None:
    (figure,) = draw(analyse(made_up().frames())).values()
    figure.draw_without_rendering()
    box = figure.legends[0].get_window_extent()
    assert box.x0 >= 0
    assert box.x1 <= figure.bbox.x1


def test_conditions_that_differ_in_more_are_compared_with_their_own_training() -> None:
    results = made_up().frames()
    assert analyse(results).cases[0].setting == ""
    columns = {
        c: {"name": "", "topology": "tree:2", "scenario.robots": 2} for c in results.conditions
    }
    named = analyse(replace(results, columns=columns))
    assert {case.setting for case in named.cases} == {"2 robots, tree:2"}


def test_told_by_considered_is_drawn_as_four_fields_for_each_size() -> None:
    results = made_up(OUTCOMES | {"neither": 0.0})
    results.columns["own-value"] = {"name": "", "scenario.robots": 2}
    analysis = analyse(results.frames())
    larger = [case._replace(robots=4) for case in analysis.cases]
    figure = draw(replace(analysis, cases=[*analysis.cases, *larger]))["edges"]
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["2 robots", "4 robots"]
    fields = [text.get_text() for text in figure.axes[0].texts[::2]]
    assert fields[0] == "0"  # neither
    assert fields[2].startswith("0.3")  # told only
    assert figure.axes[0].images[0].get_array().shape == (2, 2)


def test_a_spec_without_another_hierarchy_is_refused() -> None:
    with pytest.raises(SpecError, match=r"evaluations: missing; .*EdgesStudy needs one at least"):
        check(Spec.of({"study": study_of("edges")}))


def test_one_team_acts_under_every_hierarchy() -> None:
    table = {"study": study_of("edges"), "seeds": [7], "episodes": 1, "steps": 6, "evaluation": 2}
    evaluations = {
        "same": {"topology": {"communication": "ancestors"}},
        "silent": SILENT,
        "alone": ALONE,
    }
    (trial,) = trials_of(Spec.of(table | {"evaluations": evaluations}))
    result = measure(trial)
    phases = {row.phase: [] for row in result.rows}
    for row in result.rows:
        phases[row.phase].append((row.steps, row.return_, row.measures))
    assert list(phases)[1:] == ["evaluation", *(f"evaluation:{name}" for name in evaluations)]
    assert phases["evaluation"] == phases["evaluation:same"] != phases["evaluation:alone"]
    messages = {name: result.numbers[f"messages.{name}"] for name in (TRAINED, *evaluations)}
    assert messages == {TRAINED: 6.0, "same": 6.0, "silent": 0.0, "alone": 0.0}
    assert pickle.loads(pickle.dumps(trial)) == trial
    assert pickle.loads(pickle.dumps(trial)).identity == trial.identity


def test_the_same_team_acts_as_if_it_had_been_built_under_the_other_hierarchy() -> None:
    """A chain that tells and considers nothing decides as independent agents do."""
    table = {"study": study_of("edges"), "seeds": [3], "episodes": 1, "steps": 6, "evaluation": 2}
    evaluations = {"parted": ALONE, "independent": {"topology": "independent"}}
    (trial,) = trials_of(Spec.of(table | {"evaluations": evaluations}))
    rows = measure(trial).rows
    parted, apart = (
        [(row.steps, row.return_) for row in rows if row.phase == f"evaluation:{name}"]
        for name in evaluations
    )
    assert parted == apart


def test_the_specs_can_be_run() -> None:
    for path in sorted(SPECS.glob("edges*.toml")):
        spec = Spec.load(path)
        check(spec)
        assert len(spec.seeds) >= 5
