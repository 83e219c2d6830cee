"""Who is above whom: builders, specs, checks and pictures of hierarchies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..core.interface.hierarchy import Hierarchy
from .builders import from_networkx
from .config import TOPOLOGIES, Topology, TopologySettings, hierarchy_of, parse


def build(
    settings: TopologySettings | str | Mapping[str, Any],
    agents: Sequence[str],
    groups: Sequence[Sequence[int]] | None = None,
) -> Hierarchy:
    """Build the hierarchy of `settings` over named agents.

    Parameters
    ----------
    settings
        Any topology's settings; or a text or a table for `parse`.
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
    made = settings if isinstance(settings, TopologySettings) else parse(settings)
    return hierarchy_of(made, agents, groups)


__all__ = [
    "TOPOLOGIES", "Hierarchy", "Topology", "TopologySettings", "build", "from_networkx", "parse",
]  # fmt: skip
