"""Hierarchies in GraphML, JSON and TOML files."""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from ..core.numerics import nx
from ..core.plugins import sources
from ..core.plugins.words import closest, show
from . import graphml
from .builders import check_legible, quote

NUMBERED = re.compile(r"n?\d+")
"""Node ids that programs such as yEd and Gephi generate."""
NODE_LINK_KEYS = ("directed", "multigraph", "graph", "nodes", "edges", "links")
"""Keys that `networkx.node_link_data` writes; ``links`` is the older name of ``edges``."""


class Node(NamedTuple):
    """A node of a file."""

    id: object
    label: object = None


def read_file(path: str) -> nx.Graph | dict[str, object]:
    """Read a graph or a ``[topology]`` table from GraphML, JSON or TOML, selected by suffix.

    JSON and TOML files hold a table, alone or under the key ``topology``: with edges, ``{"edges":
    [["a", "b"], ...], "alone": [...]}``, with nested groups, ``{"members": [...]}``, or with the
    key ``kind``. A table with the key ``nodes`` is a graph in the format of
    `networkx.node_link_data`. The id of a node is the name of its agent. If all ids are numbers,
    such as ``3`` or ``n3``, and nodes have labels, the label is the name.

    Returns
    -------
    networkx.Graph or dict
        The graph, a `networkx.DiGraph` if it is directed; or the table.

    Raises
    ------
    ValueError
        If the file cannot be read, holds neither, or is inconsistent; one line.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in sources.GRAPHS:
        raise ValueError(f"{path}: suffix must be .graphml, .json or .toml")
    text = sources.active().text(path)
    try:
        if suffix == ".graphml":
            nodes, edges, is_directed = graphml.parse(text)
            return _graph([Node(*node) for node in nodes], edges, is_directed)
        content = tomllib.loads(text) if suffix == ".toml" else _json(text)
        if isinstance(content, dict) and "nodes" in content:
            return _node_link_graph(content)
        return _table_of(content)
    except RecursionError:
        raise ValueError(f"{path}: is nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None


def _json(text: str) -> object:
    """Return the content of a JSON file; refuse objects with repeated keys."""

    def table(pairs: list[tuple[str, object]]) -> dict[str, object]:
        for key, times in Counter(key for key, _ in pairs).items():
            if times > 1:
                raise ValueError(f"key {quote(key)} is given {times} times, allowed: once")
        return dict(pairs)

    return json.loads(text, object_pairs_hook=table)


def _node_link_graph(content: dict[str, object]) -> nx.Graph:
    """Return the graph of a table in the format of `networkx.node_link_data`."""
    for key in content:
        if key not in NODE_LINK_KEYS:
            raise ValueError(f"unknown key {quote(key)}: {closest(key, NODE_LINK_KEYS)}")
    if "links" in content and "edges" in content:
        raise ValueError("both edges and links are given, allowed: one of them")
    is_directed = _flag(content, "directed")
    if _flag(content, "multigraph"):
        raise ValueError("multigraph = true: must be false, an edge joins two agents once")
    links = "links" if "links" in content else "edges"
    nodes = _tables(content, "nodes", ("id",))
    edges = _tables(content, links, ("source", "target"))
    for edge in edges:
        if edge.get("directed", is_directed) is not is_directed:
            raise ValueError(
                f"edge {quote(edge['source'])} - {quote(edge['target'])} has directed = "
                f"{show(edge['directed'])}, the graph has {show(is_directed)}: must be equal"
            )
    return _graph(
        [Node(node["id"], node.get("label")) for node in nodes],
        [(edge["source"], edge["target"]) for edge in edges],
        is_directed,
    )


def _flag(content: dict[str, object], key: str) -> bool:
    """Return a flag of a table; False if it is absent."""
    value = content.get(key, False)
    if not isinstance(value, bool):
        raise ValueError(f"{key} = {quote(value)}: must be true or false, without quotes")
    return value


def _tables(
    content: dict[str, object], key: str, needed: tuple[str, ...]
) -> list[dict[str, object]]:
    """Return a list of tables, each with the `needed` keys."""
    listed = content.get(key)
    if not isinstance(listed, list) or not all(
        isinstance(part, dict) and part.keys() >= set(needed) for part in listed
    ):
        raise ValueError(f"{key} must be a list of tables with {' and '.join(needed)}")
    return listed


def _graph(
    nodes: list[Node], edges: Iterable[tuple[object, object]], is_directed: bool
) -> nx.Graph:
    """Return the graph of nodes and edges; refuse repeated nodes and edges and unknown ids."""
    check_legible(node.id for node in nodes)
    ids = [str(node.id) for node in nodes]
    _refuse_repeated(ids, "id")
    names = dict(zip(ids, _names_of(nodes), strict=True))
    graph = nx.empty_graph(names.values(), create_using=nx.DiGraph if is_directed else nx.Graph)
    arrow = "->" if is_directed else "-"
    for pair in edges:
        check_legible(pair)
        source, target = map(str, pair)
        edge = f"edge {quote(source)} {arrow} {quote(target)}"
        for end in (source, target):
            if end not in names:
                raise ValueError(f"{edge}: {closest(end, ids)}, allowed: ids of nodes")
        if source == target:
            raise ValueError(f"{edge} leads from an agent to itself")
        if graph.has_edge(names[source], names[target]):
            raise ValueError(f"{edge} is given more than once")
        graph.add_edge(names[source], names[target])
    return graph


def _names_of(nodes: list[Node]) -> list[str]:
    """Return the names of agents: labels if all ids are numbers and nodes have labels, else ids."""
    labeled = [node for node in nodes if node.label is not None]
    if not labeled or not all(NUMBERED.fullmatch(str(node.id)) for node in nodes):
        return [str(node.id) for node in nodes]
    for node in nodes:
        if node.label is None:
            raise ValueError(f"node {quote(node.id)} has no label, but other nodes have one")
    labels = [n.label.strip() if isinstance(n.label, str) else n.label for n in nodes]
    check_legible(labels)
    names = [str(label) for label in labels]
    _refuse_repeated(names, "label")
    return names


def _refuse_repeated(names: list[str], what: str) -> None:
    for name, times in Counter(names).items():
        if times > 1:
            raise ValueError(f"{what} {quote(name)} belongs to {times} nodes, allowed: one")


def _table_of(content: object) -> dict[str, object]:
    """Return the ``[topology]`` table that a file holds."""
    if isinstance(content, dict) and "topology" in content:
        others = [key for key in content if key != "topology"]
        if others:
            raise ValueError(f"unknown key {quote(others[0])}, allowed: topology alone")
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
