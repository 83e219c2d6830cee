"""Columns of results: their units and meanings, see ``columns.toml``, and how numbers are shown."""

import tomllib
from pathlib import Path

from ...core.interface.measures import Measure

_TABLES = tomllib.loads(Path(__file__).with_name("columns.toml").read_text(encoding="utf-8"))
EPISODE_COLUMNS, TRIAL_COLUMNS, NUMBERS = (
    {name: (unit, meaning) for name, (unit, meaning) in table.items()} for table in _TABLES.values()
)
"""Unit and meaning by name: of the columns of episodes that every scenario has, of those of trials,
and of numbers of whole trials."""

_TITLES = {"decision_median": "decision", "decision_99": "99th percentile of decisions"}
"""Headings of numbers that are shown in milliseconds."""


def shown(name: str) -> tuple[Measure, float]:
    """Return how a number is shown, and by what it is multiplied for that.

    Examples
    --------
    >>> measure, factor = shown("decision_median")
    >>> measure.unit, factor
    ('ms', 1000.0)
    >>> shown("messages")[0].unit
    '1'
    """
    if name in _TITLES:
        return Measure(name, _TITLES[name], "ms", better="lower", least=0.0), 1e3
    unit = "s" if name.startswith("seconds.") else "1"
    return Measure(name, name, NUMBERS[name][0] if name in NUMBERS else unit), 1.0
