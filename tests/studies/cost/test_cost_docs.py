"""The commands that docs/topologies.md and docs/cost.md show are run, and say what is shown."""

import re
import shlex
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import main

ROOT = Path(__file__).parents[3]
PAGES = {name: (ROOT / "docs" / f"{name}.md").read_text() for name in ("topologies", "cost")}
COMMANDS = [
    line
    for page in PAGES.values()
    for block in re.findall(r"```sh\n(.*?)```", page, re.DOTALL)
    for line in block.splitlines()
    if line.startswith("./dev exec nested-agents ")
]
LONG = ("--measured", "nested-agents run")


def test_there_are_commands() -> None:
    assert len(COMMANDS) >= 6


@pytest.mark.parametrize("command", [c for c in COMMANDS if not any(word in c for word in LONG)])
def test_a_documented_command_works(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (spec,) = re.findall(r"```toml\n(# arms.toml.*?)```", PAGES["cost"], re.DOTALL)
    (tmp_path / "arms.toml").write_text(spec)
    assert main(shlex.split(command)[3:]) == 0
    assert capsys.readouterr().out


def test_the_shown_table_is_what_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    (shown,) = re.findall(r"```text\n(tree:2.*?)```", PAGES["topologies"], re.DOTALL)
    assert main(["topology", "show", "tree:2", "--agents", "6"]) == 0
    assert capsys.readouterr().out.strip() == shown.strip()


def test_the_shown_costs_are_exact(capsys: pytest.CaptureFixture[str]) -> None:
    shown, budget = re.findall(r"```text\n( *n  topology.*?)```", PAGES["cost"], re.DOTALL)
    assert main(["cost", "--agents", "1:8", "--topology", "chain"]) == 0
    assert capsys.readouterr().out.strip() == shown.strip()
    topologies = ["chain", "tree:2", "single-agent"]
    assert main(["cost", "--agents", "4,8", "--topology", *topologies, "--budget", "256"]) == 0
    assert budget in capsys.readouterr().out
