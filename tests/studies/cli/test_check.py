"""``nested-agents check``: what it prints and how it ends."""

from pathlib import Path

import pytest

from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.checking.checker import CHECKS
from nested_agents.studies.cli.main import main

SPEC = """
preset = "frozen"

[scenario]
action_repeat = 2

[[scenario.failures]]
kind = "seized"
wheels = "robot1.left"
episode = 7

[sweep]
"scenario.box" = ["square", "circle"]
"learner.discount" = [0.9, 0.95]
"""


def unwrapped(printed: str) -> list[str]:
    """The first lines of what passed and of faults."""
    return [line for line in printed.splitlines() if line.startswith(("passed ", "FAULT "))]


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "spec.toml"
    path.write_text(SPEC)
    return path


def test_each_scenario_of_a_spec_is_checked_once(
    spec: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["check", str(spec), "--steps", "6"]) == 0
    printed = capsys.readouterr().out
    lines = unwrapped(printed)
    assert [line.split(":")[0] for line in lines] == [
        f"passed  box={box}, discount=0.9" for box in ("square", "circle")
    ]
    assert all(name in " ".join(printed.split()) for name in CHECKS)
    assert max(map(len, printed.splitlines())) <= 80


def test_a_broken_scenario_is_told_in_one_line(
    spec: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Deaf(BoxPushing):
        def reset(self, seed, episode=0):  # type: ignore[no-untyped-def]
            return super().reset(0, episode)

    def build(settings: BoxPushingSettings) -> BoxPushing:
        return (Deaf if settings.box == "circle" else BoxPushing)(settings)

    monkeypatch.setattr(BoxPushingSettings, "build", build)
    assert main(["check", str(spec), "--steps", "6"]) == 1
    passed, fault = unwrapped(capsys.readouterr().out)
    assert passed.startswith("passed  box=square")
    assert fault == (
        "FAULT   box=circle, discount=0.9: different seeds: seeds 0, 1 give one and the same "
        "episode, and so do 30 others"
    )


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--steps", "1"], "steps = 1: must be at least 2"),
        (["--set", "scenario.failures=[{kind='seized', wheels='robot3.*'}]"], "no such wheel"),
        (["--set", "scenario.failures=[{kind='siezed', wheels='*'}]"], "did you mean 'seized'?"),
        (["--set", "scenario.failures=[{kind='seized'}]"], "failures[0].wheels: missing"),
    ],
)
def test_what_the_user_can_mend(
    spec: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], complaint: str
) -> None:
    assert main(["check", str(spec), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert complaint in err
    assert err.count("\n") == 1


def test_a_folder_may_be_named_as_it_likes(spec: Path, tmp_path: Path, capsys) -> None:
    moved = tmp_path / ".pyenv" / "s.toml"
    moved.parent.mkdir()
    moved.write_text(spec.read_text())
    assert main(["check", str(moved), "--steps", "6"]) in (0, 1)
    assert capsys.readouterr().err == ""


OWN = """
import random
from nested_agents.scenarios.line_up import LineUp, LineUpSettings

class Drifting(LineUp):
    count = 0

    def step(self, joint_action):
        self.count += 1
        if self.count > 1:
            self._places = self._places + 1e-12 * random.SystemRandom().random()
        return super().step(joint_action)

def sound():
    return LineUpSettings().build()

def drifting():
    return Drifting(LineUpSettings())

def failing():
    raise ValueError("no cart")

def exploding():
    raise RuntimeError("no\\ntrack")

def sized(n):
    return LineUpSettings(carts=n).build()
"""


def test_a_scenario_of_ones_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "own.py"
    path.write_text(OWN)
    assert main(["check", f"{path}:sound"]) == 0
    assert capsys.readouterr().out.startswith("passed  sound: form, measures, values")
    assert main(["check", f"{path}:drifting"]) == 1
    found = capsys.readouterr().out
    assert found.startswith("FAULT   drifting: equal seeds: two runs with seed 0 differ at step 2")
    assert found.count("\n") == 1
    for name, complaint in (
        ("failing", "own.py:failing, called as a scenario is, raised ValueError: no cart"),
        ("exploding", "raised RuntimeError: no track"),
        ("sized", "raised TypeError: sized() missing 1 required positional argument: 'n'"),
        ("missing", "has no 'missing'"),
        ("", "must be written path/to/file.py:name"),
    ):
        assert main(["check", f"{path}:{name}"]) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert complaint in err
    assert main(["check", f"{path}:sound", "--set", "seeds=2"]) == 2
    assert "--set: changes a spec, and a Python file is none" in capsys.readouterr().err


SETTLED = """
import nested_agents as na
from nested_agents.scenarios.line_up import LineUp

class Settled(LineUp):
    class Settings(na.ScenarioSettings):
        carts: int = 3

class Unsettled(LineUp):
    class Settings(na.ScenarioSettings):
        carts: int
"""


def test_a_class_is_checked_with_its_default_settings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "own.py"
    path.write_text(SETTLED)
    assert main(["check", f"{path}:Settled", "--steps", "6"]) == 0
    assert capsys.readouterr().out.startswith("passed  Settled: form, measures, values")
    assert main(["check", f"{path}:Unsettled"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "its Settings have no defaults for all keys, Unsettled.Settings: carts: missing" in err


def test_a_topology_that_fails_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "broken.py").write_text("def broken(agents, groups):\n    raise ValueError(1)\n")
    (tmp_path / "spec.toml").write_text(
        'seeds = 1\nepisodes = 1\nsteps = 2\ntopology = "broken.py:broken"\n'
        'scenario = { kind = "line-up", carts = 2 }\n'
    )
    assert main(["check", str(tmp_path / "spec.toml")]) == 2
    _, err = capsys.readouterr()
    assert err.count("\n") == 1
    assert "broken.py:broken': broken raised ValueError" in err
