"""README.md, docs/start.md, docs/python.md: specs are specs, Python runs, rates are published."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import COMMANDS, main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from research import RESULTS

ROOT = Path(__file__).resolve().parent.parent
WITH_SPECS = ("README.md", "docs/start.md")
PAGES = {
    name: (ROOT / name).read_text(encoding="utf-8") for name in (*WITH_SPECS, "docs/python.md")
}


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGES[page], re.DOTALL)


@pytest.mark.parametrize("page", WITH_SPECS)
def test_the_spec_is_one(page: str) -> None:
    (spec,) = blocks(page, "toml")
    check_conditions(Spec.parse(spec))


@pytest.mark.parametrize("page", WITH_SPECS)
def test_the_commands_exist(page: str) -> None:
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    assert {"./dev demo"} <= {line.partition(" #")[0].strip() for line in lines}
    for line in lines:
        match = re.match(r"\./dev exec nested-agents (\S+)", line)
        assert match is None or match[1] in COMMANDS


def test_the_python_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (code,) = [block for block in blocks("docs/python.md", "python") if "leaders" in block]
    assert len([line for line in code.splitlines() if line]) <= 12
    small = "seeds=2, episodes=1, steps=4, evaluation=1"
    assert "seeds=8, episodes=20, steps=200" in code
    code = code.replace("seeds=8, episodes=20, steps=200", small).replace("jobs=2", "jobs=1")
    exec(code, {})
    assert "evaluation" in capsys.readouterr().out
    assert (tmp_path / "out" / "leaders.pdf").is_file()


def test_the_table_of_the_readme_is_published(capsys: pytest.CaptureFixture[str]) -> None:
    edges = RESULTS / "edges.json"
    assert (
        main(["table", str(edges), "--columns", "evaluation success", "--format", "markdown"]) == 0
    )
    cells = dict(re.findall(r"\| (.*?) \| 20 \| (.*?) \|", capsys.readouterr().out))
    entries = (
        "as trained",
        "considered only",
        "told only",
        "neither",
        "considered only, private plans",
    )
    for robots in (2, 4, 8):
        rates = [cells[f"{robots} robots, own, {entry}"] for entry in entries]
        assert f"| {robots} | {2 * robots} | {' | '.join(rates)} |" in PAGES["README.md"]
    eight = na.load(edges).results.numbers("value_of=own, robots=8")
    plans = eight["decision.considered only, private plans"]
    ratio = np.median(plans / eight["decision.as trained"])
    price = f"send none and take {ratio:.0f} times as long"
    assert price in " ".join(PAGES["README.md"].split())


def test_the_replay_is_small_and_the_version_is_one() -> None:
    assert (ROOT / "docs" / "push.gif").stat().st_size < 1_000_000
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()


def test_the_links_lead_somewhere() -> None:
    for name in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for link in re.findall(r"\]\(([^)#]+)", text):
            assert (ROOT / link).exists(), f"{name}: {link}"
