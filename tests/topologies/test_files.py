"""Files of graphs as editors and networkx write them."""

import json
from pathlib import Path

import networkx as nx
import pytest

from nested_agents.topologies import build, parse
from nested_agents.topologies.view import names_in

AGENTS = ("a", "b", "c", "d")

YED = """\
<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<graphml xmlns="http://graphml.graphdrawing.org/xmlns" xmlns:y="http://www.yworks.com/xml/graphml"
  xmlns:yed="http://www.yworks.com/xml/yed/3">
  <key attr.name="Description" attr.type="string" for="graph" id="d0"/>
  <key for="port" id="d1" yfiles.type="portgraphics"/>
  <key attr.name="description" attr.type="string" for="node" id="d5"/>
  <key for="node" id="d6" yfiles.type="nodegraphics"/>
  <key for="edge" id="d10" yfiles.type="edgegraphics"/>
  <graph edgedefault="directed" id="G">
    <data key="d0" xml:space="preserve"/>
    {nodes}
    <edge id="e0" source="n0" target="n1"><data key="d10"><y:PolyLineEdge>
      <y:LineStyle color="#000000" type="line" width="1.0"/></y:PolyLineEdge></data></edge>
    <edge id="e1" source="n0" target="n2"/>
  </graph>
</graphml>
"""
YED_NODE = """\
<node id="{id}"><data key="d5"/><data key="d6"><y:ShapeNode>
      <y:Geometry height="30.0" width="30.0" x="{x}" y="0.0"/><y:Fill color="#FFCC00"/>
      <y:NodeLabel alignment="center" fontSize="12">{label}<y:LabelModel/></y:NodeLabel>
      <y:Shape type="rectangle"/></y:ShapeNode></data></node>"""
GEPHI = """\
<?xml version="1.0" encoding="UTF-8"?>
<graphml xmlns="http://graphml.graphdrawing.org/xmlns">
<key attr.name="label" attr.type="string" for="node" id="label"/>
<key attr.name="Edge Label" attr.type="string" for="edge" id="edgelabel"/>
<key attr.name="weight" attr.type="double" for="edge" id="weight"/>
<key attr.name="size" attr.type="float" for="node" id="size"/>
<graph edgedefault="directed">
{nodes}
<edge id="0" source="{i}0" target="{i}1"><data key="weight">1.0</data></edge>
<edge id="1" source="{i}0" target="{i}2"><data key="weight">1.0</data></edge>
</graph>
</graphml>
"""
GEPHI_NODE = '<node id="{id}"><data key="label">{label}</data><data key="size">10.0</data></node>'


def yed(labels: tuple[str, ...] = AGENTS) -> str:
    """A graph as yEd writes it."""
    nodes = (YED_NODE.format(id=f"n{i}", x=40 * i, label=name) for i, name in enumerate(labels))
    return YED.format(nodes="\n".join(nodes))


def gephi(start: str, labels: tuple[str, ...] = AGENTS) -> str:
    """A graph as Gephi writes it, its ids beginning so."""
    nodes = (GEPHI_NODE.format(id=f"{start}{i}", label=name) for i, name in enumerate(labels))
    return GEPHI.format(nodes="\n".join(nodes), i=start)


def node_link(key: str) -> str:
    """A graph as networkx writes it, in its older and its newer form."""
    graph = nx.DiGraph([("a", "b"), ("a", "c")])
    graph.add_node("d")
    return json.dumps(nx.node_link_data(graph, edges=key))


FILES = {
    "yed.graphml": yed(),
    "spaces.graphml": yed(("a ", "\nb", "c", "d")),
    "gephi.graphml": gephi("n"),
    "numbers.graphml": gephi(""),
    "UPPER.GRAPHML": yed(),
    "upper.Json": node_link("edges"),
    "links.json": node_link("links"),
    "edges.json": node_link("edges"),
}


@pytest.mark.parametrize("name", FILES)
def test_it_is_read_as_its_program_wrote_it(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(FILES[name], encoding="utf-8")
    for text in (str(path), f"file:{path}"):
        hierarchy = build(parse(text), AGENTS)
        assert hierarchy.agents == AGENTS
        assert hierarchy.edges == ((0, 1), (0, 2))
    assert names_in(parse(str(path))) == AGENTS


def test_ids_that_are_names_stay_whatever_the_labels_are(tmp_path: Path) -> None:
    path = tmp_path / "ids.graphml"
    path.write_text(gephi("robot", ("the", "first", "of", "all")), encoding="utf-8")
    assert names_in(parse(str(path))) == ("robot0", "robot1", "robot2", "robot3")


def test_numbers_without_labels_are_names(tmp_path: Path) -> None:
    path = tmp_path / "bare.graphml"
    nx.write_graphml(nx.DiGraph([("n0", "n1")]), path)
    assert names_in(parse(str(path))) == ("n0", "n1")


def test_an_edge_may_repeat_the_direction_of_its_graph(tmp_path: Path) -> None:
    for value in ("true", "1"):
        path = tmp_path / f"{value}.graphml"
        path.write_text(graphml(EDGE.replace("/>", f' directed="{value}"/>')), encoding="utf-8")
        assert build(str(path), ("a", "b")).edges == ((0, 1),)


def test_an_undirected_node_link_graph_needs_an_orientation(tmp_path: Path) -> None:
    path = tmp_path / "line.json"
    path.write_text(json.dumps(nx.node_link_data(nx.path_graph(AGENTS), edges="edges")))
    with pytest.raises(ValueError, match=r"set topology\.decision_order"):
        build(str(path), AGENTS)
    listed = build({"kind": "file", "path": str(path), "decision_order": "listed"}, AGENTS)
    assert listed.edges == ((0, 1), (1, 2), (2, 3))


GRAPHML = (
    '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">'
    '<graph id="G" edgedefault="{default}"><node id="a"/><node id="b"/>{rest}</graph></graphml>'
)
EDGE = '<edge source="a" target="b"/>'


def graphml(rest: str, default: str = "directed") -> str:
    """A graph of two nodes, a and b."""
    return GRAPHML.format(default=default, rest=rest)


NODES = '{"directed": true, "nodes": [{"id": "a"}, {"id": "b"}], '
REFUSED = {
    "twice.graphml": (yed(("a", "b", "b", "d")), "label 'b' belongs to 2 nodes"),
    "some.graphml": (
        gephi("n").replace('<data key="label">c</data>', ""),
        "node 'n2' has no label, but other nodes have one",
    ),
    "empty.graphml": (yed(("a", "b", " ", "d")), "'' is no name of an agent"),
    "texts.json": ('{"nodes": ["a"], "links": []}', "nodes must be a list of tables with id"),
    "nodes.json": ('{"nodes": 3, "links": []}', "nodes must be a list of tables with id"),
    "bare.json": (NODES + '"links": [{"source": "a"}]}', "with source and target"),
    "none.json": (NODES + '"edges": null}', "edges must be a list of tables with source and"),
    "pairs.json": (NODES + '"edges": [["a", "b"]]}', "edges must be a list of tables with"),
    "id.json": ('{"nodes": [{"id": null}], "links": []}', "None is no name of an agent"),
    "repeated_node.json": (
        '{"nodes": [{"id": 1}, {"id": "1"}], "links": []}',
        "id '1' belongs to 2 nodes",
    ),
    "repeated_edge.json": (
        NODES + '"edges": [{"source": "a", "target": "b"}, {"source": "a", "target": "b"}]}',
        "edge 'a' -> 'b' is given more than once",
    ),
    "both_ways.json": (
        NODES.replace("true", "false")
        + '"edges": [{"source": "a", "target": "b"}, {"source": "b", "target": "a"}]}',
        "edge 'b' - 'a' is given more than once",
    ),
    "loop.json": (
        NODES + '"edges": [{"source": "a", "target": "a"}]}',
        "edge 'a' -> 'a' leads from an agent to itself",
    ),
    "stray.json": (
        NODES + '"edges": [{"source": "a", "target": "c"}]}',
        "edge 'a' -> 'c': known: a, b",
    ),
    "misspelled.json": (NODES + '"edgs": [], "edges": []}', "'edgs': did you mean 'edges'?"),
    "two_lists.json": (NODES + '"edges": [], "links": []}', "both edges and links are given"),
    "twice.json": (NODES + '"edges": [], "edges": []}', "key 'edges' is given 2 times"),
    "graph_direction.json": (
        NODES.replace("true", '"false"') + '"edges": []}',
        "directed = 'false': must be true or false",
    ),
    "number_direction.json": (NODES.replace("true", "1") + '"edges": []}', "directed = 1: must be"),
    "edge_direction.json": (
        NODES + '"edges": [{"source": "a", "target": "b", "directed": false}]}',
        "has directed = false, the graph has true",
    ),
    "multigraph.json": (NODES + '"multigraph": 0, "edges": []}', "multigraph = 0: must be true or"),
    "nodes.toml": ('nodes = [{id = "a"}]\nedges = []\ndirected = "yes"', "directed = 'yes'"),
    "beside.json": (
        '{"topology": {"edges": [["a", "b"]]}, "edges": [["b", "a"]]}',
        "unknown key 'edges', allowed: topology alone",
    ),
    "alone.json": (
        '{"edges": [["a", "b"]], "alone": ["b"]}',
        "agent 'b' occurs more than once in edges and alone",
    ),
    "zero.graphml": (
        graphml(EDGE.replace("/>", ' directed="0"/>')),
        "edge 'a' -> 'b' has directed = false, the graph has true",
    ),
    "false.graphml": (
        graphml(EDGE.replace("/>", ' directed="false"/>')),
        "directed = false, the graph has",
    ),
    "yes.graphml": (
        graphml(EDGE.replace("/>", ' directed="yes"/>')),
        "directed = 'yes', the graph has",
    ),
    "one.graphml": (
        graphml(EDGE.replace("/>", ' directed="1"/>'), default="undirected"),
        "edge 'a' - 'b' has directed = true, the graph has false",
    ),
    "default.graphml": (graphml(EDGE, default="Directed"), "edgedefault = 'Directed': must be"),
    "no_default.graphml": (
        graphml(EDGE).replace(' edgedefault="directed"', ""),
        "edgedefault = None: must be",
    ),
    "two.graphml": (
        graphml(EDGE).replace("</graphml>", '<graph edgedefault="directed"/></graphml>'),
        "2 elements <graph>, allowed: one",
    ),
    "nested.graphml": (
        graphml('<node id="c"><graph edgedefault="directed"/></node>'),
        "2 elements <graph>, allowed: one",
    ),
    "repeated_edge.graphml": (graphml(EDGE * 2), "edge 'a' -> 'b' is given more than once"),
    "repeated_node.graphml": (graphml('<node id="b"/>'), "id 'b' belongs to 2 nodes"),
    "loop.graphml": (graphml(EDGE.replace("b", "a")), "leads from an agent to itself"),
    "stray.graphml": (graphml(EDGE.replace('"b"', '"c"')), "edge 'a' -> 'c': known: a, b"),
    "hyperedge.graphml": (graphml("<hyperedge/>"), "element <hyperedge> in <graph>"),
    "arrow.graphml": (
        yed().replace(
            '<y:LineStyle color="#000000"',
            '<y:Arrows source="standard" target="none"/><y:LineStyle color="#000000"',
        ),
        "has an arrowhead at its source",
    ),
    "twin.json": (
        NODES.replace("{", '{"multigraph": true, ', 1)
        + '"links": [{"source": "a", "target": "b"}]}',
        "multigraph = true: must be false",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_names_no_agents_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    content, problem = REFUSED[name]
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ValueError, match=r".") as refusal:
        build(str(path), ("a", "b"))
    assert problem in str(refusal.value)
    assert name in str(refusal.value)
    assert "\n" not in str(refusal.value)
