"""The benchmarks run and agree with their baselines; how fast they are is no test's business."""

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
def test_decisions_of_every_size_are_timed(run: Run) -> None:
    few = ["--robots", "2", "4", "5", "--number", "3"]
    said = run("benchmarks.decisions", *few)
    assert "time ~ n^" in said
    assert "with 8 to 10 agents (least)" in said
    assert "2 robots" in run(
        "benchmarks.decisions", "--robots", "2", "--number", "3", "--training", "1"
    )
