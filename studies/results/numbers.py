"""Numbers that trials keep beside the measures of their episodes: units, and how they are shown."""

from __future__ import annotations

from typing import NamedTuple

from ...core.interface.measures import Measure


class Number(NamedTuple):
    """What a number of a trial is.

    Attributes
    ----------
    unit
        In which it is kept.
    meaning
        In a line.
    """

    unit: str
    meaning: str


NUMBERS = {
    "agents": Number("1", "number of agents"),
    "robots": Number("1", "number of bodies that agents move"),
    "messages": Number(
        "1", "messages in a decision: edges of the transitive closure of the hierarchy"
    ),
    "joint_actions": Number("1", "joint actions that the team tries in a decision"),
    "rule_evaluations": Number("1", "values of rule bases that the team computes in a decision"),
    "formula": Number("1", "operations of a decision by formula: Eq. 18, or joint actions x rules"),
    "counted": Number("1", "rule evaluations of a decision as they were counted"),
    "memory": Number("kB", "consequent weights of the team"),
    "period": Number("s", "time for which a decision is held"),
    "weights": Number("1", "number of consequent weights"),
    "decision_median": Number("s", "median time of a decision of the whole team"),
    "decision_99": Number("s", "99th percentile of that time"),
    "team_bytes": Number("B", "arrays that the team remembers at the end"),
    "weight_bytes": Number("B", "consequent weights among them"),
    "step_bytes": Number("B", "memory that a step takes beside them"),
    "process_bytes": Number("B", "peak of resident memory of the worker while it trained"),
    "period_s": Number("s", "time for which a decision is held"),
    "least_touching": Number("1", "share of contact of the robot that touches the box least"),
    "all_touching": Number(
        "1",
        "share of evaluation episodes in which every robot is in contact for at least half of the "
        "time in which any robot is",
    ),
    "onset": Number("1", "episode in which the first failure begins"),
}
"""Numbers by the name of their column; those of a study of one's own are not among them."""

_SHOWN = {
    name: (Measure(name, title, "ms", better="lower", least=0.0), 1e3)
    for name, title in (
        ("decision_median", "decision"),
        ("decision_99", "99th percentile of decisions"),
    )
}


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
    if name in _SHOWN:
        return _SHOWN[name]
    unit = "s" if name.startswith("seconds.") else "1"
    return Measure(name, name, NUMBERS[name].unit if name in NUMBERS else unit), 1.0
