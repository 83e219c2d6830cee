"""Who is above whom: builders, specs, checks and pictures of hierarchies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import networkx as nx
import numpy as np

from ..core.hierarchy import Hierarchy
from ..core.protocols import Scenario
from ..core.robot_agents import per_robot
from ..core.single_agent import SingleAgent
from . import builders, files
from .builders import from_networkx
from .checks import check_names
from .config import KINDS, PerRobotSettings, SingleAgentSettings, Topology, TopologySettings, parse

Groups = Sequence[Sequence[str]]
Build = Callable[[Any, Sequence[str], Groups], nx.DiGraph]


def _chain(settings: Any, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
    orders = {
        "listed": tuple(agents),
        "reversed": tuple(reversed(agents)),
        "interleaved": builders.interleaved(groups),
    }
    order = orders[settings.order] if isinstance(settings.order, str) else settings.order
    check_names(order, agents, "order")
    return builders.chain(order)


def _teams(settings: Any, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
    members = groups if settings.members is None else settings.members
    check_names(builders.names_of(members), agents, "members")
    return builders.teams(members, settings.link)


def _file(settings: Any, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
    settings.check_unchanged()
    return from_networkx(files.read_graph(settings.path), agents)


def _python(settings: Any, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
    settings.check_unchanged()
    function = files.from_python(settings.source)
    return from_networkx(files.called(function, agents, groups), agents)


def _package(settings: Any, agents: Sequence[str], groups: Groups) -> nx.DiGraph:
    settings.check_unchanged()
    function = files.from_package(settings.name)
    return from_networkx(files.called(function, agents, groups), agents)


# A topology: its settings in config.py, its builder in builders.py, and a line here.
BUILDERS: dict[str, Build] = {
    "chain": _chain,
    "tree": lambda s, agents, groups: builders.tree(agents, s.branching),
    "star": lambda s, agents, groups: builders.star(agents, s.leader),
    "teams": _teams,
    "independent": lambda s, agents, groups: builders.independent(agents),
    "edges": lambda s, agents, groups: builders.from_edges(agents, s.edges, s.alone),
    "random": lambda s, agents, groups: builders.random_hierarchy(agents, s.seed, s.density),
    "file": _file,
    "python": _python,
    "package": _package,
}
"""What makes the graph of each kind of settings: ``(settings, agents, groups) -> graph``."""


def build(
    settings: TopologySettings,
    agents: Sequence[str],
    groups: Sequence[Sequence[int]] | None = None,
) -> Hierarchy:
    """Build the hierarchy of `settings` over named agents.

    Parameters
    ----------
    settings
        Any topology's settings but those of agents for several wheels.
    agents
        Distinct names, in agent order.
    groups
        Agent indices, from 0, by body (robot), each once; none: every agent is a body of its own.

    Raises
    ------
    ValueError
        If the settings or the groups do not fit the agents, or the settings do not make a
        hierarchy. One line; it names the culprit.

    Examples
    --------
    >>> build(parse("chain:reversed"), ["a", "b", "c"])
    Hierarchy(3 agents: b -> a, c -> b)
    >>> build(parse("teams"), ["a1", "a2", "b1", "b2"], [(0, 1), (2, 3)])
    Hierarchy(4 agents: a1 -> a2, a1 -> b1, b1 -> b2)
    """
    kind = str(getattr(settings, "kind", None))
    if kind not in BUILDERS:
        other = isinstance(settings, SingleAgentSettings | PerRobotSettings)
        hint = "; use topologies.arrange" if other else ""
        raise ValueError(f"topology {kind!r} is no hierarchy of {len(agents)} agents{hint}")
    try:
        if not agents:
            raise ValueError("no agents")
        named = [(a,) for a in agents] if groups is None else _named(agents, groups)
        return Hierarchy(agents, BUILDERS[kind](settings, agents, named).edges)
    except ValueError as error:
        said = str(error).removeprefix("hierarchy: ").removeprefix(f"{settings.title}: ")
        raise ValueError(f"topology {settings.title!r}: {said}") from None


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


def arrange(settings: TopologySettings, scenario: Scenario) -> tuple[Scenario, Hierarchy]:
    """Return a scenario and the hierarchy of its agents, as `settings` want them.

    The scenario is the given one, except for the single agent and for agents of whole robots, which
    see it as a scenario of their own.

    Raises
    ------
    ValueError
        As `build` does, or if there are too many actions for one agent.
    """
    if isinstance(settings, SingleAgentSettings):
        scenario = SingleAgent(scenario)
        return scenario, Hierarchy(scenario.agents, [])
    if isinstance(settings, PerRobotSettings):
        scenario = per_robot(scenario)
        return scenario, Hierarchy(scenario.agents, builders.chain(scenario.agents).edges)
    return scenario, build(settings, scenario.agents, scenario.groups)


__all__ = [
    "BUILDERS", "KINDS", "Hierarchy", "Topology", "TopologySettings", "arrange", "build",
    "from_networkx", "parse",
]  # fmt: skip
