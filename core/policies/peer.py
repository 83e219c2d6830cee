"""What all peers are to the control loop."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from ..interface.scenario import Actors, Scenario
from ..numerics.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Seen:
    """The present states, and what could follow, for those who ask."""

    present: FloatArray
    """``(n, d)`` states of all agents."""
    scenario: Scenario
    """Where they are."""

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` as the scenario predicts them."""
        return cast(Any, self.scenario).predict().states(agent, joint_actions)


class Peer(Actors):
    """A learner that acts for all agents by what it sees; inherit it, and add what it learns.

    Without more it predicts, refuses, revises and learns nothing.

    Parameters
    ----------
    seed
        Source of everything random in it.
    """

    def __init__(self, seed: np.random.SeedSequence) -> None:
        self.rng = np.random.Generator(np.random.PCG64(seed))

    def predict(self, scenario: Scenario, states: FloatArray) -> Seen:
        """Return the present states: nothing is predicted unless asked, and it costs nothing."""
        return Seen(states, scenario)

    def arrays(self) -> dict[str, FloatArray]:
        """Return what has been learned, if anything."""
        return {}
