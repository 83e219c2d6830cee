"""docs/specs.md says what is so."""

import re
from pathlib import Path

from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.studies import STUDIES
from nested_agents.studies.trials.arrangement import check_conditions

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "specs.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


def test_every_study_is_told_with_its_spec() -> None:
    told = dict(re.findall(r"\| `([a-z-]+)` \| .* \| `([\w-]+\.toml)` \|", TEXT))
    assert set(told) == set(STUDIES.built_in)
    for study, name in told.items():
        spec = ROOT / "studies" / "catalogue" / study.replace("-", "_") / name
        assert Spec.load(spec).study == study


def test_the_toml_is_as_it_says() -> None:
    (conditions,) = [block for block in blocks("toml") if "[[overrides]]" in block]
    (evaluations,) = [block for block in blocks("toml") if block.startswith("[evaluations]")]
    labels = [condition.label for condition in Spec.parse(conditions).conditions()]
    assert len(labels) == 10
    assert (labels[0], labels[-1]) == ("default, robots=2", "as printed, robots=3")
    check_conditions(Spec.parse(evaluations))


def test_the_curriculum_runs_as_it_says(tmp_path, monkeypatch, capsys) -> None:
    (spec,) = [block for block in blocks("toml") if "[[curriculum]]" in block]
    (shown,) = [block for block in blocks("text") if "growing.toml" in block]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "growing.toml").write_text(spec)
    commands = re.findall(r"^\$ ./dev exec nested-agents (.*)$", shown, flags=re.MULTILINE)
    said = ""
    for command in commands:
        assert main([*command.split(), *["--jobs", "1"] * command.startswith("run")]) == 0
        said += capsys.readouterr().out
    lines = [line.rstrip() for line in said.splitlines()]
    for line in shown.splitlines():
        assert line.startswith("$ ") or line in lines


def test_the_python_builds_a_spec() -> None:
    names: dict = {"__name__": "example"}
    (code,) = [block for block in blocks("python") if "ridges" in block]
    exec(code, names)
    labels = [condition.label for condition in names["spec"].conditions()]
    assert labels == ["ridge 1", "ridge 10", "ridge 100", "online"]
