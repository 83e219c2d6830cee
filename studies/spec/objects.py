"""Objects in a spec made by Python: put in the words that a TOML file would have for them."""

from collections.abc import Mapping
from pkgutil import resolve_name
from typing import Any

from ...core.decision.exploration import EXPLORATIONS
from ...core.evaluators import EVALUATORS
from ...core.interface.hierarchy import Hierarchy
from ...core.learners import LEARNERS
from ...core.numerics import nx
from ...core.plugins.registry import Registry
from ...core.plugins.settings import Settings
from ...scenarios import SCENARIOS
from ...topologies import TOPOLOGIES
from ..errors import SpecError, refused
from .studies import STUDIES

REGISTRIES: dict[str, Registry] = {
    "study": STUDIES,
    "scenario": SCENARIOS,
    "topology": TOPOLOGIES,
    "learner": LEARNERS,
    "exploration": EXPLORATIONS,
    "evaluator": EVALUATORS,
}
"""The registry of what stands at a key."""


def plain(value: Any, key: str = "") -> Any:
    """Return a table in which classes and functions are names, and their settings tables.

    Parameters
    ----------
    value
        A spec's table, or a part of it.
    key
        Where it stands, the last part of its dotted key.

    Raises
    ------
    SpecError
        If an object is defined in no file, so that no worker could ever find it.
    """
    if isinstance(value, Mapping):
        table = {k: plain(v, key if k == "kind" else str(k)) for k, v in value.items()}
        kind = table.get("kind")
        return table | kind if isinstance(kind, dict) else table
    if isinstance(value, list | tuple):
        return type(value)(plain(v, key) for v in value)
    registry = REGISTRIES.get(key.rpartition(".")[2])
    if isinstance(value, Settings):
        return _of_settings(value, registry)
    if isinstance(value, Hierarchy | nx.Graph):
        return _edges(value)
    if isinstance(getattr(value, "settings", None), Settings):  # of something that was built
        return _of_settings(value.settings, registry)
    if isinstance(value, type) or callable(value) or hasattr(value, "function"):
        name = _name(value, registry or Registry("state variable", {}))
        return {"kind": name} if key in ("scenario", "learner", "topology") else name
    return value


def _edges(graph: Hierarchy | nx.Graph) -> dict[str, Any]:
    """Return the table of the topology of just these agents and edges, or neighbours."""
    relations = {}
    if isinstance(graph, Hierarchy):
        if graph.edges and graph.neighbours:
            raise SpecError("topology: a hierarchy of edges and neighbours has no table in a spec")
        agents: list[str] = list(graph.agents)
        pairs = [(agents[a], agents[b]) for a, b in graph.edges or graph.neighbours]
        of_neighbours = bool(graph.neighbours)
        relations = {"told": graph.told, "considers": graph.considers}
    else:
        agents, pairs = list(map(str, graph)), [(str(a), str(b)) for a, b in graph.edges]
        of_neighbours = bool(pairs) and not graph.is_directed()
    if of_neighbours:
        return {"kind": "coordination-graph", "edges": tuple(pairs), **relations}
    joined = {name for pair in pairs for name in pair}
    alone = tuple(name for name in agents if name not in joined)
    return {"kind": "edges", "edges": tuple(pairs), "alone": alone, **relations}


def _of_settings(settings: Settings, registry: Registry | None) -> Any:
    """Return the table of settings; what is None leaves what lies below as it is."""
    table = settings.model_dump(exclude_none=True)
    if registry is not None and not table.get("kind"):
        owner = type(settings)
        outer = owner.__qualname__.rpartition(".")[0]
        # A class's nested Settings stand for the class.
        thing = resolve_name(f"{owner.__module__}:{outer}") if outer else owner
        table["kind"] = _name(thing, registry)
    return table


def _name(thing: Any, registry: Registry) -> str:
    with refused(f"{registry.kind}: "):
        return registry.reference_to(thing)
