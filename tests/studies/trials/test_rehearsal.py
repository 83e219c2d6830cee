"""What is compiled before there is a physics engine is all that the trials of a spec call."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
DEMO = ROOT / "studies/catalogue/learning_curve/demo.toml"
REHEARSAL = """
import runpy
runpy.run_module("nested_agents.studies.trials.rehearsal", run_name="__main__")
"""
TRIALS = """
import sys
from dataclasses import replace
from pathlib import Path
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
for trial in trials_of(Spec.parse(Path(sys.argv[1]).read_text()))[:4]:
    run_trial(replace(trial, episodes=2, steps=20, evaluation=1))
"""
KERNELS = """
import gc, json
from nested_agents.core.numerics import Kernel
every = [thing for thing in gc.get_objects() if type(thing) is Kernel]
kernels = [kernel for kernel in every if "compiled" in vars(kernel)]
pairs = [(kernel.py_func, s) for kernel in kernels for s in kernel.compiled.signatures]
print(json.dumps([[str(function), str(s)] for function, s in pairs]))
"""


@pytest.mark.slow
def test_a_rehearsal_without_box2d_compiles_what_trials_of_the_demo_call() -> None:
    called = []
    for program in (REHEARSAL, TRIALS):
        line = [sys.executable, "-c", program + KERNELS, str(DEMO), "Box2D"]
        made = subprocess.run(line, cwd=ROOT, check=True, capture_output=True, text=True).stdout
        called.append({(name.split(" at ")[0], types) for name, types in json.loads(made)})
    rehearsed, needed = called
    assert len(needed) > 10
    assert needed <= rehearsed
