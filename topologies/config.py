"""Settings of topologies: a ``[topology]`` table of a spec, or a string.

A string is ``"kind"`` or ``"kind:argument"``, see `parse`. To add a topology, write one function in
`builders` and add one line to `TOPOLOGIES`; the function's keyword-only parameters are its
settings. A line in `strings.ARGUMENTS`, which is optional, defines what may follow ``kind:``.

Users bring hierarchies as files of graphs or groups, as functions in Python files, and in installed
packages. A user's topology is a function ``(agents, bodies) -> graph``. It receives the names of
the agents and the same names by body (robot), and returns a networkx DiGraph over all agents, or
pairs (superior, subordinate). An agent in no pair has no edges.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Literal, Self

from pydantic import model_validator

from ..core.hierarchy.failures import AbsentAgents, AnyMessageFailure, LeftAgents
from ..core.hierarchy.hierarchy import Communication, Hierarchy, Lookahead
from ..core.numerics import nx
from ..core.plugins import sources
from ..core.plugins.models import Plugged, tuples
from ..core.plugins.registry import SettingsRegistry
from ..core.plugins.settings import PartSettings, SettingsError, changed_values
from ..core.plugins.words import closest, expect, expect_each
from ..core.search.coordination_graphs import orient
from .builders import Bodies, Names, from_networkx
from .files import read_file
from .names import check_names, quote
from .strings import ARGUMENTS, Keys
from .user_functions import call_builder

BUILDERS = "nested_agents.topologies.builders"

DecisionOrder = Literal["listed", "reversed"] | tuple[str, ...]
"""Decision order: agent order, its reverse, or all names in order."""


class TopologySettings(PartSettings):
    """Settings that all topologies have."""

    communication: Communication = "ancestors"
    """Agents that send an agent their actions: all its ancestors, its parents only, or none. A list
    restricts the ancestors to those in the agent's own ``body``, in the ``next`` bodies in the
    order of bodies, or in bodies ``farther`` away."""
    lookahead: Lookahead = "descendants"
    """Agents over whose actions an agent searches besides its own: all its descendants, its
    children only, or none. A list restricts the descendants by body, as in `communication`."""
    decision_order: DecisionOrder | None = None
    """Decision order of agents that undirected edges join: agent order (``listed``), the reverse,
    or all names in order. Each edge then leads from the earlier agent to the later one. By default,
    neighbors decide at the same time."""
    fill_in: bool = False
    """Whether the superiors of each agent are joined to each other, too, as in variable
    elimination. The best action of an agent then depends on no other agent that has decided."""
    failures: tuple[AnyMessageFailure, ...] = ()
    """Failures of messages and absences of agents, with their times."""

    @model_validator(mode="after")
    def _check_relations(self) -> Self:
        if self.communication == "none" and not all(
            isinstance(f, AbsentAgents | LeftAgents) for f in self.failures
        ):
            raise ValueError(
                "communication = 'none': there are no messages to fail, failures must be "
                "of kind absent or left"
            )
        if self.fill_in and self.decision_order is None:
            raise ValueError("fill_in = true: set decision_order, too, in which the agents decide")
        return self

    def __repr_args__(self) -> Iterable[tuple[str | None, object]]:
        changed = changed_values(self)
        return [(name, value) for name, value in super().__repr_args__() if name in changed]

    @property
    def title(self) -> str:
        """Name in messages: the file, the kind, or the class."""
        return str(dict(self).get("path") or self.kind or type(self).__name__)


IMPLIED = {"members": "teams", "edges": "edges"}
"""Kind of a table without the key ``kind``, by a key that it has."""

TOPOLOGIES = SettingsRegistry(
    "topology",
    {
        "chain": f"{BUILDERS}:chain",
        "tree": f"{BUILDERS}:tree",
        "star": f"{BUILDERS}:star",
        "teams": f"{BUILDERS}:teams",
        "independent": f"{BUILDERS}:independent",
        "simultaneous": f"{BUILDERS}:simultaneous",
        "coordination-graph": f"{BUILDERS}:coordination_graph",
        "edges": f"{BUILDERS}:from_edges",
        "random": f"{BUILDERS}:random_hierarchy",
        "file": f"{__name__}:from_file",
    },
    TopologySettings,
    moved={
        "single-agent": "who the agents are has a key of its own: agents = 'team'",
        "per-robot": "who the agents are has a key of its own: agents = 'body', topology = 'chain'",
    },
)
"""Topologies by name."""


def parse(text: str | Mapping[str, object]) -> TopologySettings:
    """Read the settings of a topology from a string or a ``[topology]`` table.

    A string is ``"kind"``, ``"kind:argument"``, the path of a file with a graph or a table,
    ``"file.py:function"``, or the name of a topology of an installed package. A table needs no kind
    if it has the key `members` (of groups) or `edges`.

    Raises
    ------
    ValueError
        If the kind is unknown or its argument is not allowed; one line.

    Examples
    --------
    >>> parse("tree:3"), parse("chain")
    (TopologySettings(kind='tree', branching=3), TopologySettings(kind='chain'))
    >>> parse({"members": [["a", "b"], ["c"]]}).members
    (('a', 'b'), ('c',))
    """
    if isinstance(text, Mapping):
        return _of_table(text)
    if not isinstance(text, str):
        raise ValueError(f"topology {text!r}: must be a name, a file or a table")
    kind, colon, argument = text.partition(":")
    try:
        if kind in TOPOLOGIES.built_in:
            return TOPOLOGIES.parsed(kind, **(_arguments(kind, argument) if colon else {}))
        if sources.is_file(text):
            return TOPOLOGIES.parsed("file", path=text)
        if sources.is_reference(text) or text in TOPOLOGIES.installed():
            reference, _, suffix = text.rpartition(":")
            if ".py:" in reference and suffix:
                table = f'{{ kind = "{reference}", PARAMETER = VALUE }}'
                raise ValueError(f"a function has its parameters in a table of the spec: {table}")
            return TOPOLOGIES.parsed(text)
    except SettingsError as error:
        raise ValueError(f"topology {text!r}: {error.problem}") from None
    except ValueError as error:
        raise ValueError(f"topology {text!r}: {error}") from None
    if "." in kind or "/" in kind:
        folder = sources.active().folder
        is_there = folder is not None and (folder / text).exists()
        suffixes = f"suffix must be {', '.join(sources.GRAPHS)} or .py:NAME"
        raise ValueError(f"topology {text!r}: {'' if is_there else 'no such file; '}{suffixes}")
    unknown = f"{closest(kind, TOPOLOGIES.names())}, or a file"
    raise ValueError(f"topology {text!r}: {TOPOLOGIES.moved.get(kind, unknown)}")


def _of_table(table: Mapping[str, object]) -> TopologySettings:
    """Return the settings of a table."""
    implied = next((k for key, k in IMPLIED.items() if key in table), None)
    kind = table.get("kind", implied)
    if not isinstance(kind, str):
        raise ValueError(f"topology.kind = {kind!r}: {closest(kind, TOPOLOGIES.names())}")
    try:
        return TOPOLOGIES.parsed(kind, **tuples({**table, "kind": kind}))
    except SettingsError as error:
        raise ValueError(f"topology.{error.problem}") from None
    except ValueError as error:
        raise ValueError(f"topology.kind = {kind!r}: {error}") from None


Topology = Annotated[TopologySettings, Plugged(TOPOLOGIES, parse)]
"""Settings of any topology: a table with a `kind`, or a string for `parse`."""


def build(
    settings: TopologySettings | str | Mapping[str, object],
    agents: Sequence[str],
    bodies: Sequence[Sequence[int]] | None = None,
    interactions: Sequence[tuple[int, int]] | None = None,
) -> Hierarchy:
    """Build a hierarchy of named agents.

    Parameters
    ----------
    settings
        Settings of a topology, or a string or table for `parse`.
    agents
        Distinct names, in agent order.
    bodies
        Agent indices, from 0, by body (robot), each once. By default, every agent is its own body.
    interactions
        Pairs of agent indices that interact. A coordination graph with ``shape = "scenario"`` joins
        them.

    Raises
    ------
    ValueError
        If the settings or the bodies do not fit the agents, or the graph is no hierarchy. The
        message is one line and names the agent or the edge.

    Examples
    --------
    >>> build(parse("chain:reversed"), ["a", "b", "c"])
    Hierarchy(3 agents: b -> a, c -> b)
    >>> build(parse("teams"), ["a1", "a2", "b1", "b2"], [(0, 1), (2, 3)])
    Hierarchy(4 agents: a1 -> a2, a1 -> b1, b1 -> b2)
    """
    if not isinstance(settings, TopologySettings):
        settings = parse(settings)
    expect("the names of agents", Sequence, agents=agents)
    expect("sequences of indices", Sequence | None, bodies=bodies, interactions=interactions)
    expect_each("the names of agents", str, agents=agents)
    title = settings.title
    named: Bodies = [(a,) for a in agents]
    try:
        if not agents:
            raise ValueError("no agents")
        if bodies is not None:
            named = _names_at(agents, bodies, "bodies")
            check_names([name for body in named for name in body], agents, "bodies")
        if interactions is not None and dict(settings).get("shape") == "scenario":
            pairs = _names_at(agents, interactions, "interactions", size=2)
            settings = settings.model_copy(update={"edges": tuple(pairs)})
        if settings.kind in TOPOLOGIES.built_in:
            graph = settings.build(agents, named)
        else:
            graph = call_builder(settings.build, title.rpartition(":")[2], agents, named)
            graph = from_networkx(graph, agents, neighbors=True)
        graph = _directed(graph, settings, agents)
        edges, neighbors = (graph.edges, ()) if graph.is_directed() else ((), graph.edges)
        return Hierarchy(
            agents, edges, neighbors, settings.communication, settings.lookahead, named
        )
    except ValueError as error:
        problem = str(error)
        for start in ("hierarchy: ", f"{title}: ", f"topology {title!r}: "):
            problem = problem.removeprefix(start)
        is_of_user = settings.kind not in TOPOLOGIES.built_in
        given = f" (given {len(agents)} agents of {len(named)} bodies)" if is_of_user else ""
        raise ValueError(f"topology {title!r}: {problem}{given}") from None


def from_file(agents: Names, bodies: Bodies = (), *, path: str) -> nx.DiGraph:
    """Read a graph or nested groups from a GraphML, JSON or TOML file.

    Parameters
    ----------
    agents, bodies
        Names, also by body.
    path
        Path of the file, relative to the spec.
    """
    content = read(path)
    if isinstance(content, TopologySettings):
        return content.build(agents, bodies)
    return from_networkx(content, agents, neighbors=True)


def _directed(graph: nx.Graph, settings: TopologySettings, agents: Names) -> nx.Graph:
    """Return a graph with its undirected edges oriented, if the settings say how."""
    order = settings.decision_order
    if order is None:
        if settings.kind == "file" and not graph.is_directed():
            raise ValueError(
                "the graph is undirected: set topology.decision_order to 'listed', or to all "
                "names in the order of decision"
            )
        return graph
    if graph.is_directed():
        raise ValueError(
            f"decision_order = {quote(order)}: the graph is directed; leave the key out"
        )
    names = {"listed": tuple(agents), "reversed": tuple(reversed(agents))}
    listed = names[order] if isinstance(order, str) else order
    check_names(listed, agents, "decision_order")
    return orient(graph, listed, fill_in=settings.fill_in)


def read(path: str) -> nx.DiGraph | TopologySettings:
    """Return the graph or the topology that a file holds.

    Raises
    ------
    ValueError
        If the file holds neither.
    """
    content = read_file(path)
    if isinstance(content, nx.Graph):
        return content
    try:
        settings = parse(content)
    except RecursionError:
        raise ValueError(f"{path}: is nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    for key in ("communication", "lookahead", "decision_order", "fill_in", "failures"):
        if key in settings.model_fields_set:
            raise ValueError(f"{path}: {key} belongs in the [topology] table of the spec")
    return settings


def _names_at(
    agents: Names, groups: Sequence[Sequence[int]], key: str, size: int | None = None
) -> Bodies:
    """Return the names of agents in groups of their indices; refuse other values."""
    indices = range(len(agents))
    named = []
    for k, group in enumerate(groups):
        try:
            named.append(tuple(agents[indices.index(i)] for i in group))
        except (TypeError, ValueError):
            named.append(())
        if len(named[-1]) != (size or len(named[-1]) or 1):
            allowed = f"{size or 'groups of'} agent indices, 0 to {len(agents) - 1}"
            raise ValueError(f"{key}[{k}] = {quote(group)}: must be {allowed}")
    return named


def _arguments(kind: str, text: str) -> Keys:
    """Return the settings that ``"kind:text"`` gives."""
    if kind not in ARGUMENTS:
        raise ValueError(f"takes no argument, received {text!r}")
    read_as = ARGUMENTS[kind][1]
    if callable(read_as):
        return read_as(text)
    is_number = TOPOLOGIES.model(kind).model_fields[read_as].annotation is int
    return {read_as: int(text) if is_number and text.removeprefix("-").isdecimal() else text}
