"""Conversion of Python objects in a spec to the tables that a TOML file would hold."""

from __future__ import annotations

from collections.abc import Mapping
from pkgutil import resolve_name
from typing import Any

from ...core.hierarchy.hierarchy import Hierarchy
from ...core.learners import LEARNERS
from ...core.numerics import nx
from ...core.plugins.registry import Registry
from ...core.plugins.settings import Settings
from ...core.search import EVALUATORS
from ...core.search.exploration import EXPLORATIONS
from ...scenarios import SCENARIOS
from ...topologies import TOPOLOGIES
from ..errors import SpecError, refused
from .studies import STUDIES
from .tables import TomlTable

REGISTRIES: dict[str, Registry] = {
    "study": STUDIES,
    "scenario": SCENARIOS,
    "topology": TOPOLOGIES,
    "learner": LEARNERS,
    "exploration": EXPLORATIONS,
    "evaluator": EVALUATORS,
}
"""Registry of the objects that each key may name."""


def plain(value: Any, key: str = "") -> Any:
    """Return a table with names instead of classes and functions, and tables instead of settings.

    Parameters
    ----------
    value
        A spec's table, or a part of it.
    key
        Dotted key, or its last part, under which the value stands.

    Raises
    ------
    SpecError
        If an object is not defined in a file, so that workers cannot import it.
    """
    if isinstance(value, Mapping):
        table = {k: plain(v, key if k == "kind" else str(k)) for k, v in value.items()}
        kind = table.get("kind")
        return table | kind if isinstance(kind, dict) else table
    if isinstance(value, list | tuple):
        return type(value)(plain(v, key) for v in value)
    registry = REGISTRIES.get(key.rpartition(".")[2])
    if isinstance(value, Hierarchy | nx.Graph):
        return _edges(value)
    settings = getattr(value, "settings", value)  # a built object keeps its settings
    if isinstance(settings, Settings):
        return _settings_table(settings, registry)
    if isinstance(value, type) or callable(value) or hasattr(value, "function"):
        name = _name(value, registry or Registry("state variable", {}))
        return {"kind": name} if key in ("scenario", "learner", "topology") else name
    return value


def _edges(graph: Hierarchy | nx.Graph) -> dict[str, Any]:
    """Return the topology table of a graph: its edges or neighbors, and agents without any."""
    relations = {}
    if isinstance(graph, Hierarchy):
        if graph.edges and graph.neighbors:
            raise SpecError(
                "topology: a hierarchy with both edges and neighbors cannot be written in a spec"
            )
        agents: list[str] = list(graph.agents)
        pairs = [(agents[a], agents[b]) for a, b in graph.edges or graph.neighbors]
        has_neighbors = bool(graph.neighbors)
        relations = {"communication": graph.communication, "lookahead": graph.lookahead}
    else:
        agents = list(map(str, graph))
        pairs = [(str(a), str(b)) for a, b in graph.edges]
        has_neighbors = bool(pairs) and not graph.is_directed()
    if has_neighbors:
        return {"kind": "coordination-graph", "edges": tuple(pairs), **relations}
    joined = {name for pair in pairs for name in pair}
    alone = tuple(name for name in agents if name not in joined)
    return {"kind": "edges", "edges": tuple(pairs), "alone": alone, **relations}


def _settings_table(settings: Settings, registry: Registry | None) -> TomlTable:
    """Return the table of settings without values that are None."""
    table = settings.model_dump(exclude_none=True)
    if registry is not None and not table.get("kind"):
        owner = type(settings)
        outer = owner.__qualname__.rpartition(".")[0]
        # A class's nested Settings stand for the class.
        thing = resolve_name(f"{owner.__module__}:{outer}") if outer else owner
        table["kind"] = _name(thing, registry)
    return table


def _name(thing: object, registry: Registry) -> str:
    with refused(f"{registry.kind}: "):
        return registry.reference_to(thing)
