"""Without compilation the same rows come out, but for the last bits."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
RUN = """
import json
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
spec = Spec.of({"seeds": 1, "episodes": 1, "steps": 2, "evaluation": 1,
                "sweep": {"preset": ["default", "random"]}})
rows = [row for trial in trials_of(spec) for row in run_trial(trial).rows]
print(json.dumps([[row.steps, *map(float, row.measures.values()), row.return_] for row in rows]))
"""


@pytest.mark.slow
def test_interpreted_kernels_give_the_rows_of_compiled_ones() -> None:
    found = []
    for disabled in ("0", "1"):
        environment = os.environ | {"NUMBA_DISABLE_JIT": disabled, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", RUN],
            env=environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        found.append(json.loads(done.stdout))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6, atol=1e-9)
