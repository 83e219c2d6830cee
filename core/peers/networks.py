"""What peers with networks share: their random numbers, and their weights as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.logger import Logger

from ..arrays import FloatArray

# Equal sums on a machine, whatever else runs; small networks are fastest so.
torch.set_num_threads(1)


@contextmanager
def drawing_from(rng: np.random.Generator) -> Iterator[None]:
    """Let the global generators of NumPy and PyTorch follow from `rng`, and put them back."""
    before = np.random.get_state(), torch.random.get_rng_state()  # noqa: NPY002
    seed = int(rng.integers(2**32))
    np.random.seed(seed)  # noqa: NPY002
    torch.manual_seed(seed)
    try:
        yield
    finally:
        np.random.set_state(before[0])  # noqa: NPY002
        torch.random.set_rng_state(before[1])


def prepare(
    model: Any, inputs: int, actions: spaces.Space[Any], n_envs: int, rng: np.random.Generator
) -> None:
    """Give a model its spaces, and make its networks without an environment and without a log."""
    model.observation_space = spaces.Box(-np.inf, np.inf, (inputs,), dtype=np.float32)
    model.action_space, model.n_envs = actions, n_envs
    with drawing_from(rng):
        model._setup_model()
    model.set_logger(Logger(None, []))


def weights_of(policy: torch.nn.Module) -> dict[str, FloatArray]:
    """Return all weights of a network by name."""
    return {name: value.numpy().copy() for name, value in policy.state_dict().items()}
