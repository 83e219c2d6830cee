"""What a report says of a study and of what it was made with, where its template does not."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterable

import numpy as np

from ..errors import show
from ..spec.outline import StudyOutline
from ..workers.worker import installed

PACKAGES = (
    "nested-agents",
    "Box2D",
    "joblib",
    "matplotlib",
    "networkx",
    "numba",
    "numpy",
    "pydantic",
    "scipy",
    "shapely",
)
"""The packages that results and figures come from."""


def runs(values: Iterable[int]) -> str:
    """Return whole numbers in order, runs of three or more by their ends.

    >>> runs([0, 1, 2, 3, 7, 9, 8, 20]), runs([1, 0])
    ('0 to 3, 7 to 9, 20', '0, 1')
    """
    ordered = np.array(sorted(values), dtype=np.int64)
    blocks = np.split(ordered, np.flatnonzero(np.diff(ordered) != 1) + 1)
    parts = [
        f"{block[0]} to {block[-1]}" if len(block) > 2 else ", ".join(map(str, block))
        for block in blocks
    ]
    return ", ".join(parts)


def topologies(outline: StudyOutline) -> dict[str, str]:
    """Return the topologies that a spec names, as it writes them, failures included, by where."""
    own = {o["name"]: o for o in outline.table.get("overrides", ())}
    tables = {"every condition": outline.table} | own | dict(outline.table.get("evaluations", {}))
    return {
        name: show(t["topology"], width=None) for name, t in tables.items() if t.get("topology")
    }


def versions() -> list[tuple[str, str]]:
    """Return name and version of the software that is running, and the platform in words."""
    machine = f"{platform.system()} on {platform.machine()}"
    python = platform.python_implementation(), platform.python_version()
    return [python, *((name, installed(name)) for name in PACKAGES), ("platform", machine)]


def without_places(text: str) -> str:
    """Return text in which absolute paths keep their last two parts only.

    >>> without_places('File "/home/me/lib/core/team.py", line 3')
    'File "…/core/team.py", line 3'
    """
    return re.sub(r"(?<![\w.…/:])/(?:[^\s\"':/]+/)+(?=[^\s\"':/]+/[^\s\"':/]+)", "…/", text)
