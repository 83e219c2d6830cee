"""research/notebooks/ppo.md holds the tables of committed results, and names specs that exist."""

import re
from pathlib import Path

import pytest
from programs import main

from nested_agents.studies.spec.spec import Spec
from research import RESULTS

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "research" / "notebooks" / "ppo.md").read_text(encoding="utf-8")
COLUMNS = ("success, 4", "success, 12", "evaluation success", "decisions")
PREDICTORS = ("success, 2", "success, 6", "evaluation success", "decisions")
SAMPLED = "success, sampled actions"
ARM = ("success, 4", "success, 12", "evaluation success", SAMPLED, "decisions")
EDGES = ("evaluation success", "messages")
LONG = ("success, 4", "success, 40", "success, 120", *COLUMNS[2:])


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("peers-arm", ARM),
        ("peers-arm-16", ARM),
        ("peers-boxes", COLUMNS),
        ("fit-games-ppo", EDGES),
        ("fit-ring-ppo", EDGES),
        ("peers-one-robot", COLUMNS),
        ("peers-four-robots", COLUMNS),
        ("peers-100", LONG),
        ("peers-arm-long", LONG),
        ("peers-predictors", PREDICTORS),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    path = RESULTS / f"{name}.json"
    assert main(["table", str(path), "--columns", *columns, "--format", "markdown"]) == 0
    table = capsys.readouterr().out
    assert table in TEXT, f"research/notebooks/ppo.md: put in\n{table}"


@pytest.mark.parametrize("path", re.findall(r"nested-agents run (\S+\.toml)", TEXT))
def test_commands_name_specs_that_are(path: str) -> None:
    assert Spec.load(ROOT / path).conditions()
