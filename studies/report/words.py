"""What a report says in sentences: how far the study is, who fared best, what it was made with."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..presentation.words import count
from ..results.summary import Summary, interval, two_figures
from ..spec.outline import Outline
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
MOST_NAMED = 4
"""Conditions that one clause names before it only counts them."""


def runs(values: Iterable[int]) -> str:
    """Return whole numbers in order, runs of three or more by their ends.

    >>> runs([0, 1, 2, 3, 7, 9, 8, 20]), runs([1, 0])
    ('0 to 3, 7 to 9, 20', '0, 1')
    """
    blocks: list[list[int]] = []
    for value in sorted(values):
        if blocks and value == blocks[-1][-1] + 1:
            blocks[-1].append(value)
        else:
            blocks.append([value])
    parts = [
        f"{block[0]} to {block[-1]}" if len(block) > 2 else ", ".join(map(str, block))
        for block in blocks
    ]
    return ", ".join(parts)


def extent(outline: Outline) -> str:
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


def standing(total: int, done: int, failed: int) -> str:
    """Return how far a study is."""
    if done == total:
        return f"All {count(total, 'trial')} are done." if total > 1 else "Its one trial is done."
    left = total - done - failed
    parts = [f"{done} of {count(total, 'trial')} {'is' if done == 1 else 'are'} done"]
    parts += [f"{failed} failed"] * bool(failed) + [f"{left} left"] * bool(left)
    what = "What follows is of those done." if done else "There is nothing to show yet."
    return f"{'Unfinished' if left else 'With failures'}: {', '.join(parts)}. {what}"


def verdicts(analysis: Any) -> str:
    """Return who fares best, of every group of conditions that are to be compared.

    An analysis whose conditions differ in size, too, offers their summaries by size as `groups`.
    """
    headline = getattr(analysis, "headline", None)
    groups = getattr(analysis, "groups", None) or {"": analysis.table}
    texts = {name: contest(lines, headline) for name, lines in groups.items()}
    return " ".join(f"{name}: {text}" if name else text for name, text in texts.items() if text)


def contest(table: Sequence[Summary], headline: str | None) -> str:
    """Return who is highest in one estimate, and whose intervals lie apart from the highest's.

    Parameters
    ----------
    table
        The lines of the study's table.
    headline
        Title of the estimate; if none or not in the table, its first one.

    Examples
    --------
    >>> from nested_agents.studies.results.statistics import Estimate
    >>> e = {"ours": (0.9, 0.8, 0.95), "frozen": (0.1, 0.0, 0.3), "other": (0.85, 0.7, 0.9)}
    >>> table = [Summary(k, 8, {"success": Estimate(*map(np.asarray, v))}) for k, v in e.items()]
    >>> contest(table, "success")
    'success: highest is ours, .90 [.80–.95]. Interval wholly below: frozen .10 [0–.30]. Interval \
overlapping: other .85 [.70–.90].'
    """
    titles = list(dict.fromkeys(title for line in table for title in line.estimates))
    if not titles:
        return ""
    title = headline if headline in titles else titles[0]
    lines = [s for s in table if title in s.estimates and not np.isnan(s.estimates[title].value)]
    if not lines:
        return ""
    lines.sort(key=lambda s: -float(s.estimates[title].value))
    best, *others = lines
    if not others:
        seeds = count(best.seeds, "seed")
        return f"{title}: {_named(best, title)} over {seeds}."
    floor = best.estimates[title].low
    groups: dict[str, list[Summary]] = {"wholly below": [], "overlapping": [], "not known": []}
    for line in others:
        if np.isnan(floor) or np.isnan(line.estimates[title].high):
            groups["not known"].append(line)
        else:
            below = line.estimates[title].high < floor
            groups["wholly below" if below else "overlapping"].append(line)
    verdict = f"{title}: highest is {_named(best, title, ', ')}."
    for what, group in groups.items():
        if group:
            more = f" and {len(group) - MOST_NAMED} more" if len(group) > MOST_NAMED else ""
            named = ", ".join(_named(s, title) for s in group[:MOST_NAMED])
            verdict += f" Interval{'s' * (len(group) > 1)} {what}: {named}{more}."
    return verdict


def _named(line: Summary, title: str, between: str = " ") -> str:
    estimate = line.estimates[title]
    around = "" if np.isnan(estimate.low) else f" [{interval(estimate)}]"
    return f"{line.condition}{between}{two_figures(float(estimate.value))}{around}"


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
