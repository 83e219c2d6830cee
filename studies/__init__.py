"""What is measured: specs, trials, store, statistics and reports."""

STUDIES: dict[str, str] = {
    "learning-curve": "learning_curve",
    "chain-order": "chain_order",
    "ablation": "ablation",
    "shapes": "shapes",
    "wheel-failure": "wheel_failure",
    "scaling": "scaling",
}
"""The module of every study by name; see `nested_agents.studies.study`."""
