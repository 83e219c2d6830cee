"""What is compared: teams under a hierarchy, in a setting that others share."""

from typing import NamedTuple

from ...results.sizes import Sizes
from ...results.statistics import Estimate


class HierarchyCase(NamedTuple):
    """One hierarchy under which teams are evaluated."""

    condition: str
    """Its label."""
    hierarchy: str
    """Its label without the number of robots and whose value decides."""
    value_of: str
    """Whose value decides; empty if that is not swept."""
    robots: int
    """Number of bodies."""
    sizes: Sizes
    """Those of all cases, and what bodies are called."""
    values: dict[str, Estimate]
    """Estimates by title."""
    phase: str = "evaluation"
    """Of its episodes."""

    @property
    def setting(self) -> str:
        """What it has in common with those that it is compared with."""
        return f"{self.sizes.shown(self.robots)}, {self.value_of}".strip(", ")

    @property
    def label(self) -> str:
        """How its line of the table is called."""
        return f"{self.setting}, {self.hierarchy}".removeprefix(", ")
