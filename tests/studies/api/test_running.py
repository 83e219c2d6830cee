"""Studies are run, with made-up results."""

import made_up
import pytest

import nested_agents as na
from nested_agents.studies.api import running
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.spec import outline

TABLE = {"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2,
         "sweep": {"preset": ["default", "frozen"]}}  # fmt: skip


def test_code_that_a_study_knows_is_not_parsed_again(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(learning_curve, "measure", made_up.measure)
    monkeypatch.setattr(running, "check_conditions", lambda spec, **_: made_up.MEASURES)
    parsed: list[str] = []
    meaning = outline.meaning
    monkeypatch.setattr(outline, "meaning", lambda *of: parsed.append(of[1]) or meaning(*of))
    for _ in range(2):
        na.run(TABLE, tmp_path / "out", jobs=1, progress=False)
        assert parsed == [*outline.modules()]  # each once, when the study began


def test_failed_trials_are_warned_of(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(learning_curve, "measure", made_up.failing)
    monkeypatch.setattr(running, "check_conditions", lambda spec, **_: made_up.MEASURES)
    with pytest.warns(UserWarning, match=r"1 trial failed: study\.failed says why"):
        study = na.run(TABLE, tmp_path / "out", jobs=1, progress=False)
    ((condition, seed, error),) = study.failed
    assert (condition, seed) == ("frozen", 1)
    assert "a wheel came off" in error
