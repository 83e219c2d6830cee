"""Numbers that trials keep beside the measures of their episodes: units, and how they are shown."""

from __future__ import annotations

from ...core.interface.measures import Measure

NUMBERS = {
    "agents": ("1", "number of agents"),
    "robots": ("1", "number of bodies that agents move"),
    "messages": ("1", "messages in a decision: edges of the hierarchy's transitive closure"),
    "joint_actions": ("1", "joint actions that the team tries in a decision"),
    "formula": ("1", "operations of a decision by formula: Eq. 18, or joint actions x rules"),
    "counted": ("1", "rule evaluations of a decision as they were counted"),
    "memory": ("kB", "consequent weights of the team"),
    "period": ("s", "time for which a decision is held"),
    "decision_median": ("s", "median time of a decision of the whole team"),
    "decision_99": ("s", "99th percentile of that time"),
    "team_bytes": ("B", "arrays that the team remembers at the end"),
    "weight_bytes": ("B", "consequent weights among them"),
    "step_bytes": ("B", "memory that a step takes beside them"),
    "process_bytes": ("B", "peak of resident memory of the worker while it trained"),
    "period_s": ("s", "time for which a decision is held"),
    "least_touching": ("1", "share of contact of the robot that touches the box least"),
    "all_touching": (
        "1",
        "share of evaluation episodes in which every robot is in contact for at least half of the "
        "time in which any robot is",
    ),
    "onset": ("1", "episode in which the first failure begins"),
}
"""Unit in which numbers are kept, and what they mean, by the name of their column; those of a study
of one's own are not among them."""

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
