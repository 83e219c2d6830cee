"""research/notebooks/environments.md holds the tables that the committed results give."""

from pathlib import Path

import pytest
from programs import main
from published_tables import print_table

import nested_agents as na
from nested_agents.studies.presentation.tables import tabulate
from nested_agents.studies.results.analysis import Summary
from nested_agents.studies.results.statistics import bootstrap
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of
from research import RESULTS, SPECS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "research" / "notebooks" / "environments.md"
COLUMNS = ("success last 5", "evaluation success", "total reward last 5")


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("pendulum", COLUMNS),
        ("pendulum-written", ("training success", "evaluation success", "training total reward")),
        ("cartpole", ("success last 5", "evaluation success", "evaluation steps")),
        ("spread", ("evaluation steps", "total reward last 5")),
        ("multiwalker", ("evaluation steps", "total reward last 5")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
    assert table in PAGE.read_text(encoding="utf-8"), (
        f"research/notebooks/environments.md: put in\n{table}"
    )


SPEED = 180.0
"""Steps of the environment in an episode of a swimmer: total reward over it is a speed [m/s]."""
SPEEDS = {"speed [m/s]": "evaluation", "actions sampled": "evaluation:sampled actions"}


@pytest.mark.parametrize(
    ("name", "phases"),
    [
        ("swimmer", SPEEDS),
        ("swimmer-4", SPEEDS),
        (
            "swimmer-transfer",
            {
                "4 joints": "evaluation",
                "8 joints": "evaluation:eight",
                "16 joints": "evaluation:sixteen",
                "32 joints": "evaluation:thirty_two",
            },
        ),
        ("swimmer-n", {"speed [m/s]": "evaluation"}),
    ],
)
def test_speeds_of_swimmers(name: str, phases: dict[str, str]) -> None:
    results, lines = na.load(RESULTS / f"{name}.json").results, []
    for condition in results.of_phase("evaluation"):
        own = {t: p for t, p in phases.items() if results.has(condition, p, "total_reward")}
        each = {t: results.values(condition, "total_reward", p) for t, p in own.items()}
        speeds = {t: bootstrap(v.mean(axis=1) / SPEED) for t, v in each.items()}
        lines.append(Summary(condition, len(results.seeds(condition)), speeds))
    table = tabulate(lines).markdown
    assert table in PAGE.read_text(encoding="utf-8"), (
        f"research/notebooks/environments.md: put in\n{table}"
    )


@pytest.mark.parametrize(
    ("name", "reference"),
    [
        ("aloha", "none"),
        ("aloha-copies", "planner"),
        ("aloha-ppo", "hierarchy-ppo, none"),
        ("spread-ppo", "random"),
    ],
)
def test_evaluated_rewards(name: str, reference: str, capsys: pytest.CaptureFixture[str]) -> None:
    path, by = str(RESULTS / f"{name}.json"), ("--phase", "evaluation", "--reference", reference)
    of = ("--measure", "total_reward", "--format", "markdown")
    assert main(["compare", path, *of, *by]) == 0
    rows = capsys.readouterr().out.splitlines()  # the page does not show effect sizes
    table = "".join(f"{'|'.join(row.split('|')[:5])}|\n" for row in rows)
    assert table in PAGE.read_text(encoding="utf-8"), (
        f"research/notebooks/environments.md: put in\n{table}"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spec", "extras", "agents"),
    [
        ("swimmer", ("mujoco",), {2}),
        ("swimmer-4", ("mujoco",), {4}),
        ("swimmer-transfer", ("mujoco",), {4}),
        ("swimmer-n", ("mujoco",), {2, 4, 8, 16}),
        ("spread", ("mpe2",), {3}),
        ("spread-ppo", ("mpe2",), {3}),
        ("aloha", (), {10}),
        ("aloha-ppo", (), {10}),
        ("aloha-copies", (), {10}),
    ],
)
def test_specs_of_worlds_of_others_run(
    spec: str, extras: tuple[str, ...], agents: set[int]
) -> None:
    for extra in extras:
        pytest.importorskip(extra, reason="extras mpe, mujoco")
    path = SPECS / f"{spec}.toml"
    few = ["seeds=1", "episodes=2", "steps=3", "evaluation=1"]
    teams = set()
    for trial in trials_of(Spec.load(path, few)):
        session = Session(trial)
        session.train(2)
        teams.add(len(session.scenario.agents))
        phases = [row.phase for row in session.finish().rows]
        assert phases[:3] == ["training", "training", "evaluation"]
        assert {f"evaluation:{name}" for name, _ in trial.evaluations} <= {*phases}
    assert teams == agents
