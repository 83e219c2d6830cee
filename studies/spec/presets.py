"""Named starting points of a spec: a scenario, a topology and a learner, see ``presets.toml``.

A preset lists the settings that differ from the defaults of the settings models. The tables of a
spec override those of its preset. `frozen`, `random` and `planner` are the controls of a learning
curve.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .tables import SpecTable


class Preset(NamedTuple):
    """A named fragment of a spec."""

    summary: str
    """Description in one line."""
    table: SpecTable
    """The tables `scenario`, `topology` and `learner` as in a spec."""
    other_scenarios: SpecTable
    """Changes for scenarios of another kind."""


_TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))

PRESETS = {
    name: Preset(table.pop("summary"), table, table.pop("other_scenarios", {}))
    for name, table in _TABLES.items()
}
"""Every preset by name."""
