"""The benchmarks run and agree with their baselines; how fast they are is no test's business."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_the_smallest_benchmark_runs(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "benchmarks", "--smoke", "--json", str(tmp_path / "b.json")]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert all(len(line) <= 80 for line in run.stdout.splitlines())
    result = json.loads((tmp_path / "b.json").read_text(encoding="utf-8"))
    assert [row["agents"] for row in result["exact"]] == [2, 2]
    assert result["exact"][0]["literal_ratio"] > 0
    assert result["beyond"][0]["total_ms"] > 0


@pytest.mark.slow
def test_the_smallest_benchmark_of_worlds_runs(tmp_path: Path) -> None:
    path = tmp_path / "w.json"
    command = [sys.executable, "-m", "benchmarks.worlds", "--smoke", "--json", str(path)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert all(len(line) <= 80 for line in run.stdout.splitlines())
    result = json.loads(path.read_text(encoding="utf-8"))
    assert [row["robots"] for row in result["by_size"]] == [2]
    assert len(result["others"]) + len(result["missing"]) == 6


@pytest.mark.slow
def test_errors_of_few_states_are_told() -> None:
    few = ["--robots", "2", "5", "--seeds", "1", "--steps", "9", "--times", "2"]
    command = [sys.executable, "-m", "benchmarks.errors", *few]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    lines = run.stdout.splitlines()
    assert all(len(line) <= 80 for line in lines)
    for kind in ("sampling", "moments", "extremes", "reference", "exact"):
        assert any(kind in line for line in lines)


@pytest.mark.slow
def test_a_small_crowd_is_drawn(tmp_path: Path) -> None:
    path = tmp_path / "crowd.png"
    sizes = ["--robots", "8", "--steps", "2"]
    command = [sys.executable, "-m", "benchmarks.crowd", str(path), *sizes]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.startswith("16 agents, 2 decisions of 512 ms each")
    assert path.stat().st_size > 5000


@pytest.mark.slow
def test_decisions_of_every_size_are_timed() -> None:
    few = ["--preset", "own-value", "--robots", "2", "4", "5", "--number", "3"]
    command = [sys.executable, "-m", "benchmarks.decisions", *few]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert "time ~ n^" in run.stdout
    assert "with 8 to 10 agents (least)" in run.stdout


@pytest.mark.slow
def test_what_can_be_solved_at_a_size_is_told() -> None:
    few = ["--robots", "3", "--seeds", "2", "--scalings", "similar", "--grows", "width"]
    command = [sys.executable, "-m", "benchmarks.sizes", *few]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert all(len(line) <= 80 for line in run.stdout.splitlines())
    assert "scaling similar, box grows: width" in run.stdout
    assert "│ 3 " in run.stdout
