"""Sentences of a report: the verdict, one line for each condition, and the methods paragraph."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

from ..presentation.progress import count
from ..presentation.tables import SummaryTable
from ..results.analysis import Analysis
from ..results.notation import format_estimate
from ..results.permutation_tests import LEVEL
from ..results.statistics import Estimate, exactly
from ..spec.outline import StudyOutline

SIZES = {"robots": "robot", "carts": "cart", "joints": "joint"}
"""Keys of scenarios that give the number of bodies, and the name of one."""
MAX_CONDITIONS = 12
"""Maximum number of conditions that are described in a sentence each."""
MAX_TIED = 3
"""Maximum number of conditions of equal value that are named."""


def main_title(table: SummaryTable) -> str:
    """Return the heading of the success rate, or of the return where no success is defined.

    Evaluation precedes training. The result is empty if the table has neither.
    """
    titles = [title for title in table.titles if "difference" not in title]
    rates = [t for t in titles if "success" in t] or [t for t in titles if "return" in t]
    return next((title for title in rates if "evaluation" in title), rates[0] if rates else "")


def verdict(table: SummaryTable, title: str, analysis: Analysis) -> tuple[str, ...]:
    """Return the main result of a study in one sentence; nothing without results."""
    lines = [line for line in table.lines if title in line.estimates]
    if not lines:
        return ()
    estimates = {line.condition: line.estimates[title] for line in lines}
    values = [float(estimate.value) for estimate in estimates.values()]
    subject = title.capitalize()
    if len(lines) == 1:
        return (f"{subject} is {format_estimate(*estimates.values())}.",)
    highest, lowest = (_holders(estimates, limit) for limit in (max(values), min(values)))
    text = f"{subject} is highest with {highest}, and lowest with {lowest}"
    if highest == lowest:
        text = f"{subject} is the same with {highest}"
    compared = significant(analysis)
    return (f"{text}; {compared}." if compared else f"{text}.",)


def _holders(estimates: Mapping[str, Estimate], value: float) -> str:
    """Return the conditions that have a value, and the value, as text.

    The value has its interval if that is the same for all of them.
    """
    tied = {c: e for c, e in estimates.items() if math.isclose(e.value, value, abs_tol=1e-12)}
    names = [*tied][:MAX_TIED]
    names += [f"{len(tied) - MAX_TIED} more"] * (len(tied) > MAX_TIED)
    shown = {format_estimate(estimate) for estimate in tied.values()}
    text = shown.pop() if len(shown) == 1 else format_estimate(exactly(value))
    return f"{' and '.join(names)}, {text}"


def significant(analysis: Analysis) -> str:
    """Return the number of significant differences in words; empty if nothing was compared."""
    compared = [d.p < LEVEL for d in chain.from_iterable(analysis.differences.values())]
    if not compared:
        return ""
    verb = "is" if sum(compared) == 1 else "are"
    return f"{sum(compared)} of {count(len(compared), 'difference')} {verb} significant"


def condition_sentences(table: SummaryTable, title: str, analysis: Analysis) -> list[str]:
    """Return a sentence for each condition: its result, and its differences from the reference."""
    sentences = []
    for line in table.lines[:MAX_CONDITIONS]:
        if title not in line.estimates:
            continue
        value = format_estimate(line.estimates[title])
        text = f"{line.condition}: {title} is {value} over {count(line.seeds, 'seed')}"
        for difference in chain.from_iterable(analysis.differences.values()):
            if difference.condition == line.condition:
                text += f"; difference in {difference.measure} {difference.shown}"
        sentences.append(f"{text}.")
    return sentences


def methods(
    outline: StudyOutline,
    settings: Mapping[str, Mapping[str, Any]],
    extent: str,
    *,
    is_compared: bool,
) -> list[str]:
    """Return the methods paragraph of a study, a sentence each.

    Parameters
    ----------
    outline
        The study.
    settings
        Settings of its conditions, by label.
    extent
        Conditions, seeds and episodes in words.
    is_compared
        Whether the study compares conditions.
    """
    own = list(settings.values())
    scenarios = [condition["scenario"] for condition in own]
    topologies = [condition["topology"] for condition in own]
    sentences = [f"Task: {_kinds(scenarios)}{_body_counts(scenarios)}."]
    agents = _distinct(condition.get("agents") or "actuator" for condition in own)
    granularity = (
        "the whole team" if agents == ["team"] else " or ".join(f"each {a}" for a in agents)
    )
    sentences.append(f"Hierarchy: {_kinds(topologies)}, with one agent for {granularity}.")
    sentences.append(f"Learner: {_kinds([condition['learner'] for condition in own])}.")
    sentences.append(f"Extent: {extent}.")
    if len(outline.seeds) > 1:
        sentences.append("Statistics: means over seeds with 95% confidence intervals.")
        if is_compared:
            sentences.append(
                "Conditions are paired by seed, which determines the initial states of every "
                "episode. p-values are adjusted by Holm's method, intervals are not."
            )
    return sentences


def _kinds(tables: Iterable[Mapping[str, Any]]) -> str:
    return ", ".join(_distinct(str(table["kind"]) for table in tables))


def _body_counts(scenarios: Sequence[Mapping[str, Any]]) -> str:
    """Return the numbers of bodies as text, such as " with 2, 4 robots".

    It is that of the first key in `SIZES` that a scenario sets; empty if none does.
    """
    for key, name in SIZES.items():
        sizes = sorted({table[key] for table in scenarios if isinstance(table.get(key), int)})
        if sizes:
            plural = "" if sizes == [1] else "s"
            return f" with {', '.join(map(str, sizes))} {name}{plural}"
    return ""


def _distinct(values: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(values))
