"""An installed package offers one thing of every kind, by entry points, and a study uses them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import main
from nested_agents.studies.store.store import Store

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.slow

BOXES = """
study = "endurance"
seeds = 2
episodes = 2
steps = 6
evaluation = 1
topology = "pairs"

[scenario]
state_space = ["gap", "heading_error", "box_distance"]

[learner]
kind = "counting"
exploration = { kind = "constant", rate = 0.2 }
decision.evaluator = "own-action"

[sweep]
"learner.gain" = [0.5, 2.0]
"""
MEETING = """
study = "learning-curve"
seeds = 2
episodes = 6
steps = 30
evaluation = 2

[scenario]
kind = "meeting"

[sweep]
"scenario.walkers" = [2, 3]
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the package is installed."""
    folder = tmp_path_factory.mktemp("site")
    source = tmp_path_factory.mktemp("source") / "plugin"
    subprocess.run(["cp", "-r", Path(__file__).parent, source], check=True)
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    command += ["--no-build-isolation", "--target", str(folder), str(source)]
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL, timeout=120)
    return folder


@pytest.mark.parametrize(("spec", "conditions"), [(BOXES, 2), (MEETING, 2)])
def test_a_study_of_what_a_package_offers(
    installed: Path,
    tmp_path: Path,
    spec: str,
    conditions: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "spec.toml").write_text(spec)
    path = os.pathsep.join([str(installed), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    run = subprocess.run(  # workers of this process look for packages where it began
        [sys.executable, "-m", "nested_agents", "run", "spec.toml", "--out", "out", "--jobs", "1"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, stdin=subprocess.DEVNULL,
        capture_output=True, text=True, check=False, timeout=280,
    )  # fmt: skip
    assert (run.returncode, run.stderr.count("failed")) == (0, 0), run.stderr
    with Store.open(tmp_path / "out") as store:
        assert len(store.columns()) == conditions
        assert store.counts() == {"done": 2 * conditions, "failed": 0}
    monkeypatch.syspath_prepend(installed)
    assert main(["report", str(tmp_path / "out")]) == 0


def test_settings_of_a_package_are_checked_like_built_in_ones(
    installed: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.syspath_prepend(installed)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec.toml").write_text(MEETING.partition("[sweep]")[0])
    for change, said in (
        ("scenario.walker=3", "did you mean 'walkers'?"),
        ("scenario.walkers=9", "scenario.walkers = 9: must be at most 8"),
        ("scenario.kind=meting", "did you mean 'meeting'?"),
    ):
        assert main(["run", "spec.toml", "--out", "out", "--set", change]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert said in error


def test_every_kind_of_thing_is_offered(installed: Path, tmp_path: Path) -> None:
    code = """
from nested_agents.core.search import EVALUATORS
from nested_agents.core.search.exploration import EXPLORATIONS
from nested_agents.core.learners import LEARNERS
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.box_pushing.states.variables import STATE_VARIABLES
from nested_agents.studies.spec.studies import STUDIES
from nested_agents.topologies import TOPOLOGIES
for registry in (
    EVALUATORS, EXPLORATIONS, LEARNERS, SCENARIOS, STATE_VARIABLES, STUDIES, TOPOLOGIES
):
    print(registry.group, *registry.installed())
"""
    path = os.pathsep.join([str(installed), str(ROOT)])
    found = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path,
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert len([line for line in found.splitlines() if " " in line]) == 7
