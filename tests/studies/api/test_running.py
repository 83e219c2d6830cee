"""Studies are run, with made-up results."""

import made_up
import pytest

import nested_agents as na
from nested_agents.studies.api import running
from nested_agents.studies.catalogue import learning_curve

TABLE = {"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2,
         "sweep": {"preset": ["default", "frozen"]}}  # fmt: skip


def test_failed_trials_are_warned_of(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(learning_curve, "measure", made_up.failing)
    monkeypatch.setattr(running, "check_conditions", lambda spec, **_: made_up.MEASURES)
    with pytest.warns(UserWarning, match=r"1 trial failed: study\.failed says why"):
        study = na.run(TABLE, tmp_path / "out", jobs=1, progress=False)
    ((condition, seed, error),) = study.failed
    assert (condition, seed) == ("frozen", 1)
    assert "a wheel came off" in error


@pytest.mark.parametrize("write", [na.run, na.tune])
def test_an_empty_path_is_not_the_current_folder(write) -> None:
    with pytest.raises(ValueError, match=r"^out = '', allowed: the path of a folder, '\.' for"):
        write(TABLE, "")
