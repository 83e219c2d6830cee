"""Hierarchies that users bring: graph files, Python files, installed packages.

A user's topology is a function ``(agents, groups) -> graph``. It is given the names of the agents
and the same names by group (robot), and returns a networkx DiGraph over all agents, or pairs
(superior, subordinate); an agent in no pair stands alone.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import json
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import networkx as nx

from .checks import with_edges

ENTRY_POINTS = "nested_agents.topologies"
"""The entry-point group under which installed packages offer topologies."""

UserTopology = Callable[..., Any]


def digest(path: str) -> str:
    """Return a short hash of a file's content, so that a study notices when it changes."""
    return hashlib.sha256(_read(path)).hexdigest()[:16]


def package_digest(name: str) -> str:
    """Return the `digest` of the file in which an installed package defines its topology.

    Empty for compiled functions, which have no such file.
    """
    function = inspect.unwrap(from_package(name))
    try:
        path = inspect.getsourcefile(function if inspect.isroutine(function) else type(function))
    except TypeError:
        path = None
    return digest(path) if path else ""


def read_graph(path: str) -> nx.DiGraph:
    """Read a graph from GraphML or JSON, told apart by suffix.

    JSON holds ``{"edges": [["a", "b"], ...], "alone": [...]}``, or networkx's node-link format.
    In GraphML an agent is named by its node's id.

    Raises
    ------
    ValueError
        If the file cannot be read or holds no graph.
    """
    text = _read(path)
    suffix = Path(path).suffix
    if suffix not in (".graphml", ".json"):
        raise ValueError(f"{path}: suffix must be .graphml or .json")
    try:
        if suffix == ".graphml":
            graph = nx.parse_graphml(text.decode())
        else:
            graph = _graph_of(json.loads(text))
    except (ValueError, KeyError, TypeError, SyntaxError, nx.NetworkXException) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path} holds no graph: {reason}") from None
    return graph


def from_python(source: str) -> UserTopology:
    """Return the function named by ``"path/to/file.py:function"``.

    Raises
    ------
    ValueError
        If there is no such file or function, or the file raises when it is read.
    """
    path, name = split_source(source)
    _read(path)
    spec = importlib.util.spec_from_file_location(f"_topology_{digest(path)}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their own module up
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[spec.name]
        raise ValueError(f"{path} cannot be run: {type(error).__name__}: {error}") from None
    function = getattr(module, name, None)
    if not callable(function):
        own = [n for n, f in vars(module).items() if getattr(f, "__module__", "") == spec.name]
        raise ValueError(f"{path} has no function {name!r}, it has: {', '.join(own) or 'none'}")
    return function


def split_source(source: str) -> tuple[str, str]:
    """Split ``"path/to/file.py:function"``.

    Examples
    --------
    >>> split_source("ring.py:ring")
    ('ring.py', 'ring')
    """
    path, colon, name = source.rpartition(":")
    if not (colon and path.endswith(".py") and name.isidentifier()):
        raise ValueError(f"{source!r} must be written path/to/file.py:function")
    return path, name


def installed() -> dict[str, str]:
    """Return the topologies that installed packages offer: their values by name.

    Raises
    ------
    ValueError
        If two packages offer one name.
    """
    found: dict[str, str] = {}
    for point in entry_points(group=ENTRY_POINTS):
        if found.setdefault(point.name, point.value) != point.value:
            raise ValueError(
                f"entry point {point.name!r} is offered twice: {found[point.name]}, {point.value}"
            )
    return found


def from_package(name: str) -> UserTopology:
    """Return the function that an installed package offers under `name`.

    Raises
    ------
    ValueError
        If none does, or importing it fails.
    """
    known = installed()
    if name not in known:
        raise ValueError(
            f"no installed package offers {name!r}, they offer: {', '.join(known) or 'none'}"
        )
    (point, *_) = entry_points(group=ENTRY_POINTS, name=name)
    try:
        function = point.load()
    except Exception as error:
        raise ValueError(
            f"entry point {name!r} cannot be loaded: {type(error).__name__}: {error}"
        ) from None
    if not callable(function):
        raise ValueError(f"entry point {name!r} ({point.value}) is no function")
    return function


def called(
    function: UserTopology, agents: Sequence[str], groups: Sequence[Sequence[str]]
) -> nx.DiGraph:
    """Return the graph that a user's function makes.

    Raises
    ------
    ValueError
        If it raises, returns neither a graph nor pairs, or not the same ones twice.
    """
    graph, again = (_returned(function, agents, groups) for _ in range(2))
    if set(graph.edges) != set(again.edges):
        name = getattr(function, "__name__", "the function")
        raise ValueError(
            f"{name} returned another hierarchy when called again; random numbers must be drawn "
            "from a seed of its own"
        )
    return graph


def _returned(
    function: UserTopology, agents: Sequence[str], groups: Sequence[Sequence[str]]
) -> nx.DiGraph:
    name = getattr(function, "__name__", "the function")
    try:
        result = function(tuple(agents), tuple(tuple(group) for group in groups))
    except Exception as error:
        raise ValueError(f"{name} raised {type(error).__name__}: {error}") from None
    if isinstance(result, nx.Graph):
        return result
    try:
        edges = [(str(superior), str(subordinate)) for superior, subordinate in result]
    except (TypeError, ValueError):
        raise ValueError(
            f"{name} returned {type(result).__name__}, allowed: a networkx DiGraph or pairs "
            "(superior, subordinate)"
        ) from None
    graph = nx.DiGraph()
    graph.add_nodes_from(agents)
    return with_edges(graph, edges)


def _graph_of(content: Any) -> nx.DiGraph:
    if not isinstance(content, dict):
        raise ValueError("it must be an object with the key edges")
    if "nodes" in content:
        key = "edges" if "edges" in content else "links"
        return nx.node_link_graph(content, directed=content.get("directed", True), edges=key)
    unknown = set(content) - {"edges", "alone"}
    if unknown or "edges" not in content:
        raise ValueError(f"its keys must be edges and alone, not {', '.join(content) or 'none'}")
    graph = nx.DiGraph()
    graph.add_nodes_from(content.get("alone", []))
    return with_edges(graph, content["edges"])


def _read(path: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}") from None
