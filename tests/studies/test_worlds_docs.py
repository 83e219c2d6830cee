"""docs/worlds.md holds the table that the committed results give."""

from pathlib import Path

import pytest
from published_tables import print_table

PAGE = Path(__file__).resolve().parents[2] / "docs" / "worlds.md"
COLUMNS = ("success last 5", "evaluation success", "total reward")


def test_the_pendulum(capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table("pendulum", COLUMNS, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/worlds.md: put in\n{table}"
