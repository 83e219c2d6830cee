"""The examples of docs/extending.md: short, and run from outside the repository."""

import re
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import main

PAGE = Path(__file__).resolve().parent.parent / "docs" / "extending.md"
SECTIONS = dict(
    re.findall(r"^## An? ([a-z ]+)\n(.*?)(?=^## |\Z)", PAGE.read_text(), re.MULTILINE | re.DOTALL)
)
MOST_LINES = 30


def block(section: str, language: str) -> str:
    (text,) = re.findall(rf"```{language}\n(.*?)```", SECTIONS[section], re.DOTALL)
    return str(text)


def test_all_kinds_have_an_example() -> None:
    assert set(SECTIONS) == {
        "topology", "scenario", "state variable", "learner", "learner that acts by itself",
        "evaluator", "exploration", "study",
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
