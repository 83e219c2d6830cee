"""The examples of docs/extending.md: short, and run from outside the repository."""

import re
from dataclasses import fields as fields_of
from pathlib import Path

import pytest

from nested_agents.core.search.evaluator import DecisionContext, DecisionProblem
from nested_agents.studies.api.running import run
from nested_agents.studies.cli.main import main

PAGE = Path(__file__).resolve().parent.parent / "docs" / "extending.md"
SECTIONS = dict(
    re.findall(
        r"^## (?:An?|Around) ([\w ]+)\n(.*?)(?=^## |\Z)", PAGE.read_text(), re.MULTILINE | re.DOTALL
    )
)
MOST_LINES = 30


def block(section: str, language: str) -> str:
    (text,) = re.findall(rf"```{language}\n(.*?)```", SECTIONS[section], re.DOTALL)
    return str(text)


def test_all_kinds_have_an_example() -> None:
    assert set(SECTIONS) == {
        "topology", "scenario", "state variable", "learner", "learner that acts by itself",
        "function that decides", "evaluator", "exploration", "study",
        "an environment of Gymnasium or PettingZoo",
    }  # fmt: skip


@pytest.mark.parametrize("section", SECTIONS)
def test_an_example_is_short_and_runs(
    section: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, spec = block(section, "python"), block(section, "toml")
    name = code.partition("\n")[0].removeprefix("# ")
    assert len([line for line in code.splitlines()[1:] if line.strip()]) <= MOST_LINES
    (tmp_path / name).write_text(code)
    (tmp_path / "spec.toml").write_text(spec)
    monkeypatch.chdir(tmp_path)
    for arguments in (["run", "spec.toml", "--out", "out", "--jobs", "1"], ["report", "out"]):
        assert main(arguments) == 0
        (tmp_path / name).unlink(missing_ok=True)  # the study has its own copy
    assert (tmp_path / "out" / "report.html").is_file()


def test_what_decides_is_documented_field_by_field() -> None:
    page = PAGE.read_text()
    for fields in (DecisionContext._fields, (field.name for field in fields_of(DecisionProblem))):
        assert all(f"| `{name}`" in page for name in fields)


def test_the_example_of_a_recording_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (code,) = re.findall(r"```python\n# filmed.py\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (tmp_path / "filmed.py").write_text(code)
    monkeypatch.chdir(tmp_path)
    spec = {
        "study": "learning-curve", "seeds": 1, "episodes": 1, "steps": 3, "evaluation": 1,
        "scenario": {"kind": str(tmp_path / "filmed.py:Filmed")},
    }  # fmt: skip
    study = run(spec, tmp_path / "out", jobs=1, progress=False)
    assert study.replay().path.read_bytes().startswith(b"GIF8")
    assert str(study).startswith(str(study.table()))
    assert repr(study) == str(study)
