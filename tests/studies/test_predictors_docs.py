"""docs/predictors.md holds the tables that the committed results give."""

from pathlib import Path

import pytest
from published_tables import print_table

PAGE = Path(__file__).resolve().parents[2] / "docs" / "predictors.md"


@pytest.mark.parametrize(
    "name",
    [
        "predictors",
        "predictors-arm",
        "predictors-teams",
        "predictors-pendulum",
        "predictors-cartpole",
    ],
)
def test_tables(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    columns = "training success", "evaluation success"
    table = print_table(name, columns, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/predictors.md: put in\n{table}"
