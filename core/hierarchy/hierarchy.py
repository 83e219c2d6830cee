"""The hierarchy of agents: who considers whom, and who is told by whom (Section II-D, Fig. 1).

A hierarchy is a directed acyclic graph, superior -> subordinate, over named agents. The agents
decide in topological order, ties in agent order. An edge is two relations in one, which a
hierarchy can part:

- *considering*: an agent tries the actions of those below it (averages or maximises over them):
  of all its descendants, as in the paper, of its children alone, or of nobody;
- *telling*: an agent is told what those above it have decided: all its ancestors, as in the paper,
  its parents alone, or nobody.

Either may hold for ancestors or descendants in some bodies alone: within an agent's own body, in
the next ones, which come directly before and after it in the order of bodies, or in those farther
away.

Whom an agent neither considers nor is told of is *unseen*: it is taken to perform the neutral
action, maintain, even if it has decided, unless the team reads the unseen otherwise (see
`nested_agents.core.learners.learner`). In the paper's chain nobody is unseen.

*Neighbours* are joined by an undirected edge: they decide at the same time. Each considers all
actions of the other, as if it were below, and neither is told what the other does. Neighbours make
joint-action learners (everybody is everybody's neighbour) and coordination graphs (few are).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator

from ..numerics import nx
from ..plugins.words import expect, expect_each, expect_pairs
from .picture import svg

ARROW, LINE = "{} -> {}", "{} - {}"
"""How a superior and its subordinate are written, and two neighbours."""
WHERE = ("body", "next", "farther")
"""In which body another agent is: in the same one, in the next one, or farther away."""


def _some(where: tuple[str, ...]) -> tuple[str, ...]:
    if not 1 <= len(where) <= 2 or not {*where} <= {*WHERE}:
        raise ValueError(f"must be a list of one or two of {', '.join(WHERE)}")
    return where


SomeBodies = Annotated[tuple[str, ...], AfterValidator(_some)]
Told = Literal["ancestors", "parents", "none"] | SomeBodies
"""By whom an agent is told what was decided; or in which bodies its ancestors tell it."""
Considers = Literal["descendants", "children", "none"] | SomeBodies
"""Whose actions an agent tries; or in which bodies those of its descendants."""


class Hierarchy:
    """A directed acyclic graph over agents, some of whom may be neighbours.

    Parameters
    ----------
    agents
        Distinct agent names; their order is the agent order.
    edges
        Pairs (superior, subordinate) of names.
    neighbours
        Pairs of names of those who decide at the same time, each pair once.
    told
        By whom an agent is told what was decided.
    considers
        Whose actions an agent tries beside its own; neighbours count as its children.
    bodies
        Names of the agents of each body, in the order of bodies; none: each is a body of its own.

    Raises
    ------
    ValueError
        If an agent is named twice or unknown, an edge occurs twice, leads to itself, or closes a
        cycle, or two neighbours are superior and subordinate. The message names it.

    Examples
    --------
    >>> chain = Hierarchy(["a", "b", "c"], [("a", "b"), ("b", "c")])
    >>> chain.order, chain.below(0), chain.above(2)
    ((0, 1, 2), (1, 2), (0, 1))
    >>> both = Hierarchy(["a", "b"], [], neighbours=[("a", "b")])
    >>> both.below(0), both.below(1), both.above(1)
    ((1,), (0,), ())
    >>> silent = Hierarchy("abc", [("a", "b"), ("b", "c")], told="none", considers="children")
    >>> silent.below(0), silent.above(2), silent.unseen(1)
    ((1,), (), (0,))
    """

    def __init__(
        self,
        agents: Sequence[str],
        edges: Iterable[tuple[str, str]],
        neighbours: Iterable[tuple[str, str]] = (),
        told: Told = "ancestors",
        considers: Considers = "descendants",
        bodies: Iterable[Sequence[str]] = (),
    ) -> None:
        expect("the names of agents", Collection, agents=agents)
        expect("pairs of names", Iterable, edges=edges, neighbours=neighbours, bodies=bodies)
        expect_each("the names of agents", str, agents=agents)
        pairs = tuple(edges)
        beside_each_other = tuple(neighbours)
        expect_pairs("pairs of names", edges=pairs, neighbours=beside_each_other)
        agents = tuple(agents)
        edges = [(str(a), str(b)) for a, b in pairs]
        if not agents:
            raise ValueError("hierarchy: no agents")
        for name in agents:
            if agents.count(name) > 1:
                raise ValueError(f"hierarchy: agent {name!r} is named more than once")
        sides = [(str(a), str(b)) for a, b in beside_each_other]
        if sides and considers not in ("descendants", "children"):
            raise ValueError(
                f"hierarchy: considers = {considers!r}: neighbours consider each other; without "
                "neighbours use independent"
            )
        _check_edges(edges, agents, ARROW, "superior")
        _check_edges([tuple(sorted(pair)) for pair in sides], agents, LINE, "neighbour")
        index = {name: i for i, name in enumerate(agents)}
        graph = nx.empty_graph(len(agents), create_using=nx.DiGraph)
        graph.add_edges_from((index[a], index[b]) for a, b in edges)
        if not nx.is_directed_acyclic_graph(graph):
            cycle = [agents[a] for a, _ in nx.find_cycle(graph)]
            raise ValueError(f"hierarchy: cycle {' -> '.join([*cycle, cycle[0]])}")
        self.agents = agents
        self.edges = tuple(sorted(graph.edges))
        beside = nx.empty_graph(len(agents))
        beside.add_edges_from((index[a], index[b]) for a, b in sides)
        self.neighbours = tuple(sorted(beside.edges))
        """Pairs of neighbours, by index, each once."""
        self.order: tuple[int, ...] = tuple(nx.lexicographical_topological_sort(graph))
        for a, b in self.neighbours:
            if nx.has_path(graph, a, b) or nx.has_path(graph, b, a):
                pair = LINE.format(agents[a], agents[b])
                raise ValueError(f"hierarchy: neighbours {pair} are superior and subordinate, too")
        self.bodies = tuple(bodies) or tuple((name,) for name in agents)
        place = {index[name]: k for k, body in enumerate(self.bodies) for name in body}

        def related(agent: int, relation: Any, every: str) -> Iterable[int]:
            if isinstance(relation, str):
                return RELATIONS[relation](graph, agent)
            away = {j: abs(place[j] - place[agent]) for j in RELATIONS[every](graph, agent)}
            return [j for j, bodies in away.items() if WHERE[min(bodies, 2)] in relation]

        below = [{*related(i, considers, "descendants"), *beside[i]} for i in beside]
        self._below = tuple(tuple(sorted(agents)) for agents in below)
        self._above = tuple(tuple(sorted(related(i, told, "ancestors"))) for i in beside)
        self.told, self.considers = told, considers
        self.depth: int = nx.dag_longest_path_length(graph) + 1
        """Number of agents on the longest path."""

    def __len__(self) -> int:
        return len(self.agents)

    def __repr__(self) -> str:
        pairs = [ARROW.format(self.agents[a], self.agents[b]) for a, b in self.edges]
        pairs += [LINE.format(self.agents[a], self.agents[b]) for a, b in self.neighbours]
        return f"Hierarchy({len(self)} agents: {', '.join(pairs) or 'no edges'})"

    def _repr_svg_(self) -> str:
        levels = [0] * len(self)
        for agent in self.order:
            above = [levels[a] + 1 for a, b in self.edges if b == agent]
            levels[agent] = max(above, default=0)
        return svg(self.agents, levels, self.edges, self.neighbours)

    def below(self, agent: int) -> tuple[int, ...]:
        """Return all agents whose actions `agent` considers, in agent order."""
        return self._below[agent]

    def above(self, agent: int) -> tuple[int, ...]:
        """Return all agents whose actions `agent` is told, in agent order."""
        return self._above[agent]

    def unseen(self, agent: int) -> tuple[int, ...]:
        """Return the agents that `agent` neither considers nor is told of."""
        seen = {agent, *self._below[agent], *self._above[agent]}
        return tuple(i for i in range(len(self)) if i not in seen)

    @property
    def messages(self) -> int:
        """How many messages there are in one decision of all agents.

        An agent is told by each agent above it what was decided; neighbours tell each other what
        they have done, or what would be best.
        """
        return sum(map(len, self._above)) + 2 * len(self.neighbours) * (self.told != "none")

    def joint_actions(self, n_actions: int) -> int:
        """Return how many joint actions one decision of all agents enumerates (exact integer)."""
        return sum(n_actions ** (1 + len(below)) for below in self._below)


RELATIONS: dict[str, Callable[[nx.DiGraph, int], Iterable[int]]] = {
    "ancestors": lambda graph, agent: nx.ancestors(graph, agent),
    "parents": lambda graph, agent: graph.predecessors(agent),
    "descendants": lambda graph, agent: nx.descendants(graph, agent),
    "children": lambda graph, agent: graph.successors(agent),
    "none": lambda graph, agent: (),
}
"""Who is related to an agent in a hierarchy's graph."""


def _check_edges(
    edges: Sequence[tuple[str, ...]], agents: tuple[str, ...], form: str, kind: str
) -> None:
    known, seen = set(agents), set()
    for edge in edges:
        for name in edge:
            if name not in known:
                raise ValueError(
                    f"hierarchy: edge {form.format(*edge)} names unknown agent {name!r}, known: "
                    f"{', '.join(agents)}"
                )
        if edge[0] == edge[1]:
            raise ValueError(f"hierarchy: agent {edge[0]!r} cannot be its own {kind}")
        if edge in seen:
            raise ValueError(f"hierarchy: edge {form.format(*edge)} is given more than once")
        seen.add(edge)
