"""What all peers are to the control loop."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import cast

import numpy as np
import torch

from ..arrays import FloatArray, IntArray
from ..protocols import Scenario, Transition
from .seen import Seen


class Peer:
    """A learner that acts for all agents by what it sees; inherit it, and add what it learns.

    Parameters
    ----------
    seed
        Source of everything random in it.
    """

    def __init__(self, seed: np.random.SeedSequence) -> None:
        self.rng = np.random.Generator(np.random.PCG64(seed))
        torch.set_num_threads(1)  # equal sums on any machine; networks this small are fastest so

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def predict(self, scenario: Scenario) -> Seen:
        """Return the present states, see `nested_agents.core.peers.seen`."""
        return cast(Seen, scenario.predict())

    def check(self, prediction: Seen) -> None:
        """Refuse nothing."""

    def adapt(self, prediction: Seen, joint_action: IntArray, transition: Transition) -> None:
        """Revise nothing: nothing was predicted."""

    def learn(self, transition: Transition) -> None:
        """Take in what a step led to."""

    def end_episode(self) -> None:
        """Note that an episode has ended."""


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


def weights_of(policy: torch.nn.Module) -> dict[str, FloatArray]:
    """Return all weights of a network by name."""
    return {name: value.numpy().copy() for name, value in policy.state_dict().items()}
