"""Cases of the hierarchies study: a hierarchy within a setting."""

from typing import NamedTuple

from ...results.sizes import Sizes
from ...results.statistics import Estimate


class HierarchyCase(NamedTuple):
    """A hierarchy in a setting, such as a number of robots."""

    condition: str
    """Label of the condition."""
    hierarchy: str
    """Label without the number of robots and the value that decides."""
    value_of: str
    """Value that decides; empty if it is not swept."""
    robots: int
    """Number of bodies."""
    sizes: Sizes
    """Numbers of bodies of all cases, and the name of bodies."""
    values: dict[str, Estimate]
    """Estimates by title."""
    phase: str = "evaluation"
    """Phase of the evaluated episodes."""

    @property
    def setting(self) -> str:
        """Setting in words, which compared cases share."""
        return f"{self.sizes.shown(self.robots)}, {self.value_of}".strip(", ")

    @property
    def label(self) -> str:
        """Label of its row in the table."""
        return f"{self.setting}, {self.hierarchy}".removeprefix(", ")
