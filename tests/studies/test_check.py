"""``nested-agents check``: what it prints and how it ends."""

from pathlib import Path

import pytest

from nested_agents import scenarios
from nested_agents.scenarios import BoxPushing, ScenarioSettings
from nested_agents.scenarios.checker import CHECKS
from nested_agents.studies.cli import main

SPEC = """
preset = "frozen"

[scenario]
hold = 2

[[scenario.failures]]
kind = "seized"
wheels = "robot1.left"
episode = 7

[sweep]
"scenario.box" = ["square", "circle"]
"learner.discount" = [0.9, 0.95]
"""


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "spec.toml"
    path.write_text(SPEC)
    return path


def test_each_scenario_of_a_spec_is_checked_once(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(spec), "--steps", "6"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == [
        f"passed  box={box}, discount=0.9" for box in ("square", "circle")
    ]
    assert all(name in lines[0] for name in CHECKS)


def test_a_broken_scenario_is_told_in_one_line(
    spec: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Deaf(BoxPushing):
        def reset(self, seed, episode=0):  # type: ignore[no-untyped-def]
            return super().reset(0, episode)

    def build(settings: ScenarioSettings) -> BoxPushing:
        return (Deaf if settings.box == "circle" else BoxPushing)(settings)

    monkeypatch.setattr(scenarios, "build", build)
    assert main(["check", str(spec), "--steps", "6"]) == 1
    passed, fault = capsys.readouterr().out.splitlines()
    assert passed.startswith("passed  box=square")
    assert fault == (
        "FAULT   box=circle, discount=0.9: different seeds: seeds 0, 1 give one and the same "
        "episode"
    )


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--steps", "1"], "1 steps"),
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
