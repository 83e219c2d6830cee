"""What is compiled before there is a physics engine is all that the trials of a spec call."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
DEMO = ROOT / "studies/catalogue/learning_curve/demo.toml"
RUN = """
import sys
from dataclasses import replace
from pathlib import Path
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
for trial in trials_of(Spec.parse(Path(sys.argv[1]).read_text()))[:4]:
    run_trial(replace(trial, episodes=2, steps=20, evaluation=1))
"""


@pytest.mark.slow
def test_a_rehearsal_without_box2d_compiles_what_trials_of_the_demo_call(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    module = "nested_agents.studies.trials.rehearsal"
    cached: list[dict[Path, int]] = []
    for line in (["-m", module, DEMO, "Box2D"], ["-c", RUN, DEMO]):
        subprocess.run([sys.executable, *line], env=environment, check=True)
        cached.append({path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb[ci]")})
    assert len(cached[0]) > 20
    assert cached[0] == cached[1]
