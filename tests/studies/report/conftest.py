"""A study with recordings that can be drawn, kept in a store without any simulation."""

from dataclasses import replace
from pathlib import Path

import made_up
import numpy as np
import pytest

from nested_agents.scenarios.box_pushing.world.settings import BoxSettings, label
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

SPEC = Spec.of({"seeds": 3, "episodes": 4, "steps": 5, "evaluation": 2,
                "sweep": {"preset": ["default", "frozen"]}})  # fmt: skip
STEPS = 30
ERROR = 'Traceback:\n  File "/home/someone/lib/core/team.py", line 3\nRuntimeError: <off & away>'
RING = BoxSettings(
    vertices=((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)),
    holes=(((-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)),),
)


def wrapped(poses: np.ndarray) -> np.ndarray:
    """Headings within half a turn of 0, so that they jump where they cross the cut."""
    return np.concatenate([poses[..., :2], (poses[..., 2:] + np.pi) % (2 * np.pi) - np.pi], axis=-1)


def recording(steps: int = STEPS) -> dict[str, np.ndarray]:
    """Two four-wheel robots push a box with a hole; one wheel fails half-way."""
    t = np.linspace(0.0, 1.0, steps + 1)
    box = np.stack([t, 0.1 * np.sin(5 * t), 3.0 + t], axis=1)
    robots = np.stack([box - [0.15, 0.06, 0.2], box - [0.15, -0.06, 0.1]], axis=1)
    failed = np.zeros((steps + 1, 8), dtype=bool)
    failed[steps // 2 :, 3] = True
    return {
        "robot_poses": wrapped(robots),
        "box_pose": wrapped(box),
        "goal_pose": np.array([1.0, 0.0, 0.0]),
        "wheel_speeds": 0.13 * np.cos(np.outer(t, np.arange(1, 9))),
        "contact": np.stack([t > 0.2, t > 0.4], axis=1),
        "failed": failed,
        "reward": np.zeros(steps),
        "dt": np.array(5.12),
        "robot": np.array("four-wheel"),
        "box": np.array(label(RING)),
    }


def keep(directory: Path, spec: Spec = SPEC, *, done: int = 6, failed: int = 0) -> Path:
    """Keep a study of which some trials are done, and some of the next ones failed."""
    with made_up.opened(directory, spec) as store:
        for i, trial in enumerate(trials_of(spec)):
            if i < done:
                result = made_up.measure(trial)
                kept = dict.fromkeys(trial.recorded.values(), recording(STEPS + i))
                result = replace(result, recordings=kept)
                save(store, trial, result, 1.0)
            elif i < done + failed:
                store.fail(trial, ERROR)
    return directory


@pytest.fixture(scope="session")
def kept():
    """The function `keep`."""
    return keep


@pytest.fixture(scope="session")
def recorded():
    """The function `recording`."""
    return recording
