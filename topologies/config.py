"""Topologies as they stand in a spec: a ``[topology]`` table, or a string.

A string is ``"kind"`` or ``"kind:argument"``, see `parse`. A further topology is one function in
`builders` and one line in `TOPOLOGIES`; its keyword-only parameters are its settings. What may
follow ``kind:`` is in `ARGUMENTS`.

Users bring hierarchies as files of graphs and teams, in Python files, and in installed packages. A
user's topology is a function ``(agents, bodies) -> graph``. It is given the names of the agents and
the same names by body (robot), and returns a networkx DiGraph over all agents, or pairs (superior,
subordinate); an agent in no pair stands alone.
"""

from __future__ import annotations

import json
import tomllib
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from inspect import iscoroutine
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import model_validator

from ..core.coordination.graphs import Shape, oriented
from ..core.hierarchy.failures import AbsentAgents, AnyMessageFailure
from ..core.hierarchy.hierarchy import Considers, Hierarchy, Told
from ..core.numerics import nx
from ..core.plugins import registry, sources
from ..core.plugins.registry import Plugged, SettingsRegistry
from ..core.plugins.settings import Settings, SettingsError, tuples, unwritten
from ..core.plugins.words import closest
from .builders import (
    Bodies,
    Names,
    check_legible,
    check_names,
    from_networkx,
    independent,
    names_of,
    shown,
    with_edges,
)

BUILDERS = "nested_agents.topologies.builders"
BUILT = (
    "chain", "tree", "star", "teams", "independent", "simultaneous", "coordination-graph",
)  # fmt: skip
"""Topologies whose builder is called so."""


Oriented = Literal["listed", "reversed"] | tuple[str, ...]
"""In which order agents decide: that of the scenario, its reverse, or all names."""


class TopologySettings(Settings):
    """What the settings of all topologies share."""

    kind: str = ""
    told: Annotated[Told, unwritten("ancestors")] = "ancestors"
    """By whom an agent is told what was decided: all above it, its direct superiors, or nobody; or
    a list of the bodies in which those above it tell it: its own ``body``, those ``next`` to it in
    the order of bodies, those ``farther`` away."""
    considers: Annotated[Considers, unwritten("descendants")] = "descendants"
    """Whose actions an agent tries beside its own: those of all below it, of its direct
    subordinates, or of nobody; or a list of bodies, as above, in which those below it are."""
    oriented: Annotated[Oriented | None, unwritten(None)] = None
    """In which order those decide who are joined by undirected edges: in the agents' own, in its
    reverse, or as listed by name; each is above those of its neighbours that come later. None: they
    decide at once."""
    fill_in: Annotated[bool, unwritten(False)] = False
    """Whether those who are above one agent are joined, too, from the last one that decides to the
    first: then the best that an agent can do depends on nobody else who has decided."""
    failures: Annotated[tuple[AnyMessageFailure, ...], unwritten(())] = ()
    """What fails of the messages down the hierarchy, from when to when."""

    @model_validator(mode="after")
    def _check_relations(self) -> Self:
        if self.told == "none" and not all(isinstance(f, AbsentAgents) for f in self.failures):
            raise ValueError(
                "told = 'none': there are no messages to fail, failures must be absent"
            )
        if self.fill_in and self.oriented is None:
            raise ValueError("fill_in = true: needs oriented, in which order agents decide")
        return self

    def __repr_args__(self) -> Iterable[tuple[str | None, Any]]:
        written = self.model_dump()
        return [(name, value) for name, value in super().__repr_args__() if name in written]

    @property
    def title(self) -> str:
        """What it is called in messages: its file, its kind, or its class."""
        return getattr(self, "path", "") or self.kind or type(self).__name__

    def build(self, agents: Names, bodies: Bodies) -> Any:
        """Return the graph over named agents, given by body too."""
        raise ValueError("has no kind, and makes no hierarchy")


IMPLIED = {"members": "teams", "edges": "edges"}
"""Kinds of tables that have none, by a key that they have."""

TOPOLOGIES = SettingsRegistry(
    "topology",
    {name: f"{BUILDERS}:{name.replace('-', '_')}" for name in BUILT}
    | {"edges": f"{BUILDERS}:from_edges", "random": f"{BUILDERS}:random_hierarchy"}
    | {"file": f"{__name__}:from_file"},
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
    table without a kind that has `members` is one of teams, one that has `edges` of these.

    Raises
    ------
    ValueError
        If the kind is unknown or its argument not allowed; one line.

    Examples
    --------
    >>> parse("tree:3"), parse("chain")
    (TopologySettings(kind='tree', branching=3), TopologySettings(kind='chain', order='listed'))
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
            return TOPOLOGIES.parsed(text)
    except ValueError as error:
        raise ValueError(f"topology {text!r}: {getattr(error, 'problem', error)}") from None
    if "." in kind or "/" in kind:
        folder = sources.active().folder
        is_there = folder is not None and (folder / text).exists()
        suffixes = f"suffix must be {', '.join(sources.GRAPHS)} or .py:NAME"
        raise ValueError(f"topology {text!r}: {'' if is_there else 'no such file; '}{suffixes}")
    unknown = f"{closest(kind, TOPOLOGIES.names())}, or a file"
    raise ValueError(f"topology {text!r}: {TOPOLOGIES.moved.get(kind, unknown)}")


def _of_table(table: Mapping[str, Any]) -> TopologySettings:
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
"""Any topology's settings: a table distinguished by `kind`, or a string for `parse`."""


def build(
    settings: TopologySettings | str | Mapping[str, Any],
    agents: Sequence[str],
    bodies: Sequence[Sequence[int]] | None = None,
    interactions: Sequence[tuple[int, int]] | None = None,
) -> Hierarchy:
    """Build the hierarchy of `settings` over named agents.

    Parameters
    ----------
    settings
        Any topology's settings; or a text or a table for `parse`.
    agents
        Distinct names, in agent order.
    bodies
        Agent indices, from 0, by body (robot), each once; none: every agent is a body of its own.
    interactions
        Pairs of agents, by index, whose actions matter to each other: what ``shape = "scenario"``
        of a coordination graph joins.

    Raises
    ------
    ValueError
        If the settings or the bodies do not fit the agents, or the settings do not make a
        hierarchy. One line; it names the culprit.

    Examples
    --------
    >>> build(parse("chain:reversed"), ["a", "b", "c"])
    Hierarchy(3 agents: b -> a, c -> b)
    >>> build(parse("teams"), ["a1", "a2", "b1", "b2"], [(0, 1), (2, 3)])
    Hierarchy(4 agents: a1 -> a2, a1 -> b1, b1 -> b2)
    """
    if not isinstance(settings, TopologySettings):
        settings = parse(settings)
    title = settings.title
    named: Bodies = [(a,) for a in agents]
    try:
        if not agents:
            raise ValueError("no agents")
        if bodies is not None:
            named = _named(agents, bodies)
        if interactions is not None and getattr(settings, "shape", "") == "scenario":
            pairs = tuple((agents[a], agents[b]) for a, b in interactions)
            settings = settings.model_copy(update={"edges": pairs})
        if settings.kind in TOPOLOGIES.built_in:
            graph = settings.build(agents, named)
        else:
            graph = call_builder(settings.build, title.rpartition(":")[2], agents, named)
            graph = from_networkx(graph, agents, neighbours=True)
        graph = _directed(graph, settings, agents)
        edges, neighbours = (graph.edges, ()) if graph.is_directed() else ((), graph.edges)
        return Hierarchy(agents, edges, neighbours, settings.told, settings.considers, named)
    except ValueError as error:
        problem = str(error)
        for start in ("hierarchy: ", f"{title}: ", f"topology {title!r}: "):
            problem = problem.removeprefix(start)
        is_of_user = settings.kind not in TOPOLOGIES.built_in
        given = f" (given {len(agents)} agents of {len(named)} bodies)" if is_of_user else ""
        raise ValueError(f"topology {title!r}: {problem}{given}") from None


def from_file(agents: Names, bodies: Bodies = (), *, path: str) -> nx.DiGraph:
    """Read a graph or nested teams from a GraphML, JSON or TOML file.

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
    return from_networkx(content, agents, neighbours=True)


def _directed(graph: nx.Graph, settings: TopologySettings, agents: Names) -> nx.Graph:
    """Return a graph with its undirected edges oriented, if the settings say how."""
    order = settings.oriented
    if order is None:
        if settings.kind == "file" and not graph.is_directed():
            raise ValueError(
                "the graph is undirected: who is above whom? set topology.oriented = 'listed', or "
                "all names in the order of decision"
            )
        return graph
    if graph.is_directed():
        raise ValueError(f"oriented = {shown(order)}: the edges are directed already, leave it out")
    names = {"listed": tuple(agents), "reversed": tuple(reversed(agents))}
    listed = names[order] if isinstance(order, str) else order
    check_names(listed, agents, "oriented")
    return oriented(graph, listed, fill_in=settings.fill_in)


def read(path: str) -> nx.DiGraph | TopologySettings:
    """Return what a file holds: a graph, or another topology.

    Raises
    ------
    ValueError
        If it holds neither.
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
    for key in ("told", "considers", "oriented", "fill_in", "failures"):
        if key in settings.model_fields_set:
            raise ValueError(f"{path}: {key} must stand in the [topology] table of the spec")
    return settings


def _named(agents: Names, bodies: Sequence[Any]) -> Bodies:
    """Return the names of agents given by index, by body; refuse what is no index."""
    indices = range(len(agents))
    try:
        named = [[agents[indices.index(i)] for i in body] for body in bodies]
    except (TypeError, ValueError):
        allowed = f"agent indices by body, 0 to {len(agents) - 1}"
        raise ValueError(f"bodies = {shown(bodies)}: must be {allowed}") from None
    check_names(names_of(named), agents, "bodies")
    return named


def _order(text: str) -> dict[str, Any]:
    """Read a word, or all names separated by commas."""
    if text in ("listed", "reversed", "interleaved"):
        return {"order": text}
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise ValueError(f"order must be written a,b,c, received {text!r}")
    return {"order": names}


def _neighbours(text: str) -> dict[str, Any]:
    """Read a shape, or pairs of names as ``a-b,b-c``."""
    if text in ("scenario", *get_args(Shape)):
        return {"shape": text}
    pairs = _split(text, "-")
    for pair in pairs:
        if len(pair) != 2 or not all(pair):
            raise ValueError(
                f"must be {', '.join(get_args(Shape))}, or pairs a-b, received {'-'.join(pair)!r}"
            )
    return {"edges": pairs}


def _edges(text: str) -> dict[str, Any]:
    """Read ``"a>b,b>c,d"``: edges, and agents that stand alone."""
    parts = _split(text, ">")
    for part in parts:
        if len(part) > 2 or not all(part):
            raise ValueError(f"an edge must be written a>b, received {'>'.join(part)!r}")
    alone = tuple(part[0] for part in parts if len(part) == 1)
    return {"edges": tuple(part for part in parts if len(part) == 2), "alone": alone}


def _split(text: str, sign: str) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(name.strip() for name in part.split(sign)) for part in text.split(","))


ARGUMENTS: dict[str, tuple[str, str | Callable[[str], dict[str, Any]]]] = {
    "chain": ("reversed|interleaved|NAME,NAME,...", _order),
    "tree": ("BRANCHING", "branching"),
    "star": ("LEADER", "leader"),
    "teams": ("star", "link"),
    "coordination-graph": ("line|ring|tree|grid|scenario|A-B,B-C,...", _neighbours),
    "edges": ("A>B,B>C,D", _edges),
    "random": ("SEED", "seed"),
    "file": ("PATH.graphml|PATH.json|PATH.toml", "path"),
}
"""By kind what may follow ``kind:``, in words, and the setting that it is or how it is read."""


def _arguments(kind: str, text: str) -> dict[str, Any]:
    """Return the settings that stand in ``"kind:text"``."""
    if kind not in ARGUMENTS:
        raise ValueError(f"takes no argument, received {text!r}")
    read_as = ARGUMENTS[kind][1]
    if callable(read_as):
        return read_as(text)
    is_number = TOPOLOGIES.model(kind).model_fields[read_as].annotation is int
    return {read_as: int(text) if is_number and text.removeprefix("-").isdecimal() else text}


def read_file(path: str) -> nx.DiGraph | dict[str, Any]:
    """Read a graph, or a topology as it stands in a spec, from GraphML, JSON or TOML by suffix.

    JSON and TOML hold a table, perhaps under ``topology``: of edges, ``{"edges": [["a", "b"], ...],
    "alone": [...]}``, of nested teams, ``{"members": [...]}``, or with the key ``kind``. In GraphML
    an agent is named by its node's id.

    Returns
    -------
    networkx.DiGraph or dict
        The graph, or the table.

    Raises
    ------
    ValueError
        If the file cannot be read or holds neither.
    """
    suffix = Path(path).suffix
    if suffix not in sources.GRAPHS:
        raise ValueError(f"{path}: suffix must be .graphml, .json or .toml")
    text = sources.active().text(path)
    try:
        if suffix == ".graphml":
            graph = nx.parse_graphml(text, node_type=_name)
            check_legible(graph)
            return graph
        return _table_of(tomllib.loads(text) if suffix == ".toml" else json.loads(text))
    except RecursionError:
        raise ValueError(f"{path} holds no graph: it is nested too deeply") from None
    except (
        ValueError, KeyError, TypeError, AttributeError, SyntaxError, nx.NetworkXException
    ) as error:  # fmt: skip
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path} holds no graph: {reason}") from None


def call_builder(build: Callable[..., Any], name: str, agents: Names, bodies: Bodies) -> nx.Graph:
    """Return the graph that a user's function of this name makes.

    Raises
    ------
    ValueError
        If it raises, returns neither a graph nor pairs, or not the same ones twice.
    """
    graph, again = (_called(build, name, agents, bodies) for _ in range(2))
    if set(graph.edges) != set(again.edges):
        raise ValueError(
            f"{name} returned another hierarchy when called again; random numbers must be drawn "
            "from a seed of its own"
        )
    return graph


def _called(build: Callable[..., Any], name: str, agents: Names, bodies: Bodies) -> nx.Graph:
    most = len(agents) ** 2
    try:
        result = build(tuple(agents), tuple(tuple(body) for body in bodies))
        if isinstance(result, nx.Graph):
            list(map(str, result))  # an object of the user's may refuse to
            return result
        edges = _pairs(result, most)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        ours = {__file__, registry.__file__}
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename not in ours]
        # Of the user's file, whatever library it has called.
        lines = [f.lineno for f in frames if f.filename == frames[0].filename]
        where = f" in line {lines[-1]}" if lines else ""
        raise ValueError(
            f"{name} raised {type(error).__name__}{where}: {sources.message(error)}"
        ) from None
    if edges is None:
        raise ValueError(
            f"{name} returned {type(result).__name__}, allowed: a networkx DiGraph, a Graph "
            "of neighbours, or a list of nothing but pairs (superior, subordinate)"
        )
    if len(edges) > most:
        raise ValueError(f"{name} gave more than {most} pairs of {len(agents)} agents")
    return with_edges(independent(agents), edges)


def _pairs(result: Any, most: int) -> list[tuple[str, str]] | None:
    """Return pairs of names, one more than `most` at most; None if it holds something else."""
    if not isinstance(result, Iterable):
        if iscoroutine(result):
            result.close()  # or Python says that nobody has awaited it
        return None
    pairs = list(islice(result, most + 1))
    if not all(isinstance(pair, Collection) and len(pair) == 2 for pair in pairs):
        return None
    return [(str(superior), str(subordinate)) for superior, subordinate in pairs]


def _table_of(content: Any) -> dict[str, Any]:
    """Return the topology's table that a file holds."""
    if isinstance(content, dict) and isinstance(content.get("topology"), dict):
        content = content["topology"]
    if not isinstance(content, dict) or not {"kind", "members", "edges"} & content.keys():
        raise ValueError("it must be a table with one of the keys edges, members and kind")
    if content.get("kind") == "file":
        raise ValueError("kind = 'file': a file cannot name another one")
    check_legible(_names([content.get(key) for key in ("members", "edges", "alone")]))
    return content


def _names(content: Any) -> Iterator[str]:
    """Yield the texts in lists, at any depth."""
    if isinstance(content, str):
        yield content
    for part in content if isinstance(content, list) else ():
        yield from _names(part)


def _name(text: str | None) -> str:
    """Return what GraphML calls an agent; networkx would call it None if there is nothing."""
    if text is None:
        raise ValueError("a node has no id, or an edge no source or target")
    return text
