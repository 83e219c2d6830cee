"""Parser of GraphML, including the labels that yEd and Gephi write.

`networkx.read_graphml` would ignore further graphs of a file, the values 0 and 1 of the attribute
``directed`` of edges, repeated nodes, and unknown nodes of edges.
"""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from .names import quote

DIRECTIONS = {"directed": True, "undirected": False}
"""Values of ``edgedefault``."""
BOOLEANS = {"true": True, "1": True, "false": False, "0": False}
"""Values of ``directed`` of an edge, a Boolean of XML."""
GRAPH_PARTS = ("node", "edge", "desc", "data")


def node_link_table(text: str) -> dict[str, object]:
    """Return the graph of a file as a table in the format of `networkx.node_link_data`.

    Raises
    ------
    ValueError
        If the text is no XML, does not hold exactly one graph, or uses more than nodes and edges;
        one line.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(str(error)) from None
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]  # the namespaces of GraphML and of yEd
    graphs = list(root.iter("graph"))
    if root.tag != "graphml" or len(graphs) != 1:
        raise ValueError(f"{len(graphs)} elements <graph>, allowed: one, in <graphml>")
    default = graphs[0].get("edgedefault")
    if default not in DIRECTIONS:
        raise ValueError(f"edgedefault = {quote(default)}: must be 'directed' or 'undirected'")
    for part in graphs[0]:
        if part.tag not in GRAPH_PARTS:
            raise ValueError(f"element <{part.tag}> in <graph>, allowed: {', '.join(GRAPH_PARTS)}")
    label_keys = {
        key.get("id")
        for key in root.iter("key")
        if key.get("attr.name") == "label" and key.get("for") in ("node", "all")
    }
    edges: list[dict[str, object]] = []
    for edge in root.iter("edge"):
        if any(arrows.get("source", "none") != "none" for arrows in edge.iter("Arrows")):
            ends = f"{quote(edge.get('source'))} - {quote(edge.get('target'))}"
            raise ValueError(f"edge {ends}: has an arrowhead at its source, allowed: at its target")
        written = edge.get("directed", str(default == "directed").lower())
        edges.append({**edge.attrib, "directed": BOOLEANS.get(written, written)})
    nodes = [{**node.attrib, "label": _label(node, label_keys)} for node in root.iter("node")]
    return {"directed": DIRECTIONS[default], "nodes": nodes, "edges": edges}


def _label(node: Element, label_keys: set[str | None]) -> str | None:
    """Return the label of a node, as Gephi or yEd writes it; None if it has no label."""
    for data in node.iter("data"):
        if data.get("key") in label_keys:
            return data.text or ""
    for label in node.iter("NodeLabel"):
        return label.text or ""
    return None
