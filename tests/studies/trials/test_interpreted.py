"""Without compilation the same rows come out, but for the last bits."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

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
found = [[row.steps, *map(float, row.measures.values()), row.return_] for row in rows]
"""
DISABLED = "NUMBA_DISABLE_JIT"


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get(DISABLED, "0") != "0", reason="kernels are interpreted here")
def test_interpreted_kernels_give_the_rows_of_compiled_ones() -> None:
    compiled: dict[str, Any] = {}
    exec(RUN, compiled)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", f"{RUN}\nprint(json.dumps(found))"],
        env=os.environ | {DISABLED: "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(compiled["found"], json.loads(done.stdout), rtol=1e-6, atol=1e-9)
