"""The studies of the catalogue by name; others by where they are."""

from ...core.plugins.registry import Registry

NAMES = ("learning-curve", "ablation", "wheel-failure", "scaling", "hierarchies", "experience")
MOVED = ("chain-order", "shapes", "edges", "fit", "signals", "games", "related", "peers")
STUDIES = Registry(
    "study",
    {name: f"nested_agents.studies.catalogue.{name.replace('-', '_')}" for name in NAMES}
    | {name: f"nested_agents.research.studies.{name.replace('-', '_')}" for name in MOVED},
)
"""Studies by name; what they offer is in `nested_agents.studies.catalogue.study`."""
