"""What a report says in sentences: how far the study is, and what it was made with."""

import platform
import re
from collections.abc import Iterable

import numpy as np

from ..errors import show
from ..presentation.words import count
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


def extent(outline: StudyOutline) -> str:
    """Return what a study consists of."""
    after = ""
    if outline.evaluation:
        longest = outline.table.get("evaluation_steps")
        after = f", {count(outline.evaluation, 'evaluation episode')} after them"
        after += f" of up to {count(longest, 'step')}" if longest else ""
        others = len(outline.table.get("evaluations", ()))
        each = "another scenario" if others == 1 else f"each of {others} other scenarios"
        after += f" and as many in {each}" if others else ""
    return (
        f"{count(len(outline.columns), 'condition')} × {count(len(outline.seeds), 'seed')}, each "
        f"{outline.lengths.replace('episode', 'training episode')} of up to "
        f"{count(outline.steps, 'step')}{after}"
    )


def topologies(outline: StudyOutline) -> dict[str, str]:
    """Return the topologies that a spec names, as it writes them, failures included, by where."""
    own = {o["name"]: o for o in outline.table.get("overrides", ())}
    tables = {"every condition": outline.table} | own | dict(outline.table.get("evaluations", {}))
    return {
        name: show(t["topology"], width=None) for name, t in tables.items() if t.get("topology")
    }


def standing(total: int, done: int, failed: int) -> str:
    """Return how far a study is."""
    if done == total:
        return f"All {count(total, 'trial')} are done." if total > 1 else "Its one trial is done."
    left = total - done - failed
    parts = [f"{done} of {count(total, 'trial')} {'is' if done == 1 else 'are'} done"]
    parts += [f"{failed} failed"] * bool(failed) + [f"{left} left"] * bool(left)
    what = "What follows is of those done." if done else "There is nothing to show yet."
    return f"{'Unfinished' if left else 'With failures'}: {', '.join(parts)}. {what}"


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
