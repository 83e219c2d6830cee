"""Builders, spec strings, tables and every refusal."""

import tomllib
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.topologies import (
    TOPOLOGIES,
    Topology,
    build,
    builders,
    from_networkx,
    parse,
)

AGENTS = ("a", "b", "c", "d")
ROBOTS = ((0, 1), (2, 3))
ADAPTER = TypeAdapter(Topology)


def edges(text: str, agents=AGENTS, bodies=ROBOTS) -> set[str]:
    """The edges that a string makes, as ``{"ab", ...}``."""
    hierarchy = build(parse(text), agents, bodies)
    return {hierarchy.agents[a] + hierarchy.agents[b] for a, b in hierarchy.edges}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("chain", {"ab", "bc", "cd"}),
        ("chain:reversed", {"dc", "cb", "ba"}),
        ("chain:interleaved", {"ac", "cb", "bd"}),
        ("chain:c,a,d,b", {"ca", "ad", "db"}),
        ("tree", {"ab", "ac", "bd"}),
        ("tree:3", {"ab", "ac", "ad"}),
        ("tree:1", {"ab", "bc", "cd"}),
        ("star", {"ab", "ac", "ad"}),
        ("star:c", {"ca", "cb", "cd"}),
        ("teams", {"ab", "ac", "cd"}),
        ("teams:star", {"ab", "ac", "cd"}),
        ("independent", set()),
        ("edges:a>b,a>c,d", {"ab", "ac"}),
    ],
)
def test_a_string_makes_these_edges(text: str, expected: set[str]) -> None:
    assert edges(text) == expected


def test_teams_nest_to_any_depth() -> None:
    table = {"kind": "teams", "members": [[["a", "b"], ["c"]], [["d", "e"], "f"]]}
    hierarchy = build(ADAPTER.validate_python(table), tuple("abcdef"))
    named = {"".join(hierarchy.agents[i] for i in edge) for edge in hierarchy.edges}
    # a leads everything, c follows a within the first team, d leads the second one.
    assert named == {"ab", "ac", "ad", "de", "df"}
    star = build(ADAPTER.validate_python({**table, "link": "star"}), tuple("abcdef"))
    assert star.edges == hierarchy.edges


def test_a_random_hierarchy_follows_from_its_seed() -> None:
    assert edges("random:5") == edges("random:5")
    assert any(edges("random:5") != edges(f"random:{seed}") for seed in range(5))
    dense = ADAPTER.validate_python({"kind": "random", "density": 1.0})
    assert build(dense, AGENTS).depth == 4


@given(n=st.integers(1, 12), seed=st.integers(0, 1000), density=st.floats(0, 1))
def test_every_random_graph_is_a_hierarchy(n: int, seed: int, density: float) -> None:
    agents = [f"agent{i}" for i in range(n)]
    hierarchy = Hierarchy(
        agents, builders.random_hierarchy(agents, seed=seed, density=density).edges
    )
    assert sorted(hierarchy.order) == list(range(n))


REFUSED = {
    "chain:a,b,c": "topology 'chain': agent 'd' is missing from order",
    "chain:a,b,c,c": "topology 'chain': agent 'c' occurs more than once in order",
    "chain:a,b,c,x": "topology 'chain': unknown agent 'x' in order, known: a, b, c, d",
    "chain:": "topology 'chain:': order must be written a,b,c, received ''",
    "chain:a,,b": "topology 'chain:a,,b': order must be written a,b,c, received 'a,,b'",
    "tree:0": "topology 'tree:0': branching = 0: must be at least 1",
    "tree:two": "topology 'tree:two': branching = 'two': must be a whole number",
    "star:x": "topology 'star': unknown agent 'x' in leader, known: a, b, c, d",
    "teams:ring": "topology 'teams:ring': link = 'ring': must be 'chain' or 'star'",
    "independent:2": "topology 'independent:2': takes no argument, received '2'",
    "edges": "topology 'edges': edges: missing",
    "edges:a>b": "topology 'edges': agent 'c' is missing from edges and alone",
    "edges:a>x,b,c,d": "topology 'edges': unknown agent 'x' in edges and alone, known: a",
    "edges:a>b,a>b,c,d": "topology 'edges': edge a -> b is given more than once",
    "edges:a>a,b,c,d": "topology 'edges': agent 'a' cannot be its own superior",
    "edges:a>b,b>c,c>a,d": "topology 'edges': cycle a -> b -> c -> a",
    "edges:a>b>c,d": "topology 'edges:a>b>c,d': an edge must be written a>b, received 'a>b>c'",
    "random:-1": "topology 'random:-1': seed = -1: must be at least 0",
    "nothing.json": "topology 'nothing.json': No such file or directory",
    "file:x.csv": "topology 'x.csv': suffix must be .graphml, .json or .toml",
    "nothing.py:f": "topology 'nothing.py:f': nothing.py: No such file or directory",
    "chian": "topology 'chian': did you mean 'chain'? known: chain, coordination-graph, edges,",
    "": "topology '': known: chain,",
    "single-agent": "topology 'single-agent': who the agents are has a key of its own: "
    "agents = 'team'",
    "per-robot": "topology 'per-robot': who the agents are has a key of its own: agents = 'body', "
    "topology = 'chain'",
}


@pytest.mark.parametrize(("text", "message"), REFUSED.items())
def test_a_refusal_is_one_line_that_names_the_culprit(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=r".") as refusal:
        build(parse(text), AGENTS, ROBOTS)
    assert str(refusal.value).startswith(message)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "teams", "members": [["a", "b"], ["c"]]}, "agent 'd' is missing from members"),
        ({"kind": "teams", "members": [["a", "b"], ["c", "d", "a"]]}, "agent 'a' occurs more than"),
        ({"kind": "teams", "members": [["a", "b"], [], ["c", "d"]]}, "a group has no members"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(table: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build(ADAPTER.validate_python(table), AGENTS)


@pytest.mark.parametrize("table", [{"kind": "ring"}, {"kind": "tree", "depth": 2}, {}, 3])
def test_a_table_of_another_shape_is_refused(table: object) -> None:
    with pytest.raises(ValidationError):
        ADAPTER.validate_python(table)


def test_settings_survive_json_and_strict_tables() -> None:
    for text in ("chain:b,a,c,d", "tree:3", "teams:star", "edges:a>b,c,d", "random:7", "star:c"):
        settings = parse(text)
        assert ADAPTER.validate_json(settings.model_dump_json()) == settings
        assert ADAPTER.validate_python(settings.model_dump(), strict=True) == settings
        assert ADAPTER.validate_python(text) == settings


def test_every_kind_has_settings() -> None:
    for kind in TOPOLOGIES.built_in:
        assert TOPOLOGIES.model(kind).model_fields["kind"].default == kind


def test_toml() -> None:
    table = tomllib.loads('kind = "edges"\nedges = [["a", "b"]]\nalone = ["c", "d"]')
    assert build(ADAPTER.validate_python(table), AGENTS).edges == ((0, 1),)


def test_from_networkx() -> None:
    graph = nx.DiGraph([(0, 1), (0, 2)])
    assert set(from_networkx(graph, ("0", "1", "2")).edges) == {("0", "1"), ("0", "2")}
    with pytest.raises(ValueError, match="agent '3' is missing from the graph"):
        from_networkx(graph, ("0", "1", "2", "3"))
    with pytest.raises(ValueError, match="undirected"):
        from_networkx(nx.Graph(graph), ("0", "1", "2"))
    with pytest.raises(ValueError, match="multigraph"):
        from_networkx(nx.MultiDiGraph(graph), ("0", "1", "2"))
    with pytest.raises(ValueError, match="agent '0' occurs more than once"):
        from_networkx(nx.DiGraph([(0, "0")]), ("0",))


def test_a_graph_with_a_cycle_is_refused() -> None:
    graph = nx.DiGraph([("a", "b"), ("c", "d"), ("b", "a")])
    with pytest.raises(ValueError, match=r"^hierarchy: cycle a -> b -> a$"):
        from_networkx(graph, AGENTS)
    with pytest.raises(ValueError, match=r"^hierarchy: agent '1' cannot be its own superior$"):
        from_networkx(nx.DiGraph([(0, 1), (1, 1)]), ("0", "1"))


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        ([["a"], ["b"], ["c"], ["d"]], "must be groups of agent indices, 0 to 3"),
        ([(0, 1), (2, 9)], "must be groups of agent indices, 0 to 3"),
        ([(0, 1), (2, -1)], "must be groups of agent indices, 0 to 3"),
        ([0, 1, 2, 3], "must be groups of agent indices, 0 to 3"),
        (["ab", "cd"], "must be groups of agent indices, 0 to 3"),
        ([(0, 1), (1, 2, 3)], "agent 'b' occurs more than once in bodies"),
        ([(0, 1), (2,)], "agent 'd' is missing from bodies"),
    ],
)
@pytest.mark.parametrize("text", ["tree:2", "chain:interleaved", "teams"])
def test_groups_that_are_not_the_agents_indices_are_refused(
    text: str, bodies: list, message: str
) -> None:
    with pytest.raises(ValueError, match=r".") as refusal:
        build(parse(text), AGENTS, bodies)
    assert str(refusal.value).startswith(f"topology {text.partition(':')[0]!r}: ")
    assert str(refusal.value).endswith(message)


def test_groups_may_be_arrays() -> None:
    bodies = list(np.arange(4).reshape(2, 2))
    assert (
        build(parse("teams"), AGENTS, bodies).edges == build(parse("teams"), AGENTS, ROBOTS).edges
    )


@pytest.mark.parametrize("text", ["star", "teams", "chain"])
def test_no_agents_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=f"^topology '{text}': no agents$"):
        build(parse(text), ())


def graph_files(folder: Path) -> dict[str, Path]:
    graph = nx.DiGraph([("a", "b"), ("a", "c")])
    graph.add_node("d")
    paths = {name: folder / name for name in ("g.graphml", "pairs.json")}
    nx.write_graphml(graph, paths["g.graphml"])
    paths["pairs.json"].write_text('{"edges": [["a", "b"], ["a", "c"]], "alone": ["d"]}')
    return paths


@pytest.mark.parametrize("name", ["g.graphml", "pairs.json"])
def test_graph_files(tmp_path: Path, name: str) -> None:
    path = graph_files(tmp_path)[name]
    assert edges(str(path)) == edges(f"file:{path}") == {"ab", "ac"}


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("x.json", "{", "x.json': Expecting"),
        ("x.json", "[]", "x.json': it must be a table"),
        (
            "x.json",
            '{"edges": [], "names": []}',
            "names = .*: unknown key for kind 'edges'; known: alone, ",
        ),
        ("x.json", '{"edges": [["a", "b"], ["a", "b"]]}', "edge a -> b is given more than once"),
        ("x.json", '{"edges": [["a"]]}', "edges.0.: missing"),
        ("x.graphml", "nothing", "x.graphml': syntax error"),
        ("x.csv", "a,b", "suffix must be .graphml, .json or .toml"),
    ],
)
def test_a_file_without_a_graph_is_refused(
    tmp_path: Path, name: str, content: str, message: str
) -> None:
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(ValueError, match=message) as refusal:
        build(parse(f"file:{path}"), AGENTS)
    assert "\n" not in str(refusal.value)


RING = {"kind": "coordination-graph", "shape": "ring", "decision_order": "listed"}


def test_undirected_edges_follow_the_decision_order() -> None:
    ring = (*AGENTS, "e")
    cycle = build(RING, ring)
    assert cycle.edges == ((0, 1), (0, 4), (1, 2), (2, 3), (3, 4))
    assert (cycle.neighbors, cycle.order) == ((), (0, 1, 2, 3, 4))
    assert build({**RING, "decision_order": "reversed"}, ring).edges == (
        (1, 0), (2, 1), (3, 2), (4, 0), (4, 3),
    )  # fmt: skip
    assert build({**RING, "decision_order": ["c", "a", "b", "d", "e"]}, ring).edges == (
        (0, 1), (0, 4), (2, 1), (2, 3), (3, 4),
    )  # fmt: skip
    filled = build({**RING, "fill_in": True, "communication": "parents"}, ring)
    assert filled.edges == ((0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4))
    assert filled.senders(4) == (0, 3)


def test_other_edges_take_the_place_of_the_graphs() -> None:
    wrong = build({**RING, "others": 3}, tuple("abcdef"))
    right = build(RING, tuple("abcdef"))
    assert len(wrong.edges) == len(right.edges) == 6
    assert not set(wrong.edges) & set(right.edges)


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"kind": "chain", "decision_order": "listed"}, "the graph is directed; leave the key out"),
        ({**RING, "decision_order": ["a", "b"]}, "agent 'c' is missing from decision_order"),
        ({**RING, "decision_order": ["a", "b", "c", "x"]}, "unknown agent 'x' in decision_order"),
        ({"kind": "coordination-graph", "fill_in": True}, "fill_in = true: set decision_order"),
    ],
)
def test_an_orientation_that_does_not_fit_is_refused(settings: dict, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        build(settings, AGENTS)


def test_an_undirected_file_needs_an_orientation(tmp_path: Path) -> None:
    path = tmp_path / "line.graphml"
    nx.write_graphml(nx.path_graph(AGENTS), path)
    with pytest.raises(ValueError, match=r"set topology\.decision_order"):
        build(f"file:{path}", AGENTS)
    reversed_line = build({"kind": "file", "path": str(path), "decision_order": "reversed"}, AGENTS)
    assert reversed_line.edges == ((1, 0), (2, 1), (3, 2))
