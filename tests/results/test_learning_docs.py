"""docs/learning.md holds the tables that the committed results give."""

import csv
from pathlib import Path

import pytest
from published_tables import print_table

from nested_agents.results import ROWS
from nested_agents.studies.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "learning.md"
LARGE_TEAM = (
    "training success", "training success, difference",
    "evaluation success", "evaluation success, difference",
)  # fmt: skip
COLUMNS = ("success last 5", "evaluation success", "evaluation steps")


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("learning-curve", COLUMNS),
        ("tasks", COLUMNS),
        ("told", COLUMNS),
        ("scaling", ("evaluation success", "all touch")),
        ("crowds", ("evaluation success", "all touch")),
        ("sixty-four", ("evaluation success",)),
        ("from-eight-128", ("evaluation success", "success, 128")),
        ("sweeps", ("evaluation success", "success, sixty-four")),
        ("from-eight", ("evaluation success", "success, sixty-four")),
        ("wide", ("evaluation success", "success, sixty-four")),
        ("large-team", LARGE_TEAM),
        ("four-robots-hard", ("evaluation success", "evaluation steps")),
        ("own-value", ("evaluation success",)),
        ("transfer", ("evaluation success", "success, four", "success, eight")),
        ("curriculum", ("evaluation success", "success, sixteen", "success, thirty-two")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/learning.md: put in\n{table}"


def test_the_planner(capsys: pytest.CaptureFixture[str]) -> None:
    path = str(ROWS / "controls.json")
    choice = ["--where", "preset == 'planner'", "--columns", "evaluation success"]
    assert main(["table", path, *choice, "--format", "markdown"]) == 0
    assert capsys.readouterr().out in PAGE.read_text(encoding="utf-8")


def test_failures_of_large_teams(capsys: pytest.CaptureFixture[str]) -> None:
    path = ROWS / "large-failures.json"
    assert main(["table", str(path), "--columns", "just after", "end", "--format", "csv"]) == 0
    rows: dict[str, list[str]] = {}
    for row in csv.DictReader(capsys.readouterr().out.splitlines()):
        fault, adapting = row["condition"].split(": ")
        if adapting == "nothing":
            rows[fault] = [_rounded(row["just after"])]
        rows[fault].append(_rounded(row["end"]))
    page = PAGE.read_text(encoding="utf-8")
    for fault, cells in rows.items():
        line = f"| {fault.replace(' seized', '')} | {' | '.join(cells)} |"
        assert line in page, f"docs/learning.md: put in\n{line}"


def _rounded(rate: str) -> str:
    return f"{float(rate):.2f}".removeprefix("0") if 0 < float(rate) < 1 else rate.split(".")[0]
