"""Named starting points of a spec: a scenario, a topology and a learner, see ``presets.toml``.

A preset lists the settings that differ from the defaults of the settings models. The tables of a
spec override those of its preset. `frozen`, `random` and `planner` are the controls of a learning
curve.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .tables import SpecTable

PRESETS: dict[str, SpecTable] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
"""Every preset by name: the tables `scenario`, `topology` and `learner` as in a spec; `summary`, a
description in one line; and `other_scenarios`, changes for scenarios of another kind."""
