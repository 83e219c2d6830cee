"""Programs of laboratory work run, and pages hold what they print."""

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
    page = (ROOT / "research" / "notebooks" / "box_pushing.md").read_text(encoding="utf-8")
    told = [f"| {' | '.join(row)} |" for row in rows if row]
    assert len(told) == 28
    assert [row for row in told if row not in page] == []
    wide = next(line for line in lines if line.startswith("64, wide box first: "))
    assert wide.startswith("64, wide box first: 38 failures, 17 with the box too far from the goal")
    assert wide.endswith("(after 81 decisions in the median), 21 out of decisions")


@pytest.mark.slow
def test_rules_can_hold_the_pole(run: Run) -> None:
    (line,) = run("research.cartpole", "--orders", "3", "--held", "5").splitlines()
    assert line == "order 3, held for 5: 500 steps, least 500"
