"""A study with recordings that can be drawn, kept in a store without any simulation."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import made_up
import numpy as np
import pytest

from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

STEPS = 30
SPEC = Spec.of({"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2,
                "sweep": {"preset": ["default", "frozen"]}})  # fmt: skip
ERROR = 'Traceback:\n  File "/home/someone/lib/core/team.py", line 3\nRuntimeError: <off & away>'


def keep(
    recording: Callable[..., dict[str, np.ndarray]],
    directory: Path,
    spec: Spec = SPEC,
    *,
    done: int = 6,
    failed: int = 0,
    steps: int = STEPS,
) -> Path:
    """Keep a study of which some trials are done, and some of the next ones failed."""
    with made_up.opened(directory, spec) as store:
        for i, trial in enumerate(trials_of(spec)):
            if i < done:
                result = made_up.measure(trial)
                kept = dict.fromkeys(trial.recorded.values(), recording(steps + i))
                result = replace(result, recordings=kept)
                save(store, trial, result, 1.0)
            elif i < done + failed:
                store.fail(trial, ERROR)
    return directory


@pytest.fixture(scope="session")
def kept(recorded):
    """The function `keep`, with recordings that can be drawn."""
    return partial(keep, recorded)
