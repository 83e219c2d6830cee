"""research/notebooks/box_pushing.md holds the tables that the committed results give."""

import csv
from pathlib import Path

import numpy as np
import pytest
from programs import main
from published_tables import print_table

import nested_agents as na
from nested_agents.studies.catalogue.wheel_failure import AT_END
from nested_agents.studies.results.notation import format_estimate, format_number
from nested_agents.studies.results.statistics import bootstrap
from research import RESULTS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "research" / "notebooks" / "box_pushing.md"
LARGE_TEAM = (
    "training success", "training success, difference",
    "evaluation success", "evaluation success, difference",
)  # fmt: skip
LEADERS = "no leader", "rule", "learned", "random"
COLUMNS = ("success last 5", "evaluation success", "evaluation steps")


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("learning-curve", COLUMNS),
        ("tasks", COLUMNS),
        ("paper-ladder", COLUMNS),
        ("paper-ladder-unprinted", COLUMNS),
        ("paper-ladder-even", COLUMNS),
        ("paper-ladder-100", COLUMNS),
        ("tasks-written", ("training success", *COLUMNS[1:])),
        ("hand-written", ("evaluation success", "all touch")),
        ("told", COLUMNS),
        ("scaling", ("evaluation success", "all touch")),
        ("crowds", ("evaluation success", "all touch")),
        ("sixty-four", ("evaluation success",)),
        ("from-eight-128", ("evaluation success", "success, 128")),
        ("rounds", ("evaluation success", "success, sixty-four")),
        ("from-eight", ("evaluation success", "success, sixty-four")),
        ("wide", ("evaluation success", "success, sixty-four")),
        ("leaders", ("evaluation success", *(f"success, 64, {name}" for name in LEADERS))),
        ("leaders-128", ("evaluation success", "success, 128, rule", "success, 128, learned")),
        ("leaders-128-none", ("evaluation success", "success, 128, no leader")),
        ("leaders-256", ("evaluation success", "success, 256, rule")),
        ("large-team", LARGE_TEAM),
        ("own-value", ("evaluation success",)),
        ("transfer", ("evaluation success", "success, four", "success, eight")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), (
        f"research/notebooks/box_pushing.md: put in\n{table}"
    )


def test_the_planner(capsys: pytest.CaptureFixture[str]) -> None:
    path = str(RESULTS / "controls.json")
    choice = ["--where", "preset == 'planner'", "--columns", "evaluation success"]
    assert main(["table", path, *choice, "--format", "markdown"]) == 0
    assert capsys.readouterr().out in PAGE.read_text(encoding="utf-8")


SIZES = (2, 4, 8, 16)
IN_A_ROW = 5
"""Training episodes over which a success rate of 0.8 is looked for."""


def test_decisions_to_a_success_rate() -> None:
    results = na.load(RESULTS / "scaling.json").results
    to_first: list[np.ndarray] = []
    to_last: list[np.ndarray] = []
    for robots in SIZES:
        success = results.success(str(robots))
        decisions = results.values(str(robots), "steps").cumsum(axis=1)
        blocks = np.lib.stride_tricks.sliding_window_view(success, IN_A_ROW, axis=1)
        reached = blocks.sum(axis=2) >= 4
        assert reached.any(axis=1).all()
        first = reached.argmax(axis=1)
        seeds = np.arange(len(success))
        to_first.append(decisions[seeds, first])
        to_last.append(decisions[seeds, first + IN_A_ROW - 1])
    page = " ".join(PAGE.read_text(encoding="utf-8").split())
    for counted in (to_first, to_last):
        slopes = np.polyfit(np.log(SIZES), np.log(counted), 1)[0]
        assert f"n^{format_estimate(bootstrap(slopes))}" in page
    means = [f"{float(format_number(float(d.mean()))):,.0f}" for d in to_first]
    assert f"16 robots: {', '.join(means[:-1])} and {means[-1]} in the mean over 20 seeds" in page


def test_failures_of_large_teams(capsys: pytest.CaptureFixture[str]) -> None:
    path = RESULTS / "large-failures.json"
    columns = ["success just after", AT_END]
    assert main(["table", str(path), "--columns", *columns, "--format", "csv"]) == 0
    rows: dict[str, list[str]] = {}
    for row in csv.DictReader(capsys.readouterr().out.splitlines()):
        fault, adapting = row["condition"].split(": ")
        if adapting == "nothing":
            rows[fault] = [_rounded(row["success just after"])]
        rows[fault].append(_rounded(row[AT_END]))
    page = PAGE.read_text(encoding="utf-8")
    for fault, cells in rows.items():
        line = f"| {fault.replace(' seized', '')} | {' | '.join(cells)} |"
        assert line in page, f"research/notebooks/box_pushing.md: put in\n{line}"


def _rounded(rate: str) -> str:
    return format_number(float(rate))
