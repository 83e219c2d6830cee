"""Topologies: builders, settings, checks and pictures of hierarchies."""

from ..core.hierarchy.hierarchy import Hierarchy
from .builders import from_networkx
from .config import TOPOLOGIES, Topology, TopologySettings, build, parse

__all__ = [
    "TOPOLOGIES",
    "Hierarchy",
    "Topology",
    "TopologySettings",
    "build",
    "from_networkx",
    "parse",
]
