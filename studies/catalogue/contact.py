"""How the work of touching is shared among robots, where a scenario tells who touches when."""

import numpy as np

from ...core.agents.loop import StepRecord
from ...core.numerics.arrays import FloatArray


class ContactShares:
    """Takes in step records; see `Observer`.

    A scenario tells it by ``contact_time`` ``(M,)`` in `Transition.info`, the fraction of the step
    in which each robot was in contact.
    """

    def __init__(self) -> None:
        self._touching: list[FloatArray] = []
        self._shares: list[FloatArray] = []

    def __call__(self, record: StepRecord) -> None:
        """Take in one step."""
        if "contact_time" not in record.transition.info:
            return
        self._touching.append(record.transition.info["contact_time"])
        if record.last:
            pushing = max(float(np.max(self._touching, axis=1).sum()), 1e-12)
            self._shares.append(np.sum(self._touching, axis=0) / pushing)
            self._touching = []

    @property
    def shares(self) -> FloatArray:
        """``(n_episodes, M)`` how much of the time in which any robot is in contact each is.

        Without episodes if the scenario does not tell.
        """
        return np.array(self._shares)
