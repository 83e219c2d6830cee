"""Arguments of topologies that are written as strings, such as ``"tree:3"``."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, get_args

from ..core.search.coordination_graphs import Shape

Keys: TypeAlias = dict[str, object]
"""Settings by name."""


def _order(text: str) -> Keys:
    """Read an order by name, or all names separated by commas."""
    if text in ("listed", "reversed", "interleaved"):
        return {"order": text}
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise ValueError(f"order must be written a,b,c, received {text!r}")
    return {"order": names}


def _neighbors(text: str) -> Keys:
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


def _edges(text: str) -> Keys:
    """Read edges and single agents from a text such as ``"a>b,b>c,d"``."""
    parts = _split(text, ">")
    for part in parts:
        if len(part) > 2 or not all(part):
            raise ValueError(f"an edge must be written a>b, received {'>'.join(part)!r}")
    alone = tuple(part[0] for part in parts if len(part) == 1)
    return {"edges": tuple(part for part in parts if len(part) == 2), "alone": alone}


def _split(text: str, sign: str) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(name.strip() for name in part.split(sign)) for part in text.split(","))


ARGUMENTS: dict[str, tuple[str, str | Callable[[str], Keys]]] = {
    "chain": ("reversed|interleaved|NAME,NAME,...", _order),
    "tree": ("BRANCHING", "branching"),
    "star": ("LEADER", "leader"),
    "teams": ("star", "link"),
    "coordination-graph": ("line|ring|tree|grid|scenario|A-B,B-C,...", _neighbors),
    "edges": ("A>B,B>C,D", _edges),
    "random": ("SEED", "seed"),
    "file": ("PATH.graphml|PATH.json|PATH.toml", "path"),
}
"""For each kind, a description of its argument, and the setting it gives or its parser."""
