"""What is measured: specs, trials, store, statistics and reports."""

from ..core.registry import Registry

STUDIES = Registry(
    "study",
    {
        "learning-curve": f"{__name__}.catalogue.learning_curve",
        "chain-order": f"{__name__}.catalogue.chain_order",
        "ablation": f"{__name__}.catalogue.ablation",
        "shapes": f"{__name__}.catalogue.shapes",
        "wheel-failure": f"{__name__}.catalogue.wheel_failure",
        "scaling": f"{__name__}.catalogue.scaling",
        "hierarchies": f"{__name__}.catalogue.hierarchies",
        "games": f"{__name__}.catalogue.games",
        "related": f"{__name__}.catalogue.related",
        "peers": f"{__name__}.catalogue.peers",
        "single-agent": f"{__name__}.catalogue.single_agent",
    },
)
"""Studies by name; what they offer is in `nested_agents.studies.catalogue.study`."""
