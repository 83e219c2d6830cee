"""An array of Slurm jobs, as the tutorial has it: killed, put back in the queue, the same rows."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import main

ROOT = Path(__file__).resolve().parents[3]
SPEC = """
seeds = 2
episodes = 2
steps = 40
evaluation = 1
scenario.kind = "line-up"
[sweep]
preset = ["default", "frozen", "random"]
"""


def rows(study: Path) -> list[str]:
    """Return what `export` writes of every episode."""
    assert main(["export", str(study)]) == 0
    return (study / "export" / "episodes.csv").read_text().splitlines()[1:]


@pytest.mark.slow
def test_an_array_that_is_killed_and_put_back_ends_with_the_same_rows(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "tutorials" / "cluster.md").read_text()
    line = next(re.finditer(r"^nested-agents run .*SLURM_ARRAY_TASK_ID.*$", page, re.M)).group()
    line = "exec " + line.replace("nested-agents", f"{sys.executable} -m nested_agents", 1)
    (tmp_path / "study.toml").write_text(SPEC)

    def job(task: int) -> "subprocess.Popen[bytes]":
        """Begin a job of the array, as `sbatch` does."""
        env = {**os.environ, "SLURM_ARRAY_TASK_ID": str(task)}
        return subprocess.Popen(["bash", "-c", line], cwd=tmp_path, env=env)

    killed, kept = job(0), tmp_path / "out" / "part-0" / "recordings"
    while killed.poll() is None and not list(kept.glob("[!.]*.npz")):
        time.sleep(0.01)
    killed.send_signal(signal.SIGKILL)
    assert killed.wait() == -signal.SIGKILL
    assert [job(task).wait() for task in (0, 1)] == [0, 0]
    whole = ["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "whole"), "--jobs", "1"]
    assert main(whole) == 0
    parts = [row for task in (0, 1) for row in rows(tmp_path / "out" / f"part-{task}")]
    assert sorted(parts) == sorted(rows(tmp_path / "whole"))
