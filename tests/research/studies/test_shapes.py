from pathlib import Path

import pytest
from made_up_results import NOTHING, shapes

from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.study import run_trial as measure
from research import SPECS, study_of
from research.studies.shapes import analyse, check, draw

CHANCES = {"circle": 0.95, "hexagon": 0.9, "L": 0.3}


def test_ratios_to_the_box_of_training() -> None:
    analysis = analyse(shapes(CHANCES).frames())
    ((_, ratios),) = analysis.cases
    assert [d.condition for d in ratios] == list(CHANCES)
    assert min(ratios, key=lambda d: d.estimate.value).condition == "L"
    assert ratios[2].estimate.high < 0.5
    assert ratios[2].p < 0.001
    assert ratios[0].estimate.low > 0.9
    assert [line.condition for line in analysis.table] == ["trained on", *CHANCES]
    assert "contact" in analysis.table[1].estimates
    assert any(note.startswith("  L: 0.") for note in analysis.notes)


def test_the_figure_is_drawn_or_left_out(tmp_path: Path) -> None:
    paths = save(draw(analyse(shapes(CHANCES).frames())), tmp_path)
    assert [path.name for path in paths] == ["shapes.png", "shapes.svg"]
    assert draw(analyse(NOTHING)) == {}


def test_a_spec_without_another_box_is_refused() -> None:
    with pytest.raises(SpecError, match=r"evaluations: missing; .*ShapesStudy needs one at least"):
        check(Spec.of({"study": study_of("shapes")}))


def test_one_team_is_evaluated_with_every_box() -> None:
    table = {"study": study_of("shapes"), "seeds": [7], "episodes": 1, "steps": 4, "evaluation": 2}
    (trial,) = trials_of(Spec.of(table | {"evaluations": {"circle": {"box": "circle"}}}))
    result = measure(trial)
    assert result.rows == run_trial(trial).rows
    assert [row.phase for row in result.rows] == [
        "training", "evaluation", "evaluation", "evaluation:circle", "evaluation:circle",
    ]  # fmt: skip


def test_the_spec_holds_the_shapes_of_the_claim() -> None:
    spec = Spec.load(SPECS / "shapes.toml")
    (condition,) = spec.conditions()
    assert condition.settings.scenario.box == "square"
    assert {settings.scenario.box for _, settings in condition.evaluations} == {
        "rectangle", "circle", "triangle", "hexagon", "L",
    }  # fmt: skip
