"""Hierarchies in GraphML, JSON and TOML files."""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from ..core.numerics import nx
from ..core.plugins import sources
from ..core.plugins.words import closest, show
from .graphml import node_link_table
from .names import check_legible, quote

NUMBERED = re.compile(r"n?\d+")
"""Node ids that programs such as yEd and Gephi generate."""
NODE_LINK_KEYS = ("directed", "multigraph", "graph", "nodes", "edges", "links")
"""Keys that `networkx.node_link_data` writes; ``links`` is the older name of ``edges``."""


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
        parsers: dict[str, Callable[[str], object]] = {
            ".graphml": node_link_table,
            ".toml": tomllib.loads,
            ".json": _json,
        }
        content = parsers[suffix](text)
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
    """Return the graph of a table; refuse repeated nodes and edges and unknown ids."""
    for key in content:
        if key not in NODE_LINK_KEYS:
            raise ValueError(f"unknown key {quote(key)}: {closest(key, NODE_LINK_KEYS)}")
    if "links" in content and "edges" in content:
        raise ValueError("both edges and links are given, allowed: one of them")
    is_directed = _flag(content, "directed")
    if _flag(content, "multigraph"):
        raise ValueError("multigraph = true: must be false, an edge joins two agents once")
    nodes = _tables(content, "nodes", ("id",))
    ids = _distinct([node["id"] for node in nodes], "id")
    names = dict(zip(ids, _names_of(nodes, ids), strict=True))
    graph = nx.empty_graph(names.values(), create_using=nx.DiGraph if is_directed else nx.Graph)
    arrow = "->" if is_directed else "-"
    for table in _tables(content, "links" if "links" in content else "edges", ("source", "target")):
        check_legible([table["source"], table["target"]])
        source, target = str(table["source"]), str(table["target"])
        edge = f"edge {quote(source)} {arrow} {quote(target)}"
        if table.get("directed", is_directed) is not is_directed:
            raise ValueError(
                f"{edge} has directed = {show(table['directed'])}, the graph has "
                f"{show(is_directed)}: must be equal"
            )
        for end in (source, target):
            if end not in names:
                raise ValueError(f"{edge}: {closest(end, ids)}, allowed: ids of nodes")
        if source == target:
            raise ValueError(f"{edge} leads from an agent to itself")
        if graph.has_edge(names[source], names[target]):
            raise ValueError(f"{edge} is given more than once")
        graph.add_edge(names[source], names[target])
    return graph


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


def _names_of(nodes: list[dict[str, object]], ids: list[str]) -> list[str]:
    """Return the names of agents: labels if all ids are numbers and nodes have labels, else ids."""
    labels = [node.get("label") for node in nodes]
    if not any(label is not None for label in labels) or not all(map(NUMBERED.fullmatch, ids)):
        return ids
    if None in labels:
        name = quote(ids[labels.index(None)])
        raise ValueError(f"node {name} has no label, but other nodes have one")
    return _distinct([e.strip() if isinstance(e, str) else e for e in labels], "label")


def _distinct(values: list[object], what: str) -> list[str]:
    """Return ids or labels as text; refuse illegible and repeated ones."""
    check_legible(values)
    names = [str(value) for value in values]
    for name, times in Counter(names).items():
        if times > 1:
            raise ValueError(f"{what} {quote(name)} belongs to {times} nodes, allowed: one")
    return names


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
