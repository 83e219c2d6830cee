"""Hierarchies that users bring: files of graphs and teams, Python files, installed packages.

A user's topology is a function ``(agents, bodies) -> graph``. It is given the names of the agents
and the same names by body (robot), and returns a networkx DiGraph over all agents, or pairs
(superior, subordinate); an agent in no pair stands alone.
"""

from __future__ import annotations

import json
import tomllib
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator
from inspect import iscoroutine
from itertools import islice
from pathlib import Path
from typing import Any

from ..core.plugins import registry, sources
from ..core.plugins.deferred import nx
from .builders import Bodies, Names, independent
from .checks import check_legible, with_edges


def read(path: str) -> nx.DiGraph | dict[str, Any]:
    """Read a graph, or a topology as it stands in a spec, from GraphML, JSON or TOML by suffix.

    JSON and TOML hold a table, perhaps under ``topology``: of edges, ``{"edges": [["a", "b"], ...],
    "alone": [...]}``, of nested teams, ``{"members": [...]}``, or with the key ``kind``. In GraphML
    an agent is named by its node's id.

    Returns
    -------
    networkx.DiGraph or dict
        The graph, or the table.

    Raises
    ------
    ValueError
        If the file cannot be read or holds neither.
    """
    suffix = Path(path).suffix
    if suffix not in sources.GRAPHS:
        raise ValueError(f"{path}: suffix must be .graphml, .json or .toml")
    text = sources.active().text(path)
    try:
        if suffix == ".graphml":
            graph = nx.parse_graphml(text, node_type=_name)
            check_legible(graph)
            return graph
        return _table_of(tomllib.loads(text) if suffix == ".toml" else json.loads(text))
    except RecursionError:
        raise ValueError(f"{path} holds no graph: it is nested too deeply") from None
    except (
        ValueError, KeyError, TypeError, AttributeError, SyntaxError, nx.NetworkXException
    ) as error:  # fmt: skip
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path} holds no graph: {reason}") from None


def call(build: Callable[..., Any], name: str, agents: Names, bodies: Bodies) -> nx.Graph:
    """Return the graph that a user's function of this name makes.

    Raises
    ------
    ValueError
        If it raises, returns neither a graph nor pairs, or not the same ones twice.
    """
    graph, again = (_called(build, name, agents, bodies) for _ in range(2))
    if set(graph.edges) != set(again.edges):
        raise ValueError(
            f"{name} returned another hierarchy when called again; random numbers must be drawn "
            "from a seed of its own"
        )
    return graph


def _called(build: Callable[..., Any], name: str, agents: Names, bodies: Bodies) -> nx.Graph:
    most = len(agents) ** 2
    try:
        result = build(tuple(agents), tuple(tuple(body) for body in bodies))
        if isinstance(result, nx.Graph):
            list(map(str, result))  # an object of the user's may refuse to
            return result
        edges = _pairs(result, most)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        ours = {__file__, registry.__file__}
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename not in ours]
        # Of the user's file, whatever library it has called.
        lines = [f.lineno for f in frames if f.filename == frames[0].filename]
        where = f" in line {lines[-1]}" if lines else ""
        raise ValueError(
            f"{name} raised {type(error).__name__}{where}, given {len(agents)} agents of "
            f"{len(bodies)} bodies: {sources.message(error)}"
        ) from None
    if edges is None:
        raise ValueError(
            f"{name} returned {type(result).__name__}, allowed: a networkx DiGraph, a Graph "
            "of neighbours, or a list of nothing but pairs (superior, subordinate)"
        )
    if len(edges) > most:
        raise ValueError(f"{name} gave more than {most} pairs of {len(agents)} agents")
    return with_edges(independent(agents), edges)


def _pairs(result: Any, most: int) -> list[tuple[str, str]] | None:
    """Return pairs of names, one more than `most` at most; None if it holds something else."""
    if not isinstance(result, Iterable):
        if iscoroutine(result):
            result.close()  # or Python says that nobody has awaited it
        return None
    pairs = list(islice(result, most + 1))
    if not all(isinstance(pair, Collection) and len(pair) == 2 for pair in pairs):
        return None
    return [(str(superior), str(subordinate)) for superior, subordinate in pairs]


def _table_of(content: Any) -> dict[str, Any]:
    """Return the topology's table that a file holds."""
    if isinstance(content, dict) and isinstance(content.get("topology"), dict):
        content = content["topology"]
    if not isinstance(content, dict) or not {"kind", "members", "edges"} & content.keys():
        raise ValueError("it must be a table with one of the keys edges, members and kind")
    if content.get("kind") == "file":
        raise ValueError("kind = 'file': a file cannot name another one")
    check_legible(_names([content.get(key) for key in ("members", "edges", "alone")]))
    return content


def _names(content: Any) -> Iterator[str]:
    """Yield the texts in lists, at any depth."""
    if isinstance(content, str):
        yield content
    for part in content if isinstance(content, list) else ():
        yield from _names(part)


def _name(text: str | None) -> str:
    """Return what GraphML calls an agent; networkx would call it None if there is nothing."""
    if text is None:
        raise ValueError("a node has no id, or an edge no source or target")
    return text
