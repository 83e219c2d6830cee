"""docs/worlds.md holds the table that the committed results give."""

from pathlib import Path

import pytest
from published_tables import print_table

from nested_agents.studies.cli.main import main
from nested_agents.studies.results import published
from nested_agents.studies.spec.spec import Spec

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "worlds.md"
WORLDS = ROOT / "examples" / "worlds"
COLUMNS = ("success last 5", "evaluation success", "total reward")


def test_the_pendulum(capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table("pendulum", COLUMNS, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/worlds.md: put in\n{table}"


@pytest.mark.parametrize("path", sorted(WORLDS.glob("*.json")), ids=lambda path: path.stem)
def test_worlds_of_others(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = {**published.load(path).outline.table, "seeds": 12}
    assert table == Spec.load(path.with_suffix(".toml")).table()
    assert main(["table", str(path), "--columns", "total reward", "--format", "markdown"]) == 0
    rows = capsys.readouterr().out
    assert rows in PAGE.read_text(encoding="utf-8"), f"docs/worlds.md: put in\n{rows}"
