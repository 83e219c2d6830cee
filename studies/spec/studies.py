"""The studies of the catalogue by name; others by where they are."""

from ...core.plugins.registry import Registry

NAMES = (
    "learning-curve",
    "chain-order",
    "ablation",
    "shapes",
    "wheel-failure",
    "scaling",
    "hierarchies",
    "edges",
    "fit",
    "signals",
    "games",
    "related",
    "peers",
    "experience",
)
STUDIES = Registry(
    "study",
    {name: f"nested_agents.studies.catalogue.{name.replace('-', '_')}" for name in NAMES},
)
"""Studies by name; what they offer is in `nested_agents.studies.catalogue.study`."""
