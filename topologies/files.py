"""Reads hierarchies from files: GraphML, JSON and TOML."""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from ..core.numerics import nx
from ..core.plugins import sources
from .builders import check_legible, quote

NUMBERED = re.compile(r"n?\d+")
"""Ids that a program gave to nodes, as yEd and Gephi do."""


def read_file(path: str) -> nx.Graph | dict[str, object]:
    """Read a graph, or a topology as it stands in a spec, from GraphML, JSON or TOML by suffix.

    JSON and TOML hold a table, perhaps under ``topology``: of edges, ``{"edges": [["a", "b"], ...],
    "alone": [...]}``, of nested groups, ``{"members": [...]}``, or with the key ``kind``. JSON with
    the key ``nodes`` is a graph as `networkx.node_link_data` writes it. An agent is named by its
    node's id; if all ids are numbers, with or without an ``n`` before them, and nodes have labels,
    by its label.

    Returns
    -------
    networkx.Graph or dict
        The graph, or the table.

    Raises
    ------
    ValueError
        If the file cannot be read or holds neither.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in sources.GRAPHS:
        raise ValueError(f"{path}: suffix must be .graphml, .json or .toml")
    text = sources.active().text(path)
    try:
        if suffix == ".graphml":
            return _named_by_labels(nx.parse_graphml(text, node_type=_name))
        content = tomllib.loads(text) if suffix == ".toml" else json.loads(text)
        if isinstance(content, dict) and "nodes" in content:
            return _named_by_labels(_node_link_graph(content))
        return _table_of(content)
    except RecursionError:
        raise ValueError(f"{path} holds no graph: it is nested too deeply") from None
    except (
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        SyntaxError,
        nx.NetworkXException,
    ) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path} holds no graph: {reason}") from None


def _node_link_graph(content: dict[str, object]) -> nx.Graph:
    """Return the graph of nodes and links, or edges, that are tables."""
    links = "links" if "links" in content else "edges"
    for key, needed in (("nodes", {"id"}), (links, {"source", "target"})):
        parts = content.get(key)
        listed = parts if isinstance(parts, list) else [None]
        if not all(isinstance(part, dict) and part.keys() >= needed for part in listed):
            raise ValueError(f"{key} must be a list of tables with {' and '.join(sorted(needed))}")
    return nx.node_link_graph(content, edges=links)


def _named_by_labels(graph: nx.Graph) -> nx.Graph:
    """Return a graph whose nodes are named by their labels if their ids are only numbers."""
    labels = {node: data["label"] for node, data in graph.nodes(data=True) if "label" in data}
    if not labels or not all(NUMBERED.fullmatch(str(node)) for node in graph):
        check_legible(graph)
        return graph
    bare = [node for node in graph if node not in labels]
    if bare:
        raise ValueError(f"node {quote(bare[0])} has no label, others have one")
    names = {n: text.strip() if isinstance(text, str) else text for n, text in labels.items()}
    check_legible(names.values())
    for name, times in Counter(names.values()).items():
        if times > 1:
            raise ValueError(f"label {quote(name)} is that of {times} nodes")
    return nx.relabel_nodes(graph, names)


def _table_of(content: object) -> dict[str, object]:
    """Return the topology's table that a file holds."""
    if isinstance(content, dict) and isinstance(content.get("topology"), dict):
        content = content["topology"]
    if not isinstance(content, dict) or not {"kind", "members", "edges"} & content.keys():
        raise ValueError("it must be a table with one of the keys edges, members and kind")
    if content.get("kind") == "file":
        raise ValueError("kind = 'file': a file cannot name another one")
    check_legible(_names([content.get(key) for key in ("members", "edges", "alone")]))
    return content


def _names(content: object) -> Iterator[str]:
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
