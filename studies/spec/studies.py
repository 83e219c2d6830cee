"""The studies of the catalogue by name; others by where they are."""

from ...core.plugins.registry import Registry

NAMES = ("learning-curve", "ablation", "wheel-failure", "scaling", "hierarchies", "experience")
MOVED = {
    "chain-order": "chain_order.py:ChainOrderStudy",
    "shapes": "shapes.py:ShapesStudy",
    "edges": "edges.py:EdgesStudy",
    "fit": "fit.py:FitStudy",
    "signals": "signals.py:SignalsStudy",
    "games": "games.py:GamesStudy",
    "related": "related.py:RelatedStudy",
    "peers": "peers.py:PeersStudy",
}
"""Studies of the repository that are not installed: file and class, in its folder
``research/studies``."""
STUDIES = Registry(
    "study",
    {name: f"nested_agents.studies.catalogue.{name.replace('-', '_')}" for name in NAMES},
    {
        name: f"moved to research/studies/{place} of the repository; name this file in the spec, "
        f"or one of: {', '.join(NAMES)}"
        for name, place in MOVED.items()
    },
)
"""Studies by name; their attributes are those of `nested_agents.studies.catalogue.study.Study`."""
