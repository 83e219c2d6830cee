"""README.md and docs/start.md: their specs are specs, their Python runs."""

import re
import tomllib
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import COMMANDS
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import check

ROOT = Path(__file__).resolve().parent.parent
PAGES = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/start.md")}


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGES[page], re.DOTALL)


@pytest.mark.parametrize("page", PAGES)
def test_the_spec_is_one(page: str) -> None:
    (spec,) = blocks(page, "toml")
    check(Spec.parse(spec))


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_exist(page: str) -> None:
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    assert {"./dev demo"} <= {line.partition(" #")[0].strip() for line in lines}
    for line in lines:
        match = re.match(r"\./dev exec nested-agents (\S+)", line)
        assert match is None or match[1] in COMMANDS


def test_the_python_prints_its_episodes(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = blocks("README.md", "python")
    assert len([line for line in code.splitlines() if line]) <= 12
    exec(code.replace("episodes=20, steps=200", "episodes=2, steps=3"), {})
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["episode 0", "episode 1"]


def test_the_replay_is_small_and_the_version_is_one() -> None:
    assert (ROOT / "docs" / "push.gif").stat().st_size < 1_000_000
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()


def test_the_links_lead_somewhere() -> None:
    for name in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for link in re.findall(r"\]\(([^)#]+)", text):
            assert (ROOT / link).exists(), f"{name}: {link}"
