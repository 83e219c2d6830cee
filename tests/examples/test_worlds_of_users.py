"""The tank as a study: from its file alone, through kill -9, on Dask, moved away."""

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import main

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
pytestmark = pytest.mark.slow


def command(*arguments: str, cwd: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "nested_agents", *arguments],
        cwd=cwd, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
    )  # fmt: skip


def rows(study: Path) -> list[tuple]:
    with closing(sqlite3.connect(f"file:{study}/results.sqlite?mode=ro", uri=True)) as db:
        return db.execute("SELECT * FROM results").fetchall()


def has_begun(study: Path) -> bool:
    try:
        return bool(rows(study))
    except sqlite3.OperationalError:  # no database yet, or no tables in it
        return False


@pytest.mark.parametrize(
    ("name", "measure", "change"),
    [("tank", "missing_l", "scenario.pumps=2")],
)
def test_a_world_from_a_file(
    name: str,
    measure: str,
    change: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for suffix in ("py", "toml"):
        shutil.copy(EXAMPLES / f"{name}.{suffix}", tmp_path)
    short = ["--set", "seeds=2", "episodes=6", "steps=30", "evaluation=2", change]
    run = ["run", f"{name}.toml", *short, "--jobs", "1", "--out"]
    assert main([*run, "whole"]) == 0
    capsys.readouterr()
    assert main(["results", "whole", "--format", "csv"]) == 0
    header, *cells = capsys.readouterr().out.splitlines()
    assert measure in header.split(",")
    assert len(cells) == 2 * 2 * 6

    killed = command(*run, "killed", cwd=tmp_path)
    until = time.monotonic() + 120
    while time.monotonic() < until and not has_begun(tmp_path / "killed"):
        time.sleep(0.05)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.communicate()
    (tmp_path / f"{name}.py").rename(tmp_path / "moved.py")
    assert main([*run, "killed"]) == 0
    assert rows(tmp_path / "killed") == rows(tmp_path / "whole")
    for what in ("explain", "report", "table"):
        assert main([what, "killed"]) == 0
    page = (tmp_path / "killed" / "report.html").read_text(encoding="utf-8")
    assert measure.replace("final_", "").partition("_")[0] in page

    (tmp_path / "moved.py").rename(tmp_path / f"{name}.py")
    assert main([*run, "cluster", "--backend", "dask"]) == 0
    assert rows(tmp_path / "cluster") == rows(tmp_path / "whole")
