"""Submit, exit, come back: submitit with a stand-in for Slurm, and what the parts are together."""

import os
import runpy
import sys
import time
from pathlib import Path
from typing import Any

import pytest

import nested_agents as na
from nested_agents.studies.spec.tables import dumps

EXAMPLE = Path(__file__).parents[2] / "examples" / "slurm_parts.py"
SPEC: dict[str, Any] = {
    "seeds": 3,
    "episodes": 2,
    "steps": 3,
    "evaluation": 1,
    "scenario": {"kind": "line-up"},
    "sweep": {"preset": ["default", "random"]},
}
SBATCH = """#!{python}
import os, re, subprocess, sys

text = open(sys.argv[1]).read()
command = re.search(r"[^ ]+ -u -m submitit.*", text)[0]
last = int(re.search(r"^#SBATCH --array=0-([0-9]+)", text, re.MULTILINE)[1])
for task in map(str, range(last + 1)):
    names = dict(SLURM_JOB_ID="7" + task, SLURM_ARRAY_JOB_ID="7", SLURM_ARRAY_TASK_ID=task)
    names |= dict(SLURM_NTASKS="1", SLURM_JOB_NUM_NODES="1", SLURM_NODEID="0", SLURM_PROCID="0")
    names |= dict(SLURM_LOCALID="0", SUBMITIT_EXECUTOR="slurm")
    quiet = dict(stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    subprocess.Popen(command, shell=True, env=os.environ | names, **quiet)
print("Submitted batch job 7")
"""
"""Begins a job for each index of the array that submitit has written, and exits."""


def test_it_is_python() -> None:
    compile(EXAMPLE.read_text(encoding="utf-8"), str(EXAMPLE), "exec")


@pytest.mark.slow
def test_submit_exit_and_come_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("submitit")
    for name, text in {"sbatch": SBATCH.format(python=sys.executable), "srun": "#!/bin/sh"}.items():
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o700)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(dumps(SPEC))
    main = runpy.run_path(str(EXAMPLE))["main"]
    main("study.toml", "out", 2, "slurm")
    assert "2 of 2 parts submitted as 7_0; come back later" in capsys.readouterr().out
    parts = [Path("out/part-0"), Path("out/part-1")]
    deadline = time.monotonic() + 240.0
    while not all(_is_done(part, n) for part, n in zip(parts, (4, 2), strict=True)):
        assert time.monotonic() < deadline
        time.sleep(0.5)
    main("study.toml", "out", 2, "slurm")
    table = capsys.readouterr().out
    whole = na.run("study.toml", "whole", jobs=1, progress=False)
    assert table == f"{whole}\n"


def _is_done(part: Path, trials: int) -> bool:
    try:
        return len(na.load(part).trials) == trials
    except na.SpecError:
        return False


def test_parts_of_one_study_are_it(tmp_path: Path) -> None:
    whole = na.run(SPEC, tmp_path / "whole", jobs=1, progress=False)
    for name, seeds in {"a": [2, 0], "b": [1]}.items():
        na.run({**SPEC, "seeds": seeds}, tmp_path / name, jobs=1, progress=False)
    joined = na.load(tmp_path / "b", tmp_path / "a")
    assert joined.conditions == ("default", "random")
    assert str(joined) == str(whole)
    assert joined.outline.seeds == (1, 2, 0)
    columns = ["condition", "seed", "phase", "episode", "return", "success"]
    assert joined.episodes[columns].equals(whole.episodes[columns])
    twice = na.load(tmp_path / "whole", tmp_path / "b")  # a trial of which is in both
    assert twice.conditions[:2] == ("default (whole)", "random (whole)")
