"""Hierarchies: the order of decisions, communication and lookahead (Section II-D, Fig. 1).

A hierarchy is a directed acyclic graph over named agents, with edges from superior to subordinate.
The agents decide in topological order; ties are broken by agent order. An edge stands for two
relations, which can be switched separately:

- *communication*: an agent receives the decided actions of its ancestors, as in the paper, of its
  parents only, or of no agent;
- *lookahead*: an agent searches over the actions of its descendants, as in the paper, of its
  children only, or of no agent.

Either relation may be restricted to agents in certain bodies (robots): in the agent's own body, in
the next bodies in the order of bodies, or in bodies farther away.

An agent that another one neither receives actions from nor searches over is *unseen* by it. The
learner's settings say what is assumed about unseen agents. A chain has none.

*Neighbors* are joined by an undirected edge. They decide at the same time: each searches over the
actions of the other and receives no action from it. Complete graphs of neighbors are joint-action
learners; sparse ones are coordination graphs.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from typing import Annotated, Literal

from pydantic import AfterValidator

from ..numerics import nx
from ..plugins.words import expect, expect_each, expect_pairs

ARROW = "{} -> {}"
LINE = "{} - {}"
BODY_DISTANCES = ("body", "next", "farther")
"""Position of another agent's body: the same one, a next one, or one farther away."""


def _check_body_distances(distances: tuple[str, ...]) -> tuple[str, ...]:
    if not 1 <= len(distances) <= 2 or not {*distances} <= {*BODY_DISTANCES}:
        raise ValueError(f"must be a list of one or two of {', '.join(BODY_DISTANCES)}")
    return distances


BodyDistances = Annotated[tuple[str, ...], AfterValidator(_check_body_distances)]
Communication = Literal["ancestors", "parents", "none"] | BodyDistances
"""Senders of the actions that an agent receives; or the bodies of the ancestors among them."""
Lookahead = Literal["descendants", "children", "none"] | BodyDistances
"""Agents whose actions an agent searches over; or the bodies of the descendants among them."""


class Hierarchy:
    """A directed acyclic graph over agents, some of which may be neighbors.

    Parameters
    ----------
    agents
        Distinct agent names, in agent order.
    edges
        Pairs (superior, subordinate) of names.
    neighbors
        Pairs of names of agents that decide at the same time, each pair once.
    communication
        Agents whose decided actions an agent receives.
    lookahead
        Agents whose actions an agent searches over; neighbors count as children.
    bodies
        Names of the agents of each body, in the order of bodies. By default each agent is a body.

    Raises
    ------
    ValueError
        If an agent is unknown or named twice, an edge is repeated, is a loop or closes a cycle, or
        two neighbors are superior and subordinate.

    Examples
    --------
    >>> chain = Hierarchy(["a", "b", "c"], [("a", "b"), ("b", "c")])
    >>> chain.order, chain.searched(0), chain.senders(2)
    ((0, 1, 2), (1, 2), (0, 1))
    >>> both = Hierarchy(["a", "b"], [], neighbors=[("a", "b")])
    >>> both.searched(0), both.searched(1), both.senders(1)
    ((1,), (0,), ())
    >>> silent = Hierarchy(
    ...     "abc", [("a", "b"), ("b", "c")], communication="none", lookahead="children"
    ... )
    >>> silent.searched(0), silent.senders(2), silent.unseen(1)
    ((1,), (), (0,))
    """

    def __init__(
        self,
        agents: Sequence[str],
        edges: Iterable[tuple[str, str]],
        neighbors: Iterable[tuple[str, str]] = (),
        communication: Communication = "ancestors",
        lookahead: Lookahead = "descendants",
        bodies: Iterable[Sequence[str]] = (),
    ) -> None:
        expect("the names of agents", Collection, agents=agents)
        expect("pairs of names", Iterable, edges=edges, neighbors=neighbors, bodies=bodies)
        expect_each("the names of agents", str, agents=agents)
        self.agents = tuple(agents)
        pairs = tuple(edges)
        undirected = tuple(neighbors)
        expect_pairs("pairs of names", edges=pairs, neighbors=undirected)
        if not self.agents:
            raise ValueError("hierarchy: no agents")
        for name in self.agents:
            if self.agents.count(name) > 1:
                raise ValueError(f"hierarchy: agent {name!r} is named more than once")
        if undirected and lookahead not in ("descendants", "children"):
            raise ValueError(
                f"hierarchy: lookahead = {lookahead!r}: neighbors search over each other's "
                "actions; without neighbors use independent"
            )
        self._graph = self._directed([(superior, other) for superior, other in pairs])
        self._undirected = self._joined(undirected)
        self.edges: tuple[tuple[int, int], ...] = tuple(sorted(self._graph.edges))
        """Pairs (superior, subordinate) of agent indices."""
        self.neighbors: tuple[tuple[int, int], ...] = tuple(sorted(self._undirected.edges))
        """Pairs of agent indices, each once."""
        self.order: tuple[int, ...] = tuple(nx.lexicographical_topological_sort(self._graph))
        """Agent indices in the order of decision."""
        self.depth: int = nx.dag_longest_path_length(self._graph) + 1
        """Number of agents on the longest path."""
        self.communication = communication
        self.lookahead = lookahead
        self.bodies = tuple(bodies) or tuple((name,) for name in self.agents)
        body_index = {name: k for k, body in enumerate(self.bodies) for name in body}
        self._body_of = [body_index[name] for name in self.agents]
        agent_indices = range(len(self.agents))
        self._senders = tuple(self._related(i, communication, "ancestors") for i in agent_indices)
        searched = ({*self._related(i, lookahead, "descendants")} for i in agent_indices)
        self._searched = tuple(
            tuple(sorted(agents.union(self._undirected[i]))) for i, agents in enumerate(searched)
        )

    def __len__(self) -> int:
        return len(self.agents)

    def __repr__(self) -> str:
        pairs = [ARROW.format(self.agents[a], self.agents[b]) for a, b in self.edges]
        pairs += [LINE.format(self.agents[a], self.agents[b]) for a, b in self.neighbors]
        return f"Hierarchy({len(self)} agents: {', '.join(pairs) or 'no edges'})"

    def senders(self, agent: int) -> tuple[int, ...]:
        """Return the agents whose decided actions `agent` receives, in agent order."""
        return self._senders[agent]

    def searched(self, agent: int) -> tuple[int, ...]:
        """Return the agents whose actions `agent` searches over, in agent order."""
        return self._searched[agent]

    def unseen(self, agent: int) -> tuple[int, ...]:
        """Return the agents that `agent` neither receives from nor searches over."""
        seen = {agent, *self._searched[agent], *self._senders[agent]}
        return tuple(i for i in range(len(self)) if i not in seen)

    @property
    def n_messages(self) -> int:
        """Number of messages in one joint decision.

        Each agent receives one message from each of its senders. Neighbors exchange their last or
        their best actions.
        """
        between_neighbors = 0 if self.communication == "none" else 2 * len(self.neighbors)
        return sum(map(len, self._senders)) + between_neighbors

    def count_joint_actions(self, n_actions: int) -> int:
        """Return the number of joint actions that exhaustive search tries in one joint decision."""
        return sum(n_actions ** (1 + len(searched)) for searched in self._searched)

    def _directed(self, edges: Sequence[tuple[str, str]]) -> nx.DiGraph:
        """Return the checked graph of superiors and subordinates, over agent indices."""
        self._check_edges(edges, ARROW, "superior")
        graph = nx.DiGraph()
        graph.add_nodes_from(range(len(self.agents)))
        index = self.agents.index
        graph.add_edges_from((index(superior), index(other)) for superior, other in edges)
        if not nx.is_directed_acyclic_graph(graph):
            cycle = [self.agents[superior] for superior, _ in nx.find_cycle(graph)]
            raise ValueError(f"hierarchy: cycle {' -> '.join([*cycle, cycle[0]])}")
        return graph

    def _joined(self, pairs: Sequence[tuple[str, str]]) -> nx.Graph:
        """Return the checked graph of neighbors, over agent indices."""
        self._check_edges([tuple(sorted(pair)) for pair in pairs], LINE, "neighbor")
        graph = nx.empty_graph(len(self.agents))
        index = self.agents.index
        graph.add_edges_from((index(first), index(second)) for first, second in pairs)
        for a, b in sorted(graph.edges):
            if nx.has_path(self._graph, a, b) or nx.has_path(self._graph, b, a):
                pair = LINE.format(self.agents[a], self.agents[b])
                raise ValueError(f"hierarchy: neighbors {pair} are superior and subordinate, too")
        return graph

    def _check_edges(self, edges: Sequence[tuple[str, ...]], form: str, role: str) -> None:
        checked = set()
        for edge in edges:
            for name in edge:
                if name not in self.agents:
                    raise ValueError(
                        f"hierarchy: edge {form.format(*edge)} names unknown agent {name!r}, "
                        f"known: {', '.join(self.agents)}"
                    )
            if edge[0] == edge[1]:
                raise ValueError(f"hierarchy: agent {edge[0]!r} cannot be its own {role}")
            if edge in checked:
                raise ValueError(f"hierarchy: edge {form.format(*edge)} is given more than once")
            checked.add(edge)

    def _related(
        self, agent: int, relation: str | tuple[str, ...], everyone: str
    ) -> tuple[int, ...]:
        """Return the agents in a relation to `agent`; `everyone` are those without restriction."""
        finders: Mapping[str, Callable[[int], Iterable[int]]] = {
            "ancestors": partial(nx.ancestors, self._graph),
            "parents": self._graph.predecessors,
            "descendants": partial(nx.descendants, self._graph),
            "children": self._graph.successors,
            "none": lambda _: (),
        }
        related = finders[relation if isinstance(relation, str) else everyone](agent)
        if not isinstance(relation, str):
            own = self._body_of[agent]
            distances = {i: min(abs(self._body_of[i] - own), 2) for i in related}
            related = [i for i, k in distances.items() if BODY_DISTANCES[k] in relation]
        return tuple(sorted(related))
