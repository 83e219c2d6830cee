"""docs/topologies.md holds the table that the committed results give."""

from pathlib import Path

import pytest

from nested_agents.studies.claims import claims
from nested_agents.studies.cli.main import main

PAGE = Path(__file__).resolve().parents[2] / "docs" / "topologies.md"
COLUMNS = ("evaluation success", "decision [ms]", "messages")


def test_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    path = claims.PUBLISHED / "hierarchies.json"
    assert main(["table", str(path), "--columns", *COLUMNS, "--format", "markdown"]) == 0
    table = capsys.readouterr().out
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/topologies.md: put in\n{table}"
