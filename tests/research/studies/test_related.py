from pathlib import Path

import numpy as np
import pytest
from made_up_results import NOTHING, Arrays

from nested_agents.studies.catalogue.study import draw_figures
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import save
from nested_agents.studies.results.results import Results
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from research import SPECS, study_of
from research.studies import related as module
from research.studies.related import analyse, check, draw, measure

CHANGES = ["seeds=2", "episodes=1", "steps=20", "evaluation=1"]


@pytest.fixture(scope="module")
def results() -> Results:
    """All systems on the climbing game, two seeds of a few plays."""
    found = Arrays()
    for trial in trials_of(Spec.load(SPECS / "climbing.toml", CHANGES)):
        result, name = measure(trial), trial.condition
        (last,) = (row for row in result.rows if row.phase == "evaluation")
        for kept, values in (
            (found.evaluation, {"success": [[last.measures["success"]]], "steps": [[last.steps]]}),
            (found.numbers, result.numbers),
            (found.usage, {**result.seconds, **result.usage}),
        ):
            own = kept.setdefault(name, {})
            for key, value in values.items():
                before = [own[key]] if key in own else []
                own[key] = np.concatenate([*before, np.atleast_1d(np.asarray(value))])
    found.columns.update({name: {"name": name} for name in found.evaluation})
    return found.frames()


def test_what_is_counted_is_what_the_formulas_say(results: Results) -> None:
    """Two agents of three actions; an agent's table holds 9 values, or 3 of its own actions."""
    found = {case.system: case.values for case in analyse(results).cases}
    for system, tried, messages in (
        ("nested", (9 + 3) * 9, 1),
        ("joint-action learners", (9 + 9) * 9, 2),
        ("independent", (3 + 3) * 3, 0),
        ("variable elimination", (9 + 9) * 9, 2),
        ("single agent", 9 * 81, 0),
    ):
        values = found[system]
        assert float(values["formula"].value) == tried, system
        assert float(values["counted"].value) == tried, system
        assert float(values["messages"].value) == messages, system
    assert float(found["nested"]["memory [kB]"].value) == 2 * 9 * 8e-3


def test_it_is_tabulated_and_drawn(results: Results, tmp_path: Path) -> None:
    analysis = analyse(results)
    assert [line.seeds for line in analysis.table] == [2] * 9
    assert list(analysis.table[0].estimates)[:3] == ["evaluation success", "decisions", "ms"]
    paths = save(draw(analysis), tmp_path)
    assert [path.name for path in paths] == ["related.png", "related.svg"]
    assert draw_figures(module, analyse(NOTHING)) == {}


@pytest.mark.parametrize("name", ["climbing", "related-arms", "related-boxes"])
def test_its_specs_have_the_systems_of_the_paper(name: str) -> None:
    names = {c.columns["name"] for c in Spec.load(SPECS / f"{name}.toml").conditions()}
    assert names >= {
        "nested", "independent", "joint-action learners", "variable elimination", "max-plus",
        "value decomposition", "single agent", "frozen",
    }  # fmt: skip


def test_without_evaluation_it_is_refused() -> None:
    with pytest.raises(SpecError, match=r"evaluation = 0: .*RelatedStudy compares"):
        check(Spec.of({"study": study_of("related"), "evaluation": 0}))
