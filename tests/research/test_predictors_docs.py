"""research/notebooks/dynamics_models.md holds the tables that the committed results give."""

from pathlib import Path

import pytest
from published_tables import print_table

PAGE = Path(__file__).resolve().parents[2] / "research" / "notebooks" / "dynamics_models.md"


TRAINED = "training success", "evaluation success"
LAST = "success last 5", "evaluation success"


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("predictors", TRAINED),
        ("predictors-arm", TRAINED),
        ("predictors-midpoint", TRAINED),
        ("predictors-teams", TRAINED),
        ("predictors-teams-three", LAST),
        ("predictors-eight", TRAINED),
        ("poses", TRAINED),
        ("poses-controls", TRAINED),
        ("poses-controls-4", TRAINED),
        ("poses-controls-8", TRAINED),
        ("poses-4", TRAINED),
        ("poses-8", TRAINED),
        ("poses-16", TRAINED),
        ("predictors-cartpole-fine", (*LAST, "evaluation steps")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), (
        f"research/notebooks/dynamics_models.md: put in\n{table}"
    )
