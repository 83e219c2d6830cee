"""Controls: conditions that learn nothing and show the effect of learning by comparison.

A control differs from the team that it controls in learning alone. Under the tables of a spec (see
`for_control`) it keeps the keys that say how agents decide and predict: the rule, the value,
the evaluator, the predictor and the horizon.

Where predicted rewards count, *zero weights plan*: success of a team that has learned is then no
sign of learning. Where they do not count, zero weights make all values equal, and as ties are
random, frozen weights and random actions are one control.
"""

from collections.abc import Iterable, Mapping
from textwrap import wrap

from ...core.learners import LEARNERS, LearnerSettings
from ...core.plugins.words import show
from ...topologies.names import join_names
from ..errors import WIDTH
from .tables import SpecTable, TomlTable

LEARN_NOTHING = ("frozen", "written")
"""Kinds of learners that do not learn."""
WITH_REWARDS = ("reward", "reward-and-value")
"""Rules of decision by which zero weights plan."""
MOST_NAMES = 3
"""Conditions that a remark names."""

Settings = SpecTable
"""The settings of a condition as a table."""


def control_of(condition: str, settings: Mapping[str, Settings]) -> str | None:
    """Return the condition that differs from one that learns in learning alone.

    None if there is none. Zero weights tie under any rule without rewards: there every frozen
    condition of the same scenario is one.

    Parameters
    ----------
    condition
        The one that learns.
    settings
        Of all conditions, by label.
    """
    team = settings[condition]
    for label, own in settings.items():
        is_frozen = own["learner"]["kind"] == "frozen" and own["scenario"] == team["scenario"]
        if is_frozen and _decision_of(own) == _decision_of(team):
            return label
    return None


TROUBLESHOOTING = "docs/troubleshooting.md"
"""Page that says what to try if a team does not learn."""


def random_control(condition: str, settings: Mapping[str, Settings]) -> str | None:
    """Return the condition that acts at random in the scenario of another one, if there is one."""
    scenario = settings[condition]["scenario"]
    for label, own in settings.items():
        is_random = own["learner"]["kind"] == "frozen" and _rule_of(own) == "random"
        if is_random and own["scenario"] == scenario:
            return label
    return None


def is_drawn(settings: Settings) -> bool:
    """Return whether a condition that learns nothing draws actions at random, if only by ties."""
    return settings["learner"]["kind"] == "frozen" and _rule_of(settings) not in WITH_REWARDS


def _rule_of(settings: Settings) -> object:
    """Return the rule of decision; None of a learner without."""
    return settings["learner"].get("decision", {}).get("rule")


def _decision_of(settings: Settings) -> object:
    """Return what tells how zero weights decide."""
    learner = settings["learner"]
    rule = _rule_of(settings)
    if rule not in WITH_REWARDS:
        return rule == "random"
    return settings["topology"], learner["decision"], learner.get("predictor")


def control_lines(settings: Mapping[str, Settings]) -> tuple[str, ...]:
    """Return `planning_remark` in lines that fit a terminal; none if there is nothing to say."""
    remark = planning_remark(settings)
    return () if remark is None else tuple(wrap(remark, WIDTH, subsequent_indent="  "))


def planning_remark(settings: Mapping[str, Settings]) -> str | None:
    """Return that zero weights plan, too, and what to judge learning by; None: they do not.

    Parameters
    ----------
    settings
        Of all conditions, by label.
    """
    planning = [
        condition
        for condition, own in settings.items()
        if own["learner"]["kind"] not in LEARN_NOTHING and _rule_of(own) in WITH_REWARDS
    ]
    if not planning:
        return None
    names = join_names(planning, MOST_NAMES)
    rules = dict.fromkeys(_rule_of(settings[condition]) for condition in planning)
    why = f"untrained weights plan by the reward under rule = {', '.join(map(show, rules))}"
    frozen = (control_of(condition, settings) for condition in planning)
    controls = list(dict.fromkeys(filter(None, frozen)))
    if not controls:
        return (
            f"{names}: {why}, and no control learns nothing under the same: judge learning by the "
            "difference to one of preset = 'frozen' with the same learner.decision"
        )
    return f"{names}: {why}; judge learning by the difference to {join_names(controls, MOST_NAMES)}"


def for_control(control: SpecTable, user: SpecTable) -> SpecTable:
    """Return tables of a user without the keys that tune learning, if a learner is a control.

    A control that is defined by its rule of decision, as ``random`` and ``planner`` are, keeps it.

    Parameters
    ----------
    control
        The table of the learner; tables are unchanged if its kind learns.
    user
        The tables below, which were written for learners, too.
    """
    if control.get("kind") not in LEARN_NOTHING or "learner" not in user:
        return user
    fields = LEARNERS.model(control["kind"]).model_fields.keys() - {"kind"}
    kept: TomlTable = {key: value for key, value in user["learner"].items() if key in fields}
    if "rule" in control.get("decision", {}) and isinstance(kept.get("decision"), Mapping):
        kept["decision"] = {k: v for k, v in kept["decision"].items() if k != "rule"}
    return {**user, "learner": kept}


def tuning_keys(keys: Iterable[str]) -> list[str]:
    """Return the dotted keys that tune learning, sorted.

    Examples
    --------
    >>> tuning_keys(["learner.ridge", "learner.decision.rule"])
    ['learner.ridge']
    """
    learner = (key for key in keys if key.startswith("learner."))
    fields = LearnerSettings.model_fields
    return sorted({key for key in learner if key.split(".")[1] not in fields})
