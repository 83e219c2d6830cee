"""Settings of what others run: they say what is so, and the notebook runs."""

import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[1]


def read(name: str) -> Any:
    return yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))


def test_the_workflow_runs_what_ci_runs_on_the_versions_that_are_promised() -> None:
    job = read(".github/workflows/tests.yml")["jobs"]["tests"]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(project["classifiers"]))
    assert job["strategy"]["matrix"]["python"] == named
    assert job["steps"][-1]["run"] == "bash .ci/run"


def test_hooks_and_pages_use_the_one_door() -> None:
    (local,) = read(".pre-commit-config.yaml")["repos"]
    assert all(hook["entry"].startswith("./dev ") for hook in local["hooks"])
    assert "./dev docs" in read(".readthedocs.yaml")["build"]["commands"][0]


def test_the_container_is_not_root() -> None:
    lines = (ROOT / "Containerfile").read_text(encoding="utf-8").splitlines()
    assert lines.index("USER agent") < lines.index("RUN ./dev setup")
    assert lines[-1] == 'CMD ["./dev", "test"]'


TOP = {
    ".ci", ".github", "benchmarks", "core", "docs", "examples", "nested_agents",
    "plugins", "research", "scenarios", "studies", "tests", "topologies",
    ".containerignore", ".gitignore", ".pre-commit-config.yaml", ".readthedocs.yaml",
    "CHANGELOG.md", "CITATION.cff", "CODE_OF_CONDUCT.md", "CONTRIBUTING.md", "Containerfile",
    "DECISIONS.md", "LICENSE", "README.md", "box2d.lock", "conftest.py", "dev", "pyproject.toml",
    "requirements.lock", "setup.py",
}  # fmt: skip
"""What may stand at the top of the repository; the rest is what commands have left there."""


def test_nothing_stray_is_at_the_top() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("no checkout")
    command = ["git", "ls-files", "-z"]
    kept = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert {path.partition("/")[0] for path in kept.split("\0") if path} == TOP
