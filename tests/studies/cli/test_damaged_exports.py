"""Exported files that were damaged, renamed or written by somebody else."""

import json
import random
from contextlib import suppress
from pathlib import Path

import made_up
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

FILES = {
    "csv": "episodes.csv",
    "parquet": "episodes.parquet",
    "json": "results.json",
    "marl-eval": "marl-eval.json",
}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with two conditions."""
    directory = tmp_path_factory.mktemp("study") / "out"
    table = {"seeds": 5, "episodes": 2, "steps": 5, "sweep": {"topology": ["chain", "star"]}}
    spec = Spec.of(table)
    with made_up.opened(directory, spec) as store:
        for trial in trials_of(spec):
            save(store, trial, made_up.measure(trial), 2.5)
    return directory


@pytest.mark.parametrize("form", FILES)
def test_a_flipped_bit_is_refused_or_told(study: Path, tmp_path: Path, form: str) -> None:
    assert main(["export", str(study), "--out", str(tmp_path), "--format", form]) == 0
    path = tmp_path / FILES[form]
    expected = na.load(path)
    assert not any("changed" in remark for remark in expected.remarks)
    rng = random.Random(form)
    for file in {path, tmp_path / "study.json"} & {*tmp_path.iterdir()}:
        content = file.read_bytes()
        for _ in range(12):
            damaged = bytearray(content)
            damaged[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
            file.write_bytes(damaged)
            with suppress(SpecError):
                read = na.load(path)
                is_told = any("changed since" in remark for remark in read.remarks)
                assert is_told or read.compare().table.csv == expected.compare().table.csv
        file.write_bytes(content)


def test_forms_in_one_folder_are_listed_together(study: Path, tmp_path: Path) -> None:
    for form in ("csv", "parquet", "marl-eval"):
        assert main(["export", str(study), "--out", str(tmp_path), "--format", form]) == 0
    listed = json.loads((tmp_path / "study.json").read_text())["files"]
    assert {*listed} == {path.name for path in tmp_path.iterdir()} - {"study.json"}
    (tmp_path / "episodes.csv").rename(tmp_path / "own.csv")
    assert any("lists" in remark for remark in na.load(tmp_path / "own.csv").remarks)


@pytest.mark.parametrize("form", FILES)
def test_an_exported_file_imports_no_module_that_its_spec_names(
    study: Path, tmp_path: Path, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["export", str(study), "--out", str(tmp_path), "--format", form]) == 0
    header = tmp_path / ("results.json" if form == "json" else "study.json")
    table = json.loads(header.read_text())
    table["spec"] |= {"study": "evil.parts:Study", "scenario": {"kind": "evil.parts:Scenario"}}
    header.write_text(json.dumps(table))
    (tmp_path / "evil").mkdir()
    for name in ("__init__", "parts"):
        (tmp_path / "evil" / f"{name}.py").write_text("raise SystemExit('is run')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    read = na.load(tmp_path / FILES[form])
    assert read.condition_settings() == {}
    with pytest.raises(SpecError, match=r"evil\.parts: named by .*--trust"):
        read.table()


def test_changing_a_table_changes_no_result(study: Path) -> None:
    read = na.load(study)
    expected = str(read.table())
    for line in read.table().lines:
        line.estimates.clear()
    assert str(read.table()) == expected
