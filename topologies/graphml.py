"""Parser of GraphML, including the labels that yEd and Gephi write.

`networkx.read_graphml` would ignore further graphs of a file, the values 0 and 1 of the attribute
``directed`` of edges, repeated nodes, and unknown nodes of edges.
"""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from .builders import quote

DIRECTED = {"directed": True, "undirected": False}
"""Values of ``edgedefault``."""
BOOLEANS = {"true": True, "1": True, "false": False, "0": False}
"""Values of ``directed`` of an edge, a Boolean of XML."""
GRAPH_PARTS = ("node", "edge", "desc", "data")
EDGE_ATTRIBUTES = ("id", "source", "target", "directed", "sourceport", "targetport")
YED = "{http://www.yworks.com/xml/graphml}"

Edge = tuple[str, str]


def parse(text: str) -> tuple[list[tuple[str, str | None]], list[Edge], bool]:
    """Return nodes as pairs (id, label or None), edges as pairs of ids, and whether directed.

    Raises
    ------
    ValueError
        If the text is no XML, does not hold exactly one graph, or is inconsistent; one line.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(str(error)) from None
    namespace, name = root.tag[: root.tag.rfind("}") + 1], root.tag.rpartition("}")[2]
    graph = root.find(f"{namespace}graph")
    if name != "graphml" or graph is None:
        raise ValueError("no element <graph> in <graphml>")
    count = len(list(root.iter(f"{namespace}graph")))
    if count > 1:
        raise ValueError(f"{count} elements <graph>, allowed: one, and no graph within a node")
    default = graph.get("edgedefault")
    if default not in DIRECTED:
        raise ValueError(f"edgedefault = {quote(default)}: must be 'directed' or 'undirected'")
    for part in graph:
        if part.tag.removeprefix(namespace) not in GRAPH_PARTS:
            tag = part.tag.removeprefix(namespace)
            raise ValueError(f"element <{tag}> in <graph>, allowed: {', '.join(GRAPH_PARTS)}")
    label_keys = {
        key.get("id")
        for key in root.iter(f"{namespace}key")
        if key.get("attr.name") == "label" and key.get("for") in ("node", "all")
    }
    nodes = [
        (_attribute(node, "id"), _label(node, namespace, label_keys))
        for node in graph.iter(f"{namespace}node")
    ]
    edges = [_edge(edge, default) for edge in graph.iter(f"{namespace}edge")]
    return nodes, edges, DIRECTED[default]


def _attribute(element: Element, name: str) -> str:
    """Return an attribute that an element must have."""
    value = element.get(name)
    if value is None:
        raise ValueError("a node has no id, or an edge no source or target")
    return value


def _edge(element: Element, default: str) -> Edge:
    """Return the ids of the two nodes of an edge; refuse another direction than `default`."""
    ends = _attribute(element, "source"), _attribute(element, "target")
    edge = f"edge {quote(ends[0])} - {quote(ends[1])}"
    for name in element.keys():  # noqa: SIM118 an element iterates over its children
        if not name.startswith("{") and name not in EDGE_ATTRIBUTES:
            allowed = ", ".join(EDGE_ATTRIBUTES)
            raise ValueError(f"{edge}: unknown attribute {quote(name)}, allowed: {allowed}")
    written = element.get("directed")
    if written is not None and BOOLEANS.get(written) is not DIRECTED[default]:
        raise ValueError(
            f"{edge}: directed = {quote(written)} in a graph with edgedefault = {default!r}, "
            f"allowed: {str(DIRECTED[default]).lower()!r}"
        )
    for arrows in element.iter(f"{YED}Arrows"):
        if arrows.get("source", "none") != "none":
            raise ValueError(f"{edge}: has an arrowhead at its source, allowed: at its target")
    return ends


def _label(node: Element, namespace: str, label_keys: set[str | None]) -> str | None:
    """Return the label of a node, as Gephi or yEd writes it; None if it has no label."""
    for data in node.iter(f"{namespace}data"):
        if data.get("key") in label_keys:
            return data.text or ""
    for label in node.iter(f"{YED}NodeLabel"):
        return label.text or ""
    return None
