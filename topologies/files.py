"""Files that hold a hierarchy: GraphML, JSON and TOML."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import ParseError

from ..core.numerics import nx
from ..core.plugins import sources
from .builders import check_legible, quote

NUMBERED = re.compile(r"n?\d+")
"""Ids that a program gave to nodes, as yEd and Gephi do."""


def read_file(path: str) -> nx.Graph | dict[str, object]:
    """Read a graph or a ``[topology]`` table from GraphML, JSON or TOML, selected by suffix.

    JSON and TOML hold a table, alone or under the key ``topology``: of edges, ``{"edges": [["a",
    "b"], ...], "alone": [...]}``, of nested groups, ``{"members": [...]}``, or with the key
    ``kind``. A table with the key ``nodes`` is a graph as `networkx.node_link_data` writes it. The
    id of a node is the name of its agent. If all ids are numbers, with or without an ``n`` before
    them, and nodes have labels, the label is the name.

    Returns
    -------
    networkx.Graph or dict
        The graph, a `networkx.DiGraph` if it is directed; or the table.

    Raises
    ------
    ValueError
        If the file cannot be read or holds neither; one line.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in sources.GRAPHS:
        raise ValueError(f"{path}: suffix must be .graphml, .json or .toml")
    text = sources.active().text(path)
    try:
        if suffix == ".graphml":
            return _labeled(nx.parse_graphml(text))
        content = tomllib.loads(text) if suffix == ".toml" else json.loads(text)
        if isinstance(content, dict) and "nodes" in content:
            return _labeled(_node_link_graph(content))
        return _table_of(content)
    except RecursionError:
        raise ValueError(f"{path}: is nested too deeply") from None
    except (ValueError, ParseError, nx.NetworkXError) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None


def _node_link_graph(content: dict[str, object]) -> nx.Graph:
    """Return the graph of a table; ``links`` is the older name of ``edges``."""
    for key in ("directed", "multigraph"):
        if not isinstance(content.get(key, False), bool):
            raise ValueError(f"{key} = {quote(content[key])}: must be true or false")
    edges = "links" if "links" in content else "edges"
    try:
        return nx.node_link_graph(content, multigraph=False, edges=edges)
    except (KeyError, TypeError, AttributeError, ValueError):
        raise ValueError(
            f"must be as networkx.node_link_data writes it: nodes with id, {edges} with source "
            "and target"
        ) from None


def _labeled(graph: nx.Graph) -> nx.Graph:
    """Name nodes by their labels, if all ids are numbers and nodes have labels."""
    labels = dict(graph.nodes(data="label"))
    given = [label for label in labels.values() if label is not None]
    if not given or not all(NUMBERED.fullmatch(str(node)) for node in graph):
        check_legible(graph)
        return graph
    names = {node: str(label).strip() for node, label in labels.items()}
    for node, name in names.items():
        if labels[node] is None:
            raise ValueError(f"node {quote(node)} has no label, others have one")
        if list(names.values()).count(name) > 1:
            raise ValueError(f"label {quote(name)} is that of several nodes, allowed: one")
    check_legible(names.values())
    return nx.relabel_nodes(graph, names)


def _table_of(content: object) -> dict[str, object]:
    """Return the ``[topology]`` table that a file holds."""
    if isinstance(content, dict) and "topology" in content:
        others = [key for key in content if key != "topology"]
        if others:
            raise ValueError(f"key {quote(others[0])} beside topology, allowed: topology alone")
        content = content["topology"]
    if not isinstance(content, dict) or not {"kind", "members", "edges"} & content.keys():
        raise ValueError("it must be a table with one of the keys edges, members and kind")
    if content.get("kind") == "file":
        raise ValueError("kind = 'file': a file cannot name another one")
    check_legible(_texts([content.get(key) for key in ("members", "edges", "alone")]))
    return content


def _texts(content: object) -> Iterator[str]:
    """Yield the texts in lists, at any depth."""
    if isinstance(content, str):
        yield content
    for part in content if isinstance(content, list) else ():
        yield from _texts(part)
