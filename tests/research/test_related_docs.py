"""research/notebooks/related.md says what is so."""

import re
from pathlib import Path

import pytest
from programs import main

from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from research import RESULTS

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "research" / "notebooks" / "related.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("spec", re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL))
def test_specs(spec: str) -> None:
    check_conditions(Spec.parse(spec))


@pytest.mark.parametrize("path", re.findall(r"nested-agents run (\S+\.toml)", TEXT))
def test_commands_name_specs_that_can_be_built(path: str) -> None:
    check_conditions(Spec.load(ROOT / path))


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("related", ("evaluation success", "success, L", "success, star", "time [s]")),
        ("related-arms", ("evaluation success", "decisions", "ms", "messages", "counted")),
        ("related-boxes", ("evaluation success", "success, star", "decisions", "ms", "messages")),
        ("related-seized", ("evaluation success", "success, seized")),
        ("climbing", ("evaluation success", "memory [kB]", "messages", "formula", "counted")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    path = str(RESULTS / f"{name}.json")
    assert main(["table", path, "--columns", *columns, "--format", "markdown"]) == 0
    table = capsys.readouterr().out
    assert table in TEXT, f"research/notebooks/related.md: put in\n{table}"
