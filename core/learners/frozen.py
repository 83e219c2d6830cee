"""The learner that never learns: the control of every learning curve."""

from collections.abc import Mapping
from typing import ClassVar, Literal

from ..numerics.arrays import FloatArray
from .learner import LearnerSettings
from .online import Online


class FrozenSettings(LearnerSettings):
    """No learning: the consequents stay zero. The control of every learning curve."""

    kind: Literal["frozen"] = "frozen"
    factory: ClassVar[str] = f"{__name__}:Frozen"


class Frozen(Online):
    """Never learns: the consequent weights stay as they are, zero from the start."""

    kept = ("theta",)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        return 0

    def arrays(self) -> dict[str, FloatArray]:
        """Return the weights, which is all there is."""
        return {"theta": self.theta}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        super().restore({"previous": self.theta[:0], "rewards": self._rewards, **arrays})
