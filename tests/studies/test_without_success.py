"""Studies of tasks in which nothing is a success: all that compares them does so by returns."""

import pytest

import nested_agents as na
from nested_agents.core.interface.measures import NO_SUCCESS, RETURN, SUCCESS
from nested_agents.scenarios.adapters.settings import GymnasiumSettings
from nested_agents.studies.cli.main import main
from nested_agents.studies.results import published
from nested_agents.studies.spec.studies import MOVED
from research import study_of

SPREAD = {
    "seeds": 6, "episodes": 2, "steps": 4, "evaluation": 2, "scenario": {"kind": "spread"},
}  # fmt: skip
BESIDE_RANDOM = {
    "overrides": [
        {"name": "fitted-q", "learner": {"kind": "fitted-q"}},
        {"name": "random", "preset": "random"},
    ]
}
FITTED = {"learner": {"kind": "fitted-q"}}
STUDIES = {
    "learning-curve": BESIDE_RANDOM,
    "peers": BESIDE_RANDOM,
    "ablation": BESIDE_RANDOM,
    "chain-order": {**FITTED, "sweep": {"topology": ["chain", "chain:reversed"]}},
    "hierarchies": {**FITTED, "sweep": {"topology": ["chain", "independent"]}},
    "scaling": {**FITTED, "sweep": {"scenario.particles": [2, 3]}},
    "edges": {**FITTED, "evaluations": {"told only": {"topology": {"lookahead": "none"}}}},
    "experience": {**BESIDE_RANDOM, "decisions": 20},
}


@pytest.mark.parametrize("study", STUDIES)
def test_studies_compare_returns(study, tmp_path, capsys) -> None:
    reference = study_of(study) if study in MOVED else study
    table = {**SPREAD, "study": reference, **STUDIES[study]}
    if study == "experience":
        del table["episodes"]
    kept = na.run(table, tmp_path / "kept", jobs=1)
    first = kept.conditions[0]
    assert "success" not in "\n".join((str(kept.table()), *kept.notes, *kept.power))
    means = kept.results.means(first, "evaluation", "return")
    (line,) = [one for one in kept.analysis.table if one.condition.startswith(first)][:1]
    assert float(line.estimates["evaluation return"].value) == pytest.approx(means.mean())
    if len(kept.conditions) > 1:
        assert main(["compare", str(tmp_path / "kept")]) == 0
        out = capsys.readouterr().out
        assert "evaluation return, minus that of" in out
        assert "success" not in out
    assert kept.figures
    assert main(["report", str(tmp_path / "kept")]) == 0


def test_a_plan_speaks_of_returns() -> None:
    table = {**SPREAD, **BESIDE_RANDOM, "seeds": 8}
    text = " ".join(str(na.plan(table, timed=False)).split())
    assert "a difference of 1.2 standard deviations with power 0.80" in text
    assert "Differences of returns, as nothing is a success" in text
    text = " ".join(str(na.plan(table, timed=False, deviation=5.0, smallest=4.0)).split())
    assert "a difference of 5.9 with power 0.80. A difference of 4 needs" in text
    with pytest.raises(na.SpecError, match=r"--smallest 4: for returns, give --deviation, too"):
        na.plan(table, timed=False, smallest=4.0)
    with pytest.raises(na.SpecError, match=r"--deviation -1: must be above 0$"):
        na.plan(table, timed=False, deviation=-1.0)


def test_published_results_keep_what_the_study_compares(tmp_path) -> None:
    kept = na.run({**SPREAD, **BESIDE_RANDOM}, tmp_path, jobs=1)
    assert kept.results.main == RETURN
    again = published.loads(published.dumps(kept.outline, kept.results)).results
    assert again.main == RETURN


def test_success_that_a_spec_names_is_compared_as_before() -> None:
    never = GymnasiumSettings(id="CartPole-v1")
    assert never.build().measures[0] == NO_SUCCESS
    named = never.model_copy(update={"success": {"return": 3.0}}).build()
    assert named.measures[0].greatest is None
    assert named.measures[0].name == SUCCESS.name
    assert named.measures[0].bounds == (0.0, 1.0)


def test_rows_reports_and_tuning_leave_success_out(tmp_path, capsys) -> None:
    table = {**SPREAD, **BESIDE_RANDOM}
    na.run(table, tmp_path / "kept", jobs=1)
    assert main(["results", str(tmp_path / "kept")]) == 0
    assert "success" not in capsys.readouterr().out
    assert main(["report", str(tmp_path / "kept")]) == 0
    page = (tmp_path / "kept" / "report.html").read_text(encoding="utf-8")
    assert "Evaluation return is highest with " in page
    alone = {**SPREAD, **FITTED, "tune": {"learner.ridge": [0.01, 1.0]}}
    tuned = na.tune(alone, tmp_path / "tuned", trials=3, seeds=2, jobs=1)
    assert any(line.startswith("Its return on these seeds") for line in tuned.lines)
