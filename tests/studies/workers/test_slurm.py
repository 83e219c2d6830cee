"""The script of a Slurm array, as it stands in the tutorial, with a stand-in for ``sbatch``."""

import os
import re
import subprocess
import sys
from pathlib import Path

import made_up
import pytest

from nested_agents.studies.cli.main import main

PAGE = Path(__file__).resolve().parents[3] / "docs" / "tutorials" / "cluster.md"
SBATCH = """#!{python}
import os, re, shutil, subprocess, sys

spooled = shutil.copy(sys.argv[1], "{spool}")
os.chmod(spooled, 0o700)
array = re.search(r"^#SBATCH --array=(.+)$", open(spooled).read(), re.MULTILINE)[1]
first, last = map(int, os.environ.get("SBATCH_ARRAY_INX", array).split("-"))
for task in map(str, range(first, last + 1)):
    names = dict(SLURM_JOB_ID="7" + task, SLURM_ARRAY_JOB_ID="7", SLURM_ARRAY_TASK_ID=task)
    with open(f"slurm-7_{{task}}.out", "a") as log:
        subprocess.run(
            [spooled], env=os.environ | names, stdout=log, stderr=log, start_new_session=True
        )
print("Submitted batch job 7")
"""
"""Runs a script for each index of its array, one after the other; as in Slurm a variable of the
environment is stronger than the script's line."""


@pytest.mark.slow
def test_a_killed_array_that_is_submitted_again_ends_with_the_bytes_of_a_serial_run(
    tmp_path, monkeypatch
):
    (script,) = re.findall(r"^```bash\n(#!.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    made_up.write_study(tmp_path)
    (tmp_path / "array.sh").write_text(script)
    sbatch = tmp_path / "bin" / "sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(SBATCH.format(python=sys.executable, spool=tmp_path / "bin"))
    sbatch.chmod(0o700)
    dev = tmp_path / "dev"  # as in a checkout
    dev.write_text('#!/bin/sh\nshift\nexec "$@"\n')
    dev.chmod(0o700)
    mark = tmp_path / "mark"
    monkeypatch.chdir(tmp_path)
    assert main(["run", "study.toml", "--out", "serial", "--jobs", "1", "--set", "seeds=2"]) == 0
    places = [str(sbatch.parent), str(Path(sys.executable).parent), os.environ["PATH"]]
    monkeypatch.setenv("PATH", os.pathsep.join(places))
    monkeypatch.setenv("SBATCH_ARRAY_INX", "0-1")
    monkeypatch.setenv("MADE_UP_MARK", str(mark))
    with subprocess.Popen(["sbatch", "array.sh"]) as submitted:
        made_up.kill_group(mark, 2)
    assert submitted.returncode == 0
    assert main(["status", "out/part-0"]) == 0
    subprocess.run(["sbatch", "array.sh"], check=True)
    assert len(made_up.begun(mark)) == 4 + 1  # the one that was killed

    whole = made_up.exported("serial")
    parts = [made_up.exported(f"out/part-{task}") for task in range(2)]
    head, *rows = whole.pop("episodes.csv").splitlines(keepends=True)
    joined = []
    for part in parts:
        above, *below = part.pop("episodes.csv").splitlines(keepends=True)
        assert above == head
        joined += below
    order = list(dict.fromkeys(row.split(b",")[0] for row in rows))
    assert sorted(joined, key=lambda row: order.index(row.split(b",")[0])) == rows
    assert {name: data for part in parts for name, data in part.items()} == whole
