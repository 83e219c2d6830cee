"""What is measured: specs, trials, store, statistics and reports."""

STUDIES: dict[str, str] = {
    "learning-curve": ".catalogue.learning_curve",
    "chain-order": ".catalogue.chain_order",
    "ablation": ".catalogue.ablation",
    "shapes": ".catalogue.shapes",
    "wheel-failure": ".catalogue.wheel_failure",
    "scaling": ".catalogue.scaling",
}
"""The module of every study by name; see `nested_agents.studies.catalogue.study`."""
