"""Checks that name the culprit: which agent is unknown, missing or named twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from ..core.plugins.deferred import nx


def check_names(
    names: Sequence[str], agents: Sequence[str], what: str, *, all_needed: bool = True
) -> None:
    """Refuse `names` that are not the agents, each once.

    Parameters
    ----------
    names
        The names to check.
    agents
        The agents there are.
    what
        The argument that `names` stands in, for the message.
    all_needed
        Whether every agent must be among the names.

    Raises
    ------
    ValueError
        If a name is unknown, occurs twice or is missing.
    """
    known = set(agents)
    for name, times in Counter(names).items():
        if name not in known:
            raise ValueError(f"unknown agent {shown(name)} in {what}, known: {listed(agents)}")
        if times > 1:
            raise ValueError(f"agent {shown(name)} occurs more than once in {what}")
    missing = known.difference(names)
    if all_needed and missing:
        first = next(agent for agent in agents if agent in missing)
        raise ValueError(f"agent {first!r} is missing from {what}")


def check_legible(names: Iterable[object]) -> None:
    """Refuse what is no name: neither text nor a whole number, empty, or not to be printed.

    Raises
    ------
    ValueError
        If a name is so; escaped and shortened.
    """
    for name in names:
        is_name = isinstance(name, str | int) and not isinstance(name, bool)
        if not is_name or not str(name) or not str(name).isprintable():
            raise ValueError(f"{shown(name)} is no name of an agent, allowed: printable text")


def shown(value: object, most: int = 60) -> str:
    r"""Return a value for a message, in `most` characters at most, none of them special.

    Examples
    --------
    >>> shown("a\nb"), shown("n" * 100, most=10)
    ("'a\\nb'", "'nnnnnn...")
    """
    text = ascii(value) if not isinstance(value, str) or not value.isprintable() else repr(value)
    return text if len(text) <= most else text[: most - 3] + "..."


def with_edges(graph: nx.DiGraph, edges: Iterable[Sequence[str]]) -> nx.DiGraph:
    """Add (superior, subordinate) pairs to a graph, which is modified; refuse one given twice."""
    for superior, subordinate in edges:
        if graph.has_edge(superior, subordinate):
            raise ValueError(f"edge {superior} -> {subordinate} is given more than once")
        graph.add_edge(superior, subordinate)
    return graph


def listed(names: Iterable[str], most: int = 12) -> str:
    """Return names for a message, the first `most` of them.

    Examples
    --------
    >>> listed("abcd", most=2)
    'a, b, ... (4)'
    """
    names = list(names)
    return ", ".join(names[:most]) + (f", ... ({len(names)})" if len(names) > most else "")
