"""docs/topologies.md holds the tables that the committed results give."""

import re
from pathlib import Path

import pytest
from published_tables import print_table

import nested_agents as na

PAGE = Path(__file__).resolve().parents[2] / "docs" / "topologies.md"
EDGES = ("evaluation success", "decisions to goal", "decision [ms]", "messages")


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("hierarchies", ("evaluation success", "decision [ms]", "messages")),
        ("edges", EDGES),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
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
