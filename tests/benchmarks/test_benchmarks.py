"""The benchmarks run and agree with their baselines; how fast they are is no test's business."""

import json
import runpy
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
Run = Callable[..., str]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run ``python -m MODULE ARGUMENTS`` in this process and return what it printed."""

    def run(module: str, *arguments: str) -> str:
        monkeypatch.syspath_prepend(ROOT)
        monkeypatch.setattr("sys.argv", [module, *arguments])
        runpy.run_module(module, run_name="__main__")
        return capsys.readouterr().out

    return run


@pytest.mark.slow
def test_the_smallest_benchmark_runs(run: Run, tmp_path: Path) -> None:
    *said, where = run("benchmarks", "--smoke", "--json", str(tmp_path / "b.json")).splitlines()
    assert all(len(line) <= 80 for line in said)
    assert where == f"kept in {tmp_path / 'b.json'}"
    result = json.loads((tmp_path / "b.json").read_text(encoding="utf-8"))
    assert [row["agents"] for row in result["exact"]] == [2, 2]
    assert result["exact"][0]["literal_ratio"] > 0
    assert result["beyond"][0]["total_ms"] > 0
    assert 0 < result["trial"]["decision_us"] < 1e6 * result["trial"]["trial_s"]
    assert all(speed > 0 for speed in result["machine"]["speed"].values())


@pytest.mark.slow
def test_ppo_in_a_hierarchy_is_timed(run: Run) -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    lines = run("benchmarks.peers", "--number", "1", "--rounds", "1").splitlines()
    assert lines[-1].startswith("update of 8 agents, chain / independent: ")


def test_docs_hold_the_table_of_releases(run: Run) -> None:
    table = run("benchmarks.releases")
    assert table in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8"), table


@pytest.mark.slow
def test_the_smallest_benchmark_of_worlds_runs(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "w.json"
    said = run("benchmarks.worlds", "--smoke", "--json", str(path))
    assert all(len(line) <= 80 for line in said.splitlines())
    result = json.loads(path.read_text(encoding="utf-8"))
    assert [row["robots"] for row in result["by_size"]] == [2]
    assert len(result["others"]) + len(result["missing"]) == 6


@pytest.mark.slow
def test_errors_of_few_states_are_told(run: Run) -> None:
    few = ["--robots", "2", "5", "--seeds", "1", "--steps", "9", "--times", "2"]
    said = run("research.errors", *few)
    lines = said.splitlines()
    assert all(len(line) <= 80 for line in lines)
    for kind in ("sampling", "reference", "exact"):
        assert any(kind in line for line in lines)


@pytest.mark.slow
def test_a_small_crowd_is_drawn(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "crowd.png"
    sizes = ["--robots", "8", "--steps", "2"]
    said = run("research.crowd", str(path), *sizes)
    assert said.startswith("16 agents, 2 decisions of 512 ms each")
    assert path.stat().st_size > 5000


@pytest.mark.slow
def test_decisions_of_every_size_are_timed(run: Run) -> None:
    few = ["--preset", "own-value", "--robots", "2", "4", "5", "--number", "3"]
    said = run("benchmarks.decisions", *few)
    assert "time ~ n^" in said
    assert "with 8 to 10 agents (least)" in said
    assert "2 robots" in run(
        "benchmarks.decisions", "--robots", "2", "--number", "3", "--training", "1"
    )


def test_boxes_decide_at_once_as_one_by_one(run: Run) -> None:
    heading, line = run("benchmarks.responses", "--robots", "3", "--number", "3").splitlines()
    assert heading.endswith("same joint actions")
    assert line.endswith("True")


@pytest.mark.slow
def test_what_can_be_solved_at_a_size_is_told(run: Run) -> None:
    few = ["--robots", "3", "--seeds", "2", "--scalings", "similar", "--grows", "width"]
    said = run("research.sizes", *few)
    assert all(len(line) <= 80 for line in said.splitlines())
    assert "scaling similar, box grows: width" in said
    assert "│ 3 " in said


def test_what_steering_limits_is_told_as_on_the_page(run: Run) -> None:
    said = run("research.steering", "--scripted", "3", "--seeds", "1", "--episodes", "2")
    assert said.startswith("3 robots, scripted: 1.00 [0.34, 1.00], ")
    lines = [line for line in said.splitlines() if "3, scripted" not in line]
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in lines]
    page = (ROOT / "docs" / "learning.md").read_text(encoding="utf-8")
    told = [f"| {' | '.join(row)} |" for row in rows if row]
    assert len(told) == 14
    assert [row for row in told if row not in page] == []
    wide = next(line for line in lines if line.startswith("64, wide box first: "))
    assert wide.startswith("64, wide box first: 38 failures, 17 with the box too far from the goal")
    assert wide.endswith("(after 81 decisions in the median), 21 out of decisions")


def test_values_and_predictors_are_crossed(run: Run) -> None:
    short = "scenario.robots=3", "episodes=1", "evaluation=1", "steps=12"
    told = run("research.learned_decisions", "--seeds", "0", "--set", *short).splitlines()
    assert told[0].split() == ["0", "mean"]
    assert told[7].split() == ["values", "learned,", "robots", "given", "0.0", "0.0"]
    assert told[8].split() == ["learned", "as", "it", "is"]
    assert len(told) == 18


@pytest.mark.slow
def test_a_batch_of_mujoco_is_timed(run: Run) -> None:
    pytest.importorskip("mujoco", reason="extra [mujoco]")
    (line,) = run("benchmarks.rollout", "--ids", "Swimmer-v5", "--budget", "0.1").splitlines()
    assert line.startswith("Swimmer-v5: 9 joint actions, copies ")
    assert line.endswith("states off by 0")


@pytest.mark.slow
def test_rules_can_hold_the_pole(run: Run) -> None:
    (line,) = run("research.cartpole", "--orders", "3", "--held", "5").splitlines()
    assert line == "order 3, held for 5: 500 steps, least 500"
