"""The built-in topologies, each a pure function from the names of agents to a networkx graph.

Every agent is a node, and an edge leads from a superior to its subordinate. An undirected graph
joins neighbors instead. Agents are given in agent order; *bodies* groups the same names by body,
such as the wheels of each robot. Keyword-only parameters are the settings of a topology, which are
the keys of its ``[topology]`` table in a spec. `nested_agents.topologies.build` turns the graph
into a `Hierarchy`. Errors name the agent that is unknown, missing or repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import combinations, compress, zip_longest
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field, NonNegativeInt
from typing_extensions import TypeAliasType

from ..core.hierarchy.hierarchy import Hierarchy
from ..core.numerics import nx
from ..core.plugins.settings import Fraction
from ..core.search import coordination_graphs as graphs
from ..core.search.coordination_graphs import Shape
from .names import check_names


def with_edges(graph: nx.DiGraph, edges: Iterable[Sequence[str]]) -> nx.DiGraph:
    """Add (superior, subordinate) pairs to a graph in place; refuse repeated pairs."""
    for superior, subordinate in edges:
        if graph.has_edge(superior, subordinate):
            raise ValueError(f"edge {superior} -> {subordinate} is given more than once")
        graph.add_edge(superior, subordinate)
    return graph


Names: TypeAlias = Sequence[str]
Bodies: TypeAlias = Sequence[Names]
Pairs: TypeAlias = tuple[tuple[str, str], ...]
Members = TypeAliasType("Members", "tuple[str | Members, ...]")
"""Members of a group: agents or further groups, to any depth."""
Order: TypeAlias = Literal["listed", "reversed", "interleaved"] | tuple[str, ...]


def chain(agents: Names, bodies: Bodies = (), *, order: Order = "listed") -> nx.DiGraph:
    """Arrange the agents in a chain, each above the next, as in the paper.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    order
        Agent order, its reverse, ``interleaved`` (first wheels of all robots, then second wheels),
        or all names in order.

    Examples
    --------
    >>> list(chain(["a1", "a2", "b1", "b2"]).edges)
    [('a1', 'a2'), ('a2', 'b1'), ('b1', 'b2')]
    >>> list(chain(["a1", "a2", "b1"], [["a1", "a2"], ["b1"]], order="interleaved").edges)
    [('a1', 'b1'), ('b1', 'a2')]
    """
    ranks = zip_longest(*bodies)
    orders = {
        "listed": tuple(agents),
        "reversed": tuple(reversed(agents)),
        "interleaved": tuple(agent for rank in ranks for agent in rank if agent is not None),
    }
    names = orders[order] if isinstance(order, str) else order
    check_names(names, agents, "order")
    return nx.path_graph(names, create_using=nx.DiGraph)


def tree(
    agents: Names, bodies: Bodies = (), *, branching: Annotated[int, Field(ge=1)] = 2
) -> nx.DiGraph:
    """Arrange the agents in a tree with `branching` subordinates each.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    branching
        Number of subordinates of an agent.

    Examples
    --------
    >>> list(tree(["a", "b", "c", "d"]).edges)
    [('a', 'b'), ('a', 'c'), ('b', 'd')]
    """
    graph = nx.full_rary_tree(branching, len(agents), create_using=nx.DiGraph)
    return nx.relabel_nodes(graph, dict(enumerate(agents)))


def star(
    agents: Names,
    bodies: Bodies = (),
    *,
    leader: str | None = None,
    leader_decides: Literal["first", "last"] = "first",
) -> nx.DiGraph:
    """Put one leader above all other agents, or below them.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    leader
        Name of the leader. By default, the first agent, or the last one if it decides last.
    leader_decides
        Whether the leader decides first and sends its action to all others, or decides last and
        receives theirs.

    Examples
    --------
    >>> list(star(["a", "b", "c"], leader="b").edges)
    [('b', 'a'), ('b', 'c')]
    >>> list(star(["a", "b", "c"], leader_decides="last").edges)
    [('a', 'c'), ('b', 'c')]
    """
    is_first = leader_decides == "first"
    usual = agents[0] if is_first else agents[-1]
    leader = usual if leader is None else leader
    check_names([leader], agents, "leader", all_needed=False)
    graph = independent(agents)
    others = [agent for agent in agents if agent != leader]
    graph.add_edges_from((leader, other) if is_first else (other, leader) for other in others)
    return graph


def teams(
    agents: Names,
    bodies: Bodies = (),
    *,
    link: Literal["chain", "star"] = "chain",
    members: Members | None = None,
) -> nx.DiGraph:
    """Link leaders of nested groups in a chain or star, each above its group.

    The leader of a group is its first agent. By default, the groups are the robots: their first
    wheels form a chain, and each is above the other wheels of its robot.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    link
        Whether the leaders of the members of a group form a chain or a star.
    members
        Nested lists of agent names, to any depth. By default, the bodies (robots) of the scenario.

    Examples
    --------
    >>> sorted(teams(["a1", "a2", "b1", "b2"], [["a1", "a2"], ["b1", "b2"]]).edges)
    [('a1', 'a2'), ('a1', 'b1'), ('b1', 'b2')]
    >>> sorted(teams("abcd", members=(("a", "b", "c"), "d"), link="star").edges)
    [('a', 'b'), ('a', 'c'), ('a', 'd')]
    """
    team = tuple(map(tuple, bodies)) if members is None else members
    check_names(names_of(team), agents, "members")
    return _team(team, chain if link == "chain" else star)


def independent(agents: Names, bodies: Bodies = ()) -> nx.DiGraph:
    """Leave all agents unconnected.

    Examples
    --------
    >>> list(independent(["a", "b"]).edges)
    []
    """
    return nx.empty_graph(agents, create_using=nx.DiGraph)


def simultaneous(agents: Names, bodies: Bodies = ()) -> nx.Graph:
    """Make all agents neighbors, which decide at the same time.

    Examples
    --------
    >>> list(simultaneous(["a", "b", "c"]).edges)
    [('a', 'b'), ('a', 'c'), ('b', 'c')]
    """
    return nx.complete_graph(agents)


def coordination_graph(
    agents: Names,
    bodies: Bodies = (),
    *,
    shape: Shape | Literal["scenario"] = "line",
    edges: Pairs | None = None,
    others: NonNegativeInt | None = None,
) -> nx.Graph:
    """Join neighbors that decide at the same time, in a shape or by listed pairs.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    shape
        Shape in which the agents are placed in agent order; in a ``tree`` every agent has two later
        neighbors. With ``scenario`` the scenario says which agents interact.
    edges
        Pairs of neighbors, instead of a shape.
    others
        Seed with which the same number of other pairs is drawn at random, as a control.

    Raises
    ------
    ValueError
        If a pair is given twice, or names an unknown agent.

    Examples
    --------
    >>> list(coordination_graph(["a", "b", "c"], shape="ring").edges)
    [('a', 'b'), ('a', 'c'), ('b', 'c')]
    """
    if edges is None:
        if shape == "scenario":
            raise ValueError("shape = 'scenario': the scenario has no interactions of its agents")
        graph = nx.relabel_nodes(graphs.build_shape(shape, len(agents)), dict(enumerate(agents)))
    else:
        Hierarchy(agents, [], edges)  # checks the names and pairs
        graph = nx.empty_graph(agents)
        graph.add_edges_from(edges)
    return graph if others is None else graphs.other_edges(graph, others)


def from_edges(
    agents: Names, bodies: Bodies = (), *, edges: Pairs, alone: tuple[str, ...] = ()
) -> nx.DiGraph:
    """Build any hierarchy from its edges.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    edges
        Pairs (superior, subordinate).
    alone
        Agents without edges.

    Raises
    ------
    ValueError
        If an edge occurs twice, or an agent is neither in an edge nor in `alone`, or in both.

    Examples
    --------
    >>> list(from_edges(["a", "b", "c"], edges=(("a", "b"),), alone=("c",)).edges)
    [('a', 'b')]
    """
    graph = with_edges(independent([]), edges)
    check_names([*graph, *alone], agents, "edges and alone")
    graph.add_nodes_from(alone)
    return graph


def random_hierarchy(
    agents: Names, bodies: Bodies = (), *, seed: NonNegativeInt = 0, density: Fraction = 0.3
) -> nx.DiGraph:
    """Order the agents at random, and connect each pair with some probability.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    seed
        Seed of the random numbers.
    density
        Probability of each possible edge.

    Examples
    --------
    >>> first, again = (random_hierarchy(["a", "b", "c", "d"], seed=1) for _ in range(2))
    >>> nx.utils.graphs_equal(first, again), nx.is_directed_acyclic_graph(first)
    (True, True)
    """
    rng = np.random.default_rng(seed)
    ranked = [agents[i] for i in rng.permutation(len(agents))]
    graph = independent(agents)
    pairs = list(combinations(ranked, 2))
    graph.add_edges_from(compress(pairs, rng.random(len(pairs)) < density))
    return graph


def names_of(members: Iterable[str | Members]) -> list[str]:
    """Return the agents of nested groups, from left to right.

    Examples
    --------
    >>> names_of([["a", ["b"]], "c"])
    ['a', 'b', 'c']
    """
    return [name for m in members for name in ([m] if isinstance(m, str) else names_of(m))]


def from_networkx(graph: nx.Graph, agents: Sequence[str], *, neighbors: bool = False) -> nx.Graph:
    """Return a directed acyclic graph over `agents` with the ``str`` of each node as its name.

    Parameters
    ----------
    graph
        Its nodes are the agents, and its edges lead from superior to subordinate. Not modified.
    agents
        Names in agent order.
    neighbors
        Whether the graph may be undirected; it then joins neighbors.

    Raises
    ------
    ValueError
        If it is undirected or a multigraph, its nodes are not the agents, or it has a cycle. The
        message is one line and names the node, edge or cycle.

    Examples
    --------
    >>> from_networkx(nx.DiGraph([(0, 1)]), ["0", "1"]).edges
    OutEdgeView([('0', '1')])
    """
    if not graph.is_directed() and not neighbors:
        raise ValueError("the graph is undirected, allowed: edges from superior to subordinate")
    if graph.is_multigraph():
        raise ValueError("the graph is a multigraph: edges could be given more than once")
    named: nx.Graph = nx.relabel_nodes(graph, str)
    check_names([str(node) for node in graph], agents, "the graph")
    if named.is_directed() and not nx.is_directed_acyclic_graph(named):
        Hierarchy(agents, named.edges)  # the error names the cycle
    return named


def _team(members: Sequence[str | Members], arrange: Callable[[Names], nx.DiGraph]) -> nx.DiGraph:
    """Return the graph of a group; `arrange` connects the leaders of its members."""
    if not members:
        raise ValueError("a group has no members")
    graph = nx.compose_all(
        [independent([m]) if isinstance(m, str) else _team(m, arrange) for m in members]
    )
    graph.add_edges_from(arrange([names_of([member])[0] for member in members]).edges)
    return graph
