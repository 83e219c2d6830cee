"""Sentences of a report: the verdict, one line for each condition, and the methods paragraph."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain

from ...core.plugins.words import show
from ..presentation.progress import count
from ..presentation.tables import SummaryTable
from ..results.analysis import Analysis
from ..results.notation import format_estimate
from ..results.permutation_tests import LEVEL
from ..results.recovery import RECOVERED
from ..results.statistics import Estimate, exactly
from ..spec.tables import SpecTable

SIZES = {"robots": "robot", "carts": "cart", "joints": "joint"}
"""Keys of scenarios that give the number of bodies, and the name of one."""
MAX_CONDITIONS = 12
"""Maximum number of conditions that are described in a sentence each."""
MAX_NAMED = 3
"""Maximum number of conditions that are named together."""


def main_title(table: SummaryTable) -> str:
    """Return the heading of the success rate, or of the return where no success is defined.

    It is that of the evaluation or of the end of training, if the table has it; empty if the table
    has none.
    """
    titles = [title for title in table.titles if "difference" not in title]
    rates = [t for t in titles if "success" in t] or [t for t in titles if "return" in t]
    most = (title for title in rates if "evaluation" in title or "at the end" in title)
    return next(most, rates[0] if rates else "")


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
    shown = {format_estimate(estimate) for estimate in tied.values()}
    text = shown.pop() if len(shown) == 1 else format_estimate(exactly(value))
    return f"{_joined([*tied])}, {text}"


def _joined(names: Sequence[str]) -> str:
    """Return the first names, and how many more there are.

    >>> _joined("abcde")
    'a and b and c and 2 more'
    """
    more = [f"{len(names) - MAX_NAMED} more"] * (len(names) > MAX_NAMED)
    return " and ".join([*names[:MAX_NAMED], *more])


def significant(analysis: Analysis) -> str:
    """Return the number of significant differences in words; empty if nothing was compared."""
    compared = [d.p < LEVEL for d in chain.from_iterable(analysis.differences.values())]
    if not compared:
        return ""
    verb = "is" if 1 in (sum(compared), len(compared)) else "are"
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
    settings: Mapping[str, SpecTable],
    extent: str,
    table: SummaryTable,
    *,
    is_compared: bool,
) -> list[str]:
    """Return the methods paragraph of a study, a sentence each.

    Parameters
    ----------
    settings
        Settings of its conditions, by label.
    extent
        Conditions, seeds and episodes in words.
    table
        Its table.
    is_compared
        Whether the page compares conditions.
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
    learners = [condition["learner"] for condition in own]
    sentences.append(f"Learner: {_kinds(learners)}.")
    if searches := _distinct(_search(one["decision"]) for one in learners if "decision" in one):
        sentences.append(f"Search over joint actions: {'; '.join(searches)}.")
    sentences += _failures(settings)
    sentences.append(f"Extent: {extent}.")
    if table.lines:
        sentences.append(" ".join(map(str.strip, table.legend)))
    if meaning := table.meanings.get(RECOVERED.heading):
        sentences.append(f"{RECOVERED.heading.capitalize()}: {meaning}.")
    if is_compared:
        sentences.append(
            "Conditions are paired by seed, which determines the initial states of every "
            "episode. p-values are adjusted by Holm's method, intervals are not."
        )
    return sentences


def _search(decision: SpecTable) -> str:
    """Return the evaluator of a learner, its settings and its budget as text."""
    evaluator = dict(decision["evaluator"])
    kind = evaluator.pop("kind")
    own = ", ".join(f"{key} = {show(value)}" for key, value in evaluator.items())
    budget = decision["budget"]
    limit = "" if budget is None else f", at most {budget} joint actions a decision"
    return f"{kind} ({own}){limit}" if own else f"{kind}{limit}"


def _failures(settings: Mapping[str, SpecTable]) -> list[str]:
    """Return a sentence on failures; none without failures.

    Each failure has its conditions in parentheses, unless all conditions have it.
    """
    conditions: dict[str, list[str]] = {}
    for condition, own in settings.items():
        listed = (*own["scenario"].get("failures", ()), *own["topology"]["failures"])
        for text in _distinct(map(_failure, listed)):
            conditions.setdefault(text, []).append(condition)
    texts = [
        text if len(names) == len(settings) else f"{text} ({_joined(names)})"
        for text, names in conditions.items()
    ]
    if not texts:
        return []
    return [f"Failures, by training episode counted from 0: {'; '.join(texts)}."]


def _failure(own: SpecTable) -> str:
    """Return a failure as text: its kind, what fails, its settings, and its time.

    >>> _failure({"kind": "seized", "wheels": ["robot1.left"], "episode": 8, "end_episode": 11})
    'seized, wheels robot1.left, from episode 8 until episode 11 begins'
    """
    rest = dict(own)
    start = _moment(rest.pop("episode"), rest.pop("step", 0))
    end, end_step = rest.pop("end_episode"), rest.pop("end_step", 0)
    parts = [rest.pop("kind", "failure")]
    for key, value in rest.items():
        shown = ", ".join(map(str, value)) if isinstance(value, list) else value
        parts += [] if shown is None else [f"{key} {shown}"]
    until = "on" if end is None else f"until {_moment(end, end_step)}"
    if end is not None and not end_step:
        until += " begins"
    return f"{', '.join(parts)}, from {start} {until}"


def _moment(episode: int, step: int) -> str:
    return f"step {step} of episode {episode}" if step else f"episode {episode}"


def _kinds(tables: Iterable[SpecTable]) -> str:
    return ", ".join(_distinct(str(table["kind"]) for table in tables))


def _body_counts(scenarios: Sequence[SpecTable]) -> str:
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
