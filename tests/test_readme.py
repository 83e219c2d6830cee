"""README.md and the package's metadata: the tagline, the published rates, the version, links."""

import re
import tomllib
from pathlib import Path

import nested_agents as na
from nested_agents.analysis import format_number
from nested_agents.studies.cli.main import nested_agents
from research import load

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
TEXT = " ".join(README.split())


def test_the_tagline_is_the_same_everywhere() -> None:
    tagline = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["description"]
    assert (na.__doc__ or "").splitlines()[0] == tagline
    assert nested_agents.help == tagline
    assert f"\n  {tagline}\n" in (ROOT / "CITATION.cff").read_text()
    for page in ("README.md", "docs/index.md"):
        assert f"\n{tagline}" in (ROOT / page).read_text(encoding="utf-8")


def test_the_rates_of_the_readme_are_published() -> None:
    edges = load("edges").results
    eight = "value_of=own, robots=8"
    without, chain = (
        format_number(edges.success(eight, phase).mean())
        for phase in ("evaluation:told only", "evaluation")
    )
    assert f"success rate of eight robots falls from {chain} to {without} if lookahead" in TEXT
    sixteen = format_number(load("scaling").results.success("16", "evaluation").mean())
    assert f"teams of 16 robots reach a success rate of {sixteen}." in TEXT
    results = (ROOT / "research" / "notebooks" / "box_pushing.md").read_text(encoding="utf-8")
    assert "or 0.62 [" in results
    assert "dynamics model from zero reach 0.97" in results


def test_the_replay_is_small_and_the_version_is_one() -> None:
    assert (ROOT / "docs" / "figures" / "push.gif").stat().st_size < 1_000_000
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()


def test_the_links_lead_somewhere() -> None:
    for name in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for link in re.findall(r"\]\(([^)#]+)", text):
            if link.startswith("https://"):
                continue
            assert (ROOT / link).exists(), f"{name}: {link}"
