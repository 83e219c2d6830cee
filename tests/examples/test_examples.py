"""Every example runs; those that need what is not installed are at least read."""

import json
import runpy
import warnings
from functools import partial
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

from nested_agents import faults

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_random_policy(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLES / "random_policy.py"), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "8 wheels, 8 state variables each"
    assert lines[1].startswith("sum of rewards ")
    assert lines[2] == "failed wheels: 1"


def test_ppo(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    path = EXAMPLES / "train_ppo.py"
    compile(path.read_text(encoding="utf-8"), str(path), "exec")
    pytest.importorskip("stable_baselines3", reason="pip install stable-baselines3")
    monkeypatch.setattr("sys.argv", ["train_ppo.py", "1024"])
    runpy.run_path(str(path), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["before training", "after 1024 steps"]


def test_torchrl(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    path = EXAMPLES / "train_torchrl.py"
    compile(path.read_text(encoding="utf-8"), str(path), "exec")
    pytest.importorskip("torchrl", reason="pip install torchrl")
    monkeypatch.setattr("sys.argv", ["train_torchrl.py", "1000"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the version of PettingZoo that TorchRL tests with
        runpy.run_path(str(path), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["before training", "after 1000 joint steps"]


def test_fault_recovery_is_read() -> None:
    path = EXAMPLES / "fault_recovery.py"
    compile(path.read_text(encoding="utf-8"), str(path), "exec")


@pytest.mark.slow
def test_broken_joint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = EXAMPLES / "broken_joint.py"
    compile(path.read_text(encoding="utf-8"), str(path), "exec")
    pytest.importorskip("stable_baselines3", reason="pip install stable-baselines3")
    pytest.importorskip("mujoco", reason="extra [mujoco]")
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log
    monkeypatch.setattr(faults, "recovery_table", partial(faults.recovery_table, steps=5))
    monkeypatch.setattr(
        "sys.argv", ["broken_joint.py", str(tmp_path / "c.json"), "512", "512", "1"]
    )
    runpy.run_path(str(path), run_name="__main__")
    assert "PPO, relearned: fore thigh" in capsys.readouterr().out
    rows = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    assert len(rows) == 16
    before, after = np.array(rows[0]["faulty"])[0, :5], np.array(rows[0]["faulty"])[0, 5:]
    assert before.tolist() == rows[0]["healthy"][0][:5]
    assert after.tolist() != rows[0]["healthy"][0][5:]


def test_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "push.png"
    monkeypatch.setattr("sys.argv", ["picture.py", str(path)])
    runpy.run_path(str(EXAMPLES / "picture.py"), run_name="__main__")
    assert path.stat().st_size > 20_000


@pytest.mark.slow
def test_contact_sheet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "boxes.png"
    monkeypatch.setattr("sys.argv", ["contact_sheet.py", str(path)])
    runpy.run_path(str(EXAMPLES / "contact_sheet.py"), run_name="__main__")
    assert path.stat().st_size > 50_000
    documented = (EXAMPLES.parent / "docs" / "environments" / "box_pushing.md").read_text(
        encoding="utf-8"
    )
    assert capsys.readouterr().out.strip() in documented


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("plot_*.py")), ids=lambda path: path.stem)
def test_an_example_of_the_gallery_draws_a_figure(path: Path) -> None:
    plt.close("all")
    with mpl.rc_context({"backend": "agg"}):
        runpy.run_path(str(path), run_name="__main__")
        assert len(plt.get_fignums()) == 1
        plt.close("all")


def test_three_uses_in_thirty_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = EXAMPLES / "notebook.py"
    code = path.read_text(encoding="utf-8").split('"""\n', 2)[2]
    assert len([line for line in code.splitlines() if line.strip() and line[0] != "#"]) <= 30
    monkeypatch.setattr("sys.argv", ["notebook.py", str(tmp_path / "study")])
    runpy.run_path(str(path), run_name="__main__")
    out = capsys.readouterr().out
    assert "Hierarchy(4 agents: robot1.left -> robot1.right, robot1.left -> robot2.left" in out
    assert "At least 6 seeds are needed" in " ".join(out.split())
    assert "decision time [ms], minus that of" in out
    assert "The paper prints 2.45e12 (nested) and 1.1e27 (single agent) for n = 4" in out
    assert r"\begin{tabular}{rlrrrrr}" in out
    assert (tmp_path / "study" / "scaling.pdf").is_file()
    assert (tmp_path / "study-own" / "report.html").is_file()
