"""docs/worlds.md holds the table that the committed results give."""

from pathlib import Path

import pytest
from published_tables import print_table

from nested_agents.studies.claims.claims import PUBLISHED
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "worlds.md"
COLUMNS = ("success last 5", "evaluation success", "total reward")


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("pendulum", COLUMNS),
        ("cartpole", ("success last 5", "evaluation success", "evaluation steps")),
        ("spread", ("evaluation steps", "total reward")),
        ("swimmer", COLUMNS),
        ("swimmer-transfer", (*COLUMNS[:2], "success, eight", COLUMNS[2])),
        ("multiwalker", ("evaluation steps", "total reward")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/worlds.md: put in\n{table}"


@pytest.mark.parametrize(("name", "reference"), [("aloha", "none"), ("aloha-copies", "planner")])
def test_evaluated_rewards(name: str, reference: str, capsys: pytest.CaptureFixture[str]) -> None:
    path, by = str(PUBLISHED / f"{name}.json"), ("--phase", "evaluation", "--reference", reference)
    of = ("--measure", "total_reward", "--format", "markdown")
    assert main(["compare", path, *of, *by]) == 0
    table = capsys.readouterr().out
    assert table in PAGE.read_text(encoding="utf-8"), f"docs/worlds.md: put in\n{table}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "extras", "agents"),
    [
        ("swimmer", ("mujoco", "stable_baselines3"), 2),
        ("swimmer_4", ("mujoco", "stable_baselines3"), 4),
        ("swimmer_transfer", ("mujoco",), 4),
        ("spread", ("mpe2",), 3),
        ("spread_ppo", ("mpe2", "stable_baselines3"), 3),
        ("aloha", (), 10),
        ("aloha_ppo", ("stable_baselines3",), 10),
        ("aloha_copies", (), 10),
    ],
)
def test_specs_of_worlds_of_others_run(
    spec: str, extras: tuple[str, ...], agents: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    for extra in extras:
        pytest.importorskip(extra, reason="extras mpe, mujoco, peers")
    monkeypatch.chdir(ROOT)  # swimmers of more joints are files of examples
    path = ROOT / "studies" / "catalogue" / "learning_curve" / f"{spec}.toml"
    few = ["seeds=1", "episodes=2", "steps=3", "evaluation=1"]
    for trial in trials_of(Spec.load(path, few)):
        session = Session(trial)
        session.train(2)
        assert len(session.scenario.agents) == agents
        phases = [row.phase for row in session.finish().rows]
        assert phases[:3] == ["training", "training", "evaluation"]
        assert {f"evaluation:{name}" for name, _ in trial.evaluations} <= {*phases}
