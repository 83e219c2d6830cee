"""Whether a file is the spec of a study, and which hierarchies it has."""

from __future__ import annotations

import tomllib
from pathlib import Path

from ...topologies.view import HierarchyView

TOPOLOGY = {"kind", "members", "edges", "nodes"}
"""Keys of a file that holds a topology and no more."""


def of_spec(path: str) -> list[HierarchyView] | None:
    """Return the hierarchies of a study's spec; None if the path is not that of one."""
    if not path.endswith(".toml") or not Path(path).is_file():
        return None
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except ValueError:
        return None  # whoever reads it as a topology says why
    if TOPOLOGY & table.keys() or (list(table) == ["topology"] and "kind" not in table["topology"]):
        return None
    from ..spec.spec import Spec
    from ..trials.hierarchies import views

    return views(Spec.load(Path(path)))
