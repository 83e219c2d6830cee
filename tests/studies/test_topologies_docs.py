"""docs/topologies.md holds the table that the committed results give."""

import re
from pathlib import Path

import pytest

import nested_agents as na
from nested_agents.studies.claims import claims
from nested_agents.studies.cli.main import main

PAGE = Path(__file__).resolve().parents[2] / "docs" / "topologies.md"
COLUMNS = ("evaluation success", "decision [ms]", "messages")


def test_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    path = claims.PUBLISHED / "hierarchies.json"
    assert main(["table", str(path), "--columns", *COLUMNS, "--format", "markdown"]) == 0
    table = capsys.readouterr().out
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/topologies.md: put in\n{table}"


@pytest.mark.slow
def test_kept_teams_are_evaluated_again_as_it_says(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    studies = PAGE.with_name("studies.md").read_text(encoding="utf-8")
    pages = PAGE.read_text(encoding="utf-8") + studies.replace("out/mine", "out/kept")
    blocks = re.findall(r"```python\n(.*?)```", pages, re.DOTALL)
    (again,) = [block for block in blocks if "na.reevaluate" in block]
    (acting,) = [block for block in blocks if "study.team" in block]
    small = {"seeds=4": "seeds=2", "episodes=6": "episodes=1", "steps=150": "steps=6"}
    for large, less in small.items():
        again = again.replace(large, less)
    exec(again, {"__name__": "__main__"})
    assert re.findall(r"^(\S.*?)  ", capsys.readouterr().out, re.MULTILINE) == [
        "chain", "tree:2", "{told = 'none'}",
    ]  # fmt: skip
    exec(acting, {"na": na})
    assert capsys.readouterr().out.startswith("[")
