"""Repair of a hierarchy from which agents leave."""

from collections.abc import Sequence
from typing import Literal

from ..numerics import nx
from .hierarchy import Hierarchy

Repair = Literal["grandparents", "next", "none"]
"""Rule of the repair, see `without`."""


def without(hierarchy: Hierarchy, gone: Sequence[int], repair: Repair) -> Hierarchy:
    """Return a hierarchy in which some agents have no edges. They are removed one after another.

    Parameters
    ----------
    hierarchy
        The hierarchy before.
    gone
        Agents that leave.
    repair
        New superiors of the subordinates of an agent that leaves: its superiors
        (``grandparents``); the ``next`` subordinate in the order of decision, which takes its
        place; or no agent (``none``). Neighbors of an agent that leaves are not connected.

    Examples
    --------
    >>> tree = Hierarchy("abcd", [("a", "b"), ("b", "c"), ("b", "d")])
    >>> [without(tree, [1], rule).edges for rule in ("grandparents", "next", "none")]
    [((0, 2), (0, 3)), ((0, 2), (2, 3)), ()]
    """
    graph = nx.empty_graph(len(hierarchy), create_using=nx.DiGraph)
    graph.add_edges_from(hierarchy.edges)
    rank = {agent: place for place, agent in enumerate(hierarchy.order)}
    for agent in sorted(gone, key=rank.__getitem__):
        above = list(graph.predecessors(agent))
        below = sorted(graph.successors(agent), key=rank.__getitem__)
        graph.remove_node(agent)
        heirs = below[:1] if repair == "next" else below
        if repair != "none":
            graph.add_edges_from((superior, heir) for superior in above for heir in heirs)
        if repair == "next":
            graph.add_edges_from((below[0], other) for other in below[1:])
    names = hierarchy.agents
    left = set(gone)
    return Hierarchy(
        names,
        [(names[a], names[b]) for a, b in graph.edges],
        [(names[a], names[b]) for a, b in hierarchy.neighbors if not {a, b} & left],
        communication=hierarchy.communication,
        lookahead=hierarchy.lookahead,
        bodies=hierarchy.bodies,
    )
