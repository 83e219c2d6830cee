"""Calls of users' functions that build hierarchies, with checks of what they return."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Collection, Iterable
from inspect import iscoroutine
from itertools import islice
from typing import TypeAlias

from ..core.numerics import nx
from ..core.plugins import registry, settings, sources
from .builders import Bodies, Names, independent, with_edges

Build: TypeAlias = Callable[[Names, Bodies], object]
"""Function from names of agents, and these by body, to a graph or to pairs of names."""


def call_builder(build: Build, name: str, agents: Names, bodies: Bodies) -> nx.Graph:
    """Return the graph that a user's function builds.

    Raises
    ------
    ValueError
        If the function raises, returns neither a graph nor pairs, or returns something else when it
        is called again.
    """
    graph, again = (_called(build, name, agents, bodies) for _ in range(2))
    if set(graph.edges) != set(again.edges):
        raise ValueError(
            f"{name} returned another hierarchy when called again; random numbers must be drawn "
            "from a seed of its own"
        )
    return graph


def _called(build: Build, name: str, agents: Names, bodies: Bodies) -> nx.Graph:
    most = len(agents) ** 2
    try:
        result = build(tuple(agents), tuple(tuple(body) for body in bodies))
        if isinstance(result, nx.Graph):
            list(map(str, result))  # a user's nodes may have no text
            return result
        edges = _pairs(result, most)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        ours = {__file__, registry.__file__, settings.__file__}
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename not in ours]
        # Lines of the user's file, not of the libraries that it calls.
        lines = [f.lineno for f in frames if f.filename == frames[0].filename]
        where = f" in line {lines[-1]}" if lines else ""
        raise ValueError(
            f"{name} raised {type(error).__name__}{where}: {sources.message(error)}"
        ) from None
    if edges is None:
        raise ValueError(
            f"{name} returned {type(result).__name__}, allowed: a networkx DiGraph, a Graph "
            "of neighbors, or a list of pairs (superior, subordinate)"
        )
    if len(edges) > most:
        raise ValueError(f"{name} gave more than {most} pairs of {len(agents)} agents")
    return with_edges(independent(agents), edges)


def _pairs(result: object, most: int) -> list[tuple[str, str]] | None:
    """Return at most ``most + 1`` pairs of names; None if the result holds something else."""
    if not isinstance(result, Iterable):
        if iscoroutine(result):
            result.close()  # avoids a warning that it was never awaited
        return None
    pairs = list(islice(result, most + 1))
    if not all(isinstance(pair, Collection) and len(pair) == 2 for pair in pairs):
        return None
    return [(str(superior), str(subordinate)) for superior, subordinate in pairs]
