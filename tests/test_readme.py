"""README.md and the package's metadata: the tagline, the published rates, the version, links."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import nested_agents as na
from nested_agents.studies.cli.main import main, nested_agents
from research import RESULTS

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_tagline_is_the_same_everywhere() -> None:
    tagline = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["description"]
    assert (na.__doc__ or "").splitlines()[0] == tagline
    assert nested_agents.help == tagline
    assert f"\n  {tagline}\n" in (ROOT / "CITATION.cff").read_text()
    for page in ("README.md", "docs/index.md"):
        assert f"\n{tagline} " in (ROOT / page).read_text(encoding="utf-8")


def test_the_table_of_the_readme_is_published(capsys: pytest.CaptureFixture[str]) -> None:
    edges = RESULTS / "edges.json"
    line = ["table", str(edges), "--columns", "evaluation success", "--format", "markdown"]
    assert main([*line, "--trust"]) == 0
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
        assert f"| {robots} | {2 * robots} | {' | '.join(rates)} |" in README
    eight = na.load(edges).results.numbers("value_of=own, robots=8")
    plans = eight["decision.considered only, private plans"]
    ratio = np.median(plans / eight["decision.as trained"])
    price = f"send none and take {ratio:.0f} times as long"
    assert price in " ".join(README.split())


def test_the_replay_is_small_and_the_version_is_one() -> None:
    assert (ROOT / "docs" / "push.gif").stat().st_size < 1_000_000
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()


def test_the_links_lead_somewhere() -> None:
    for name in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for link in re.findall(r"\]\(([^)#]+)", text):
            assert (ROOT / link).exists(), f"{name}: {link}"
