"""The studies of the catalogue by name; others by where they are."""

from ...core.plugins.registry import Registry

CATALOGUE = "nested_agents.studies.catalogue"

STUDIES = Registry(
    "study",
    {
        "learning-curve": f"{CATALOGUE}.learning_curve",
        "chain-order": f"{CATALOGUE}.chain_order",
        "ablation": f"{CATALOGUE}.ablation",
        "shapes": f"{CATALOGUE}.shapes",
        "wheel-failure": f"{CATALOGUE}.wheel_failure",
        "scaling": f"{CATALOGUE}.scaling",
        "hierarchies": f"{CATALOGUE}.hierarchies",
        "edges": f"{CATALOGUE}.edges",
        "games": f"{CATALOGUE}.games",
        "related": f"{CATALOGUE}.related",
        "peers": f"{CATALOGUE}.peers",
    },
)
"""Studies by name; what they offer is in `nested_agents.studies.catalogue.study`."""
