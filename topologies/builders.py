"""The built-in hierarchies, each a pure function from agent names to a networkx graph.

An edge leads from a superior to its subordinate, and every agent is a node; an undirected graph
joins neighbours. Agents are given in agent order; *groups* are the agents of one robot each. A
graph becomes a `Hierarchy` in `nested_agents.topologies.build`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain as concatenated
from itertools import zip_longest
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from ..core.interface.hierarchy import Hierarchy
from ..core.plugins.deferred import Deferred
from .checks import check_names, with_edges

if TYPE_CHECKING:
    import networkx as nx
else:
    nx = Deferred("networkx")

Member: TypeAlias = "str | Sequence[Member]"
"""An agent, or a team of members."""


def chain(agents: Sequence[str]) -> nx.DiGraph:
    """Return the paper's nested chain: each agent above the next one.

    Examples
    --------
    >>> list(chain(["a", "b", "c"]).edges)
    [('a', 'b'), ('b', 'c')]
    """
    graph = nx.DiGraph()
    nx.add_path(graph, agents)
    return graph


def interleaved(groups: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return the agents in the order first of every group, second of every group, ...

    Examples
    --------
    >>> interleaved([["a1", "a2"], ["b1", "b2"]])
    ('a1', 'b1', 'a2', 'b2')
    """
    ranks = zip_longest(*groups)
    return tuple(agent for rank in ranks for agent in rank if agent is not None)


def tree(agents: Sequence[str], branching: int = 2) -> nx.DiGraph:
    """Return a tree in which every agent but the last ones has `branching` subordinates.

    Examples
    --------
    >>> list(tree(["a", "b", "c", "d"], 2).edges)
    [('a', 'b'), ('a', 'c'), ('b', 'd')]
    """
    graph = nx.full_rary_tree(branching, len(agents), create_using=nx.DiGraph)
    return nx.relabel_nodes(graph, dict(enumerate(agents)))


def star(agents: Sequence[str], leader: str | None = None) -> nx.DiGraph:
    """Return one leader, the first agent unless named, with everyone else right below it.

    Examples
    --------
    >>> list(star(["a", "b", "c"], leader="b").edges)
    [('b', 'a'), ('b', 'c')]
    """
    leader = agents[0] if leader is None else leader
    check_names([leader], agents, "leader", all_needed=False)
    graph = independent(agents)
    graph.add_edges_from((leader, agent) for agent in agents if agent != leader)
    return graph


def independent(agents: Sequence[str]) -> nx.DiGraph:
    """Return agents that do not see one another.

    Examples
    --------
    >>> list(independent(["a", "b"]).edges)
    []
    """
    graph = nx.DiGraph()
    graph.add_nodes_from(agents)
    return graph


def simultaneous(agents: Sequence[str]) -> nx.Graph:
    """Return agents who are all neighbours: everybody considers everybody, nobody is told anything.

    Examples
    --------
    >>> list(simultaneous(["a", "b", "c"]).edges)
    [('a', 'b'), ('a', 'c'), ('b', 'c')]
    """
    graph: nx.Graph = nx.complete_graph(agents)
    return graph


def coordination_graph(
    agents: Sequence[str],
    shape: Literal["line", "ring"] = "line",
    edges: Iterable[Sequence[str]] | None = None,
) -> nx.Graph:
    """Return neighbours on a line or a ring in agent order, or the given pairs of neighbours.

    Raises
    ------
    ValueError
        If a pair is given twice, or names an unknown agent.

    Examples
    --------
    >>> list(coordination_graph(["a", "b", "c"], "ring").edges)
    [('a', 'b'), ('a', 'c'), ('b', 'c')]
    """
    graph = nx.Graph()
    graph.add_nodes_from(agents)
    if edges is not None:
        pairs = [(min(a, b), max(a, b)) for a, b in edges]
        Hierarchy(agents, [], pairs)  # raises and names what is wrong
        graph.add_edges_from(pairs)
        return graph
    nx.add_path(graph, agents)
    if shape == "ring" and len(agents) > 2:
        graph.add_edge(agents[-1], agents[0])
    return graph


def teams(members: Sequence[Member], link: Literal["chain", "star"] = "chain") -> nx.DiGraph:
    """Return nested teams: the leaders of a team's members form a chain, or a star.

    A team is a list of agents or of teams, to any depth; the leader of a team is the leader of its
    first member, that of an agent the agent itself.

    Examples
    --------
    Two robots of two wheels: the leading wheels form a chain, each above its own robot's wheels.

    >>> sorted(teams([["a1", "a2"], ["b1", "b2"]]).edges)
    [('a1', 'a2'), ('a1', 'b1'), ('b1', 'b2')]
    >>> sorted(teams([["a", "b", "c"], "d"], link="star").edges)
    [('a', 'b'), ('a', 'c'), ('a', 'd')]
    """
    if not members:
        raise ValueError("a team has no members")
    graph = nx.compose_all(
        [independent([m]) if isinstance(m, str) else teams(m, link) for m in members]
    )
    leaders = [_leader(member) for member in members]
    arrange = chain if link == "chain" else star
    graph.add_edges_from(arrange(leaders).edges)
    return graph


def names_of(members: Sequence[Member]) -> list[str]:
    """Return the agents of nested teams, from left to right.

    Examples
    --------
    >>> names_of([["a", ["b"]], "c"])
    ['a', 'b', 'c']
    """
    parts = ([m] if isinstance(m, str) else names_of(m) for m in members)
    return list(concatenated.from_iterable(parts))


def from_edges(
    agents: Sequence[str], edges: Iterable[Sequence[str]], alone: Iterable[str] = ()
) -> nx.DiGraph:
    """Return the hierarchy of (superior, subordinate) pairs.

    Raises
    ------
    ValueError
        If an edge occurs twice, or an agent is in no edge and not in `alone`. It is named.

    Examples
    --------
    >>> list(from_edges(["a", "b", "c"], [("a", "b")], alone=["c"]).edges)
    [('a', 'b')]
    """
    graph = nx.DiGraph()
    graph.add_nodes_from(alone)
    with_edges(graph, edges)
    check_names(list(graph), agents, "edges and alone")
    return graph


def from_networkx(graph: nx.Graph, agents: Sequence[str], *, neighbours: bool = False) -> nx.Graph:
    """Return a directed acyclic graph over `agents` with its nodes named by their ``str``.

    Parameters
    ----------
    graph
        Its nodes are the agents, its edges lead from superior to subordinate; not modified.
    agents
        Names in agent order.
    neighbours
        Whether an undirected graph, which then joins neighbours, is allowed, too.

    Raises
    ------
    ValueError
        If it is undirected, has parallel edges, its nodes are not the agents, or it has a cycle.
        One line; it names the culprit.

    Examples
    --------
    >>> from_networkx(nx.DiGraph([(0, 1)]), ["0", "1"]).edges
    OutEdgeView([('0', '1')])
    """
    if not graph.is_directed() and not neighbours:
        raise ValueError("the graph is undirected: who is above whom?")
    if graph.is_multigraph():
        raise ValueError("the graph is a multigraph: edges could be given more than once")
    named: nx.Graph = nx.relabel_nodes(graph, str)
    check_names([str(node) for node in graph], agents, "the graph")
    if named.is_directed() and not nx.is_directed_acyclic_graph(named):
        Hierarchy(agents, named.edges)  # raises and names the cycle
    return named


def random_hierarchy(agents: Sequence[str], seed: int, density: float = 0.3) -> nx.DiGraph:
    """Return a random hierarchy: a random ranking, each agent above a lower one with a chance.

    Parameters
    ----------
    agents
        Names in agent order.
    seed
        Everything random follows from it.
    density
        Chance of each of the n (n - 1) / 2 possible edges.

    Examples
    --------
    >>> first, again = (random_hierarchy(["a", "b", "c", "d"], seed=1) for _ in range(2))
    >>> nx.utils.graphs_equal(first, again), nx.is_directed_acyclic_graph(first)
    (True, True)
    """
    rng = np.random.default_rng(seed)
    ranked = [agents[i] for i in rng.permutation(len(agents))]
    graph = independent(agents)
    for i, superior in enumerate(ranked):
        below = ranked[i + 1 :]
        chosen = rng.random(len(below)) < density
        graph.add_edges_from((superior, b) for b, c in zip(below, chosen, strict=True) if c)
    return graph


def _leader(member: Member) -> str:
    while not isinstance(member, str):
        member = member[0]
    return member
