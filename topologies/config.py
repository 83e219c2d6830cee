"""The settings of a topology, as they stand in the ``[topology]`` table of a spec, or as a string.

A string is ``"kind"`` or ``"kind:argument"``, see `parse`; each settings class says what its
argument may be. A further topology is one settings class and one line in `TOPOLOGIES`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field
from typing_extensions import TypeAliasType

from ..core.interface.hierarchy import Hierarchy
from ..core.plugins import sources
from ..core.plugins.deferred import Deferred
from ..core.plugins.messages import closest
from ..core.plugins.plugged import Plugged, SettingsRegistry
from ..core.plugins.settings import Fraction, Settings, SettingsError, tuples
from . import builders, files
from .builders import from_networkx
from .checks import check_names

if TYPE_CHECKING:
    import networkx as nx
else:
    nx = Deferred("networkx")

Count = Annotated[int, Field(ge=1)]
Groups = Sequence[Sequence[str]]
Names = tuple[str, ...]
Members = TypeAliasType("Members", "tuple[str | Members, ...]")


class TopologySettings(Settings):
    """What the settings of all topologies share."""

    kind: str = ""

    argument: ClassVar[str] = ""
    """What may follow ``kind:`` in a string, for help texts; empty: nothing."""

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Return the settings that ``"kind:argument"`` stands for."""
        raise ValueError(f"takes no argument, received {argument!r}")

    @property
    def title(self) -> str:
        """What it is called in complaints."""
        return self.kind or type(self).__name__

    def build(self, agents: Sequence[str], groups: Groups) -> Any:
        """Return the graph over named agents, given by body too."""
        raise ValueError("has no kind, and makes no hierarchy")


class ChainSettings(TopologySettings):
    """The paper's nested chain, from the first agent of `order` down to the last."""

    kind: Literal["chain"] = "chain"
    order: Literal["listed", "reversed", "interleaved"] | Names = "listed"
    """The agents' own order, its reverse, wheel by wheel across robots, or all names in order."""

    argument: ClassVar[str] = "reversed|interleaved|NAME,NAME,..."

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the order: a word, or all names separated by commas."""
        if argument in ("listed", "reversed", "interleaved"):
            return cls(**{"order": argument})
        names = _names(argument)
        if not all(names):
            raise ValueError(f"order must be written a,b,c, received {argument!r}")
        return cls(order=names)

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        orders = {
            "listed": tuple(agents),
            "reversed": tuple(reversed(agents)),
            "interleaved": builders.interleaved(groups),
        }
        order = orders[self.order] if isinstance(self.order, str) else self.order
        check_names(order, agents, "order")
        return builders.chain(order)


class TreeSettings(TopologySettings):
    """A tree in which every agent but the last ones has `branching` subordinates."""

    kind: Literal["tree"] = "tree"
    branching: Count = 2
    """Number of subordinates of an agent."""

    argument: ClassVar[str] = "BRANCHING"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the branching."""
        return cls(branching=_integer(argument, "branching"))

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        return builders.tree(agents, self.branching)


class StarSettings(TopologySettings):
    """One leader with everyone else right below it."""

    kind: Literal["star"] = "star"
    leader: str | None = None
    """Name of the leader; none: the first agent."""

    argument: ClassVar[str] = "LEADER"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the leader's name."""
        return cls(leader=argument)

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        return builders.star(agents, self.leader)


class TeamsSettings(TopologySettings):
    """Nested teams: the leaders of a team's members form a chain or a star.

    The leader of a team is that of its first member. Without `members`, the team is one of robots
    of wheels: the first wheels form a chain, each above its own robot's other wheels.
    """

    kind: Literal["teams"] = "teams"
    link: Literal["chain", "star"] = "chain"
    """Whether the leaders of the members of a team form a chain or a star."""
    members: Members | None = None
    """Nested lists of agent names, to any depth; none: the groups (robots) of the scenario."""

    argument: ClassVar[str] = "star"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the link."""
        return cls(**{"link": argument})

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        members = groups if self.members is None else self.members
        check_names(builders.names_of(members), agents, "members")
        return builders.teams(members, self.link)


class IndependentSettings(TopologySettings):
    """Agents that do not see one another."""

    kind: Literal["independent"] = "independent"

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        return builders.independent(agents)


class SimultaneousSettings(TopologySettings):
    """Agents who decide at the same time: each considers what all others might do."""

    kind: Literal["simultaneous"] = "simultaneous"

    def build(self, agents: Sequence[str], groups: Groups) -> nx.Graph:
        """Return the graph, which is undirected."""
        return builders.simultaneous(agents)


class CoordinationGraphSettings(TopologySettings):
    """Neighbours on a line, on a ring or as listed, who decide at the same time."""

    kind: Literal["coordination-graph"] = "coordination-graph"
    shape: Literal["line", "ring"] = "line"
    """In agent order; on a ring the last is a neighbour of the first."""
    edges: tuple[tuple[str, str], ...] | None = None
    """Pairs of neighbours in place of a shape."""

    argument: ClassVar[str] = "line|ring|A-B,B-C,..."

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the shape, or pairs of names as ``a-b,b-c``."""
        if argument in ("line", "ring"):
            return cls.model_validate({"shape": argument})
        pairs = [tuple(name.strip() for name in part.split("-")) for part in argument.split(",")]
        for pair in pairs:
            if len(pair) != 2 or not all(pair):
                raise ValueError(f"must be line, ring, or pairs a-b, received {'-'.join(pair)!r}")
        return cls.model_validate({"edges": tuple(pairs)})

    def build(self, agents: Sequence[str], groups: Groups) -> nx.Graph:
        """Return the graph, which is undirected."""
        return builders.coordination_graph(agents, self.shape, self.edges)


class EdgesSettings(TopologySettings):
    """Any hierarchy, edge by edge."""

    kind: Literal["edges"] = "edges"
    edges: tuple[tuple[str, str], ...]
    """Pairs (superior, subordinate)."""
    alone: Names = ()
    """Agents that are in no edge."""

    argument: ClassVar[str] = "A>B,B>C,D"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read ``"a>b,b>c,d"``: edges, and agents that stand alone."""
        parts = [tuple(n.strip() for n in part.split(">")) for part in argument.split(",")]
        for part in parts:
            if len(part) > 2 or not all(part):
                raise ValueError(f"an edge must be written a>b, received {'>'.join(part)!r}")
        edges = tuple(part for part in parts if len(part) == 2)
        return cls(**{"edges": edges, "alone": [p[0] for p in parts if len(p) == 1]})

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        return builders.from_edges(agents, self.edges, self.alone)


class RandomSettings(TopologySettings):
    """A random hierarchy: each agent above each lower-ranked one with a chance."""

    kind: Literal["random"] = "random"
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of its random numbers."""
    density: Fraction = 0.3
    """Probability of each possible edge."""

    argument: ClassVar[str] = "SEED"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the seed."""
        return cls(seed=_integer(argument, "seed"))

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        return builders.random_hierarchy(agents, self.seed, self.density)


class FileSettings(TopologySettings):
    """A graph or nested teams from a GraphML, JSON or TOML file."""

    kind: Literal["file"] = "file"
    path: str
    """Path of the file, relative to the spec."""

    argument: ClassVar[str] = "PATH.graphml|PATH.json|PATH.toml"

    @classmethod
    def parsed(cls, argument: str) -> Self:
        """Read the path."""
        return cls(path=argument)

    @property
    def title(self) -> str:
        """The path."""
        return self.path

    def build(self, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
        """Return the graph."""
        found = self.content
        if isinstance(found, TopologySettings):
            return found.build(agents, groups)
        return from_networkx(found, agents)

    @property
    def content(self) -> nx.DiGraph | TopologySettings:
        """What the file holds: a graph, or another topology.

        Raises
        ------
        ValueError
            If it holds neither.
        """
        found = files.read(self.path)
        if isinstance(found, nx.Graph):
            return found
        try:
            return parse(found)
        except ValueError as error:
            raise ValueError(f"{self.path}: {error}") from None


TOPOLOGIES = SettingsRegistry(
    "topology",
    {
        "chain": f"{__name__}:ChainSettings",
        "tree": f"{__name__}:TreeSettings",
        "star": f"{__name__}:StarSettings",
        "teams": f"{__name__}:TeamsSettings",
        "independent": f"{__name__}:IndependentSettings",
        "simultaneous": f"{__name__}:SimultaneousSettings",
        "coordination-graph": f"{__name__}:CoordinationGraphSettings",
        "edges": f"{__name__}:EdgesSettings",
        "random": f"{__name__}:RandomSettings",
        "file": f"{__name__}:FileSettings",
    },
    TopologySettings,
    moved={
        "single-agent": "who the agents are has a key of its own: agents = 'team'",
        "per-robot": "who the agents are has a key of its own: agents = 'body', topology = 'chain'",
    },
)
"""Topologies by name."""


def parse(text: str | Mapping[str, Any]) -> TopologySettings:
    """Read a topology from a string, or from a table as it stands in a spec.

    Besides ``"kind"`` and ``"kind:argument"``, a file of a graph or of such a table, a
    ``file.py:function`` and the name of an installed package's topology stand for themselves. A
    table without a kind that has `members` is one of teams.

    Raises
    ------
    ValueError
        If the kind is unknown or its argument not allowed; one line.

    Examples
    --------
    >>> parse("tree:3"), parse("chain")
    (TreeSettings(kind='tree', branching=3), ChainSettings(kind='chain', order='listed'))
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
            model = TOPOLOGIES.model(kind)
            assert issubclass(model, TopologySettings)
            return model.parsed(argument) if colon else model()
        if kind in TOPOLOGIES.moved:
            raise ValueError(TOPOLOGIES.moved[kind])
        if sources.is_file(text):
            return FileSettings(path=text)
        if sources.is_reference(text) or text in TOPOLOGIES.installed():
            found = TOPOLOGIES.parsed(text)
            assert isinstance(found, TopologySettings)
            return found
    except SettingsError as error:
        raise ValueError(f"topology {text!r}: {error.problem}") from None
    except ValueError as error:
        raise ValueError(f"topology {text!r}: {error}") from None
    known = closest(kind, TOPOLOGIES.names())
    raise ValueError(f"topology {text!r}: {known}, or a file")


def _of_table(table: Mapping[str, Any]) -> TopologySettings:
    """Return the settings of a table."""
    kind = table.get("kind", "teams" if "members" in table else None)
    if not isinstance(kind, str):
        raise ValueError(f"topology.kind = {kind!r}: {closest(kind, TOPOLOGIES.names())}")
    try:
        found = TOPOLOGIES.model(kind)(**{**tuples(dict(table)), "kind": kind})
    except SettingsError as error:
        raise ValueError(f"topology.{error.problem}") from None
    except ValueError as error:
        raise ValueError(f"topology.kind = {kind!r}: {error}") from None
    assert isinstance(found, TopologySettings)
    return found


Topology = Annotated[TopologySettings, Plugged(TOPOLOGIES, parse)]
"""Any topology's settings: a table distinguished by `kind`, or a string for `parse`."""


def hierarchy_of(
    settings: TopologySettings,
    agents: Sequence[str],
    groups: Sequence[Sequence[int]] | None = None,
) -> Hierarchy:
    """Build the hierarchy of `settings` over named agents; see `topologies.build`."""
    try:
        if not agents:
            raise ValueError("no agents")
        named = [(a,) for a in agents] if groups is None else _named(agents, groups)
        if settings.kind in TOPOLOGIES.built_in:
            graph = settings.build(agents, named)
        else:
            graph = from_networkx(files.called(settings, agents, named), agents, neighbours=True)
        directed = graph.is_directed()
        return Hierarchy(agents, graph.edges if directed else (), () if directed else graph.edges)
    except ValueError as error:
        said = str(error)
        for start in ("hierarchy: ", f"{settings.title}: ", f"topology {settings.title!r}: "):
            said = said.removeprefix(start)
        raise ValueError(f"topology {settings.title!r}: {said}") from None


def _names(text: str) -> Names:
    return tuple(name.strip() for name in text.split(","))


def _integer(text: str, what: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{what} = {text!r}: must be a whole number") from None


def _named(agents: Sequence[str], groups: Sequence[Any]) -> Groups:
    """Return the names of agents given by index, by group; refuse what is no index."""
    named = []
    for group in groups:
        if isinstance(group, str) or not isinstance(group, Iterable):
            raise ValueError(f"groups: {group!r} is no group, allowed: a sequence of agent indices")
        for i in group:
            if not isinstance(i, int | np.integer) or not 0 <= i < len(agents):
                last = len(agents) - 1
                raise ValueError(f"groups: {i!r} is no agent index, allowed: 0 to {last}")
        named.append([agents[i] for i in group])
    check_names(builders.names_of(named), agents, "groups")
    return named
