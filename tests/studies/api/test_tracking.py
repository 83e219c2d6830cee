"""Trackers are told of every trial; what is not installed, or unknown, is refused before a run."""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import pytest

from nested_agents.studies.api import tracking
from nested_agents.studies.api.running import run
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.tables import dumps

SPEC: dict[str, Any] = {
    "seeds": 2,
    "episodes": 2,
    "steps": 3,
    "evaluation": 1,
    "scenario": {"kind": "line-up"},
    "preset": "random",
}


class Writer:
    """TensorBoard's, as far as it is used."""

    written: ClassVar[list[tuple[str, str, float, int]]] = []

    def __init__(self, place: str) -> None:
        self.place = place

    def add_scalar(self, name: str, value: float, step: int) -> None:
        self.written.append((Path(self.place).name, name, value, step))

    def close(self) -> None:
        pass


def test_every_trial_is_written_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("tensorboard.summary")
    vars(module)["Writer"] = Writer
    monkeypatch.setitem(sys.modules, "tensorboard", ModuleType("tensorboard"))
    monkeypatch.setitem(sys.modules, "tensorboard.summary", module)
    monkeypatch.setattr(Writer, "written", [])
    study = run(SPEC, tmp_path, jobs=1, progress=False, track=["tensorboard"])
    returns = {(f"seed {s}", e): r for s, e, r in _returns(study, "training")}
    named = {(w, k): v for w, name, v, k in Writer.written if name == "training/return"}
    assert named == returns
    assert {name for _, name, *_ in Writer.written} >= {"evaluation/success", "training/steps"}
    count = len(Writer.written)
    run(SPEC, tmp_path, jobs=1, progress=False, track=["tensorboard"])
    assert len(Writer.written) == count


def _returns(study: Any, phase: str) -> list[tuple[int, int, float]]:
    rows = study.episodes.query("phase == @phase")[["seed", "episode", "return"]]
    return list(rows.itertuples(index=False, name=None))


@pytest.mark.parametrize("name", ["tensorboard", "mlflow", "wandb"])
def test_the_real_trackers(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip(tracking.TRACKERS[name].package)
    monkeypatch.setenv("WANDB_MODE", "offline")
    monkeypatch.setenv("MLFLOW_ALLOW_FILE_STORE", "true")  # of the small package mlflow-skinny
    monkeypatch.setenv("MLFLOW_TRACKING_URI", f"file:{tmp_path / 'mlflow'}")
    monkeypatch.chdir(tmp_path)
    run(SPEC, tmp_path / "study", jobs=1, progress=False, track=[name])
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert any(name in str(path.relative_to(tmp_path)) for path in files)


def test_what_is_not_installed_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "mlflow", None)
    spec = tmp_path / "spec.toml"
    spec.write_text(dumps(SPEC))
    line = ["run", str(spec), "--out", str(tmp_path / "out"), "--track", "mlflow"]
    assert main(line) == 2
    error = capsys.readouterr().err
    assert error.splitlines()[-1] == (
        "nested-agents: error: track = 'mlflow': mlflow is not installed; pip install mlflow"
    )
    assert not (tmp_path / "out").exists()


def test_an_unknown_tracker_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="track = 'tensorbord': did you mean 'tensorboard'"):
        run(SPEC, tmp_path / "out", jobs=1, progress=False, track=["tensorbord"])
    assert not (tmp_path / "out").exists()
