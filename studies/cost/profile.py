"""Profile of decisions: processor time by part, and the number of joint actions tried.

This is a sampling profiler. While a team acts and learns as in a trial, a timer of the operating
system interrupts at short intervals, and the processor time since the last interrupt counts for the
part of the program that is running. The results of the team therefore do not change. Compiled code
counts for its caller: where one compiled call predicts, values and searches, all of it counts as
prediction.

The joint actions that the evaluator tries are compared with the formula (Eq. 18), which assumes
exact enumeration.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from textwrap import wrap
from time import process_time
from types import CodeType, FrameType

from ...core.agents.fuzzy import FuzzyAgents
from ...core.agents.loop import control_loop
from ...core.agents.team import Team
from ...core.numerics import pd
from ...core.search.enumeration import AutoSettings
from ...core.search.evaluator import Aggregation
from ...topologies.view import align, format_count
from ..errors import WIDTH, SpecError
from ..results.notation import format_number
from ..spec.spec import Spec
from ..trials.arrangement import Arrangement, arrange, check_conditions

PACKAGE = Path(__file__).parents[2]
"""Folder of the package."""
SEED = 10_000
"""Seed of environments and team, which no study reports."""
INTERVAL = 0.001
"""Sampling interval [s]."""
BEGINNING = 5
"""Steps of each of two episodes that compile everything and learn before timing begins."""
LONGEST = 5.0
"""Maximum factor on the requested time, which may be exceeded to reach the end of an episode."""
MOST_SECONDS = 3600.0

DECIDING = ("predict", "value", "search", "messages")
"""Parts of a decision: predicting next states, valuing them, searching, passing messages."""
PARTS = (*DECIDING, "learn", "world", "sense")
"""All parts: those of a decision, learning, the step of the environment, and sensing."""
ROOMS = {
    "core/models": "predict",
    "core/interface": "predict",
    "scenarios": "predict",
    "core/values": "value",
    "core/networks": "value",
    "core/learners": "value",
    "core/search": "search",
    "core/agents": "messages",
    "core/hierarchy": "messages",
}
"""Part of a decision that the code of each folder belongs to; other code counts for its caller."""


def profile(spec: Spec | Mapping[str, object] | Path | str, seconds: float = 1.0) -> pd.DataFrame:
    """Profile the decisions of every condition of a study; nothing is kept.

    Parameters
    ----------
    spec
        A `Spec`, a table, or the path of a TOML file.
    seconds
        Time for each condition after compilation and a few steps of learning [s].

    Returns
    -------
    DataFrame
        A row for each condition: agents; evaluator, the search method, or the kind of learner of a
        team without search; timed decisions; joint actions tried per decision, by formula and at
        most; and processor time per decision of each of `PARTS` [s].

    Raises
    ------
    SpecError
        If the study cannot be run, there is no timer, or the time is out of range.
    """
    spec = Spec.read(spec)
    if not 0.0 < seconds <= MOST_SECONDS:
        raise SpecError(f"--seconds {seconds:g}: must be above 0 and at most {MOST_SECONDS:g}")
    if sys.platform == "win32" or threading.current_thread() != threading.main_thread():
        raise SpecError("profile: needs the timer of Linux or macOS, and the main thread")
    check_conditions(spec)
    rows = []
    with spec.sources.active():
        for condition in spec.conditions():
            own = arrange(condition.settings, SEED)
            rows.append({"condition": condition.label, **_profile(own, spec.steps, seconds)})
    return pd.DataFrame(rows, dtype=object)


def _profile(own: Arrangement, steps: int, wanted: float) -> dict[str, object]:
    """Return the profile of a condition by column."""
    team = own.team
    for _ in control_loop(own.scenario, team, episodes=2, steps=min(BEGINNING, steps), seed=SEED):
        pass
    before = team.counts.joint_actions
    sensing = 0.0
    reported = 0.0
    decisions = 0
    episodes = 0
    with sample_parts() as sampled:
        for record in control_loop(
            own.scenario, team, episodes=10**9, steps=steps, seed=SEED, first_episode=2
        ):
            decisions += 1
            episodes += record.last
            seconds = record.transition.info.get("seconds", {})
            sensing += seconds.get("sensors", 0.0)
            reported += sum(seconds.values())
            spent = sum(sampled.values())
            if spent > wanted and (episodes or spent > LONGEST * wanted):
                break
    each = {part: sampled[part] / decisions for part in PARTS}
    each["sense"] = each["world"] * sensing / (reported or 1.0)
    each["world"] -= each["sense"]
    return {
        "agents": len(team.hierarchy),
        "evaluator": search_method(team),
        "decisions": decisions,
        "tried": (team.counts.joint_actions - before) / decisions,
        "formula": team.hierarchy.count_joint_actions(len(team.action_set)),
        "budget": budget_of(team),
        **each,
    }


def budget_of(team: Team) -> int | None:
    """Return the joint actions that a team may try in a decision; None if a part has no limit."""
    total = 0
    for part in team.parts:
        budget = part.settings.decision.budget if isinstance(part, FuzzyAgents) else None
        if budget is None:
            return None
        total += budget
    return total


def search_method(team: Team) -> str:
    """Return the search methods of a team, or the kinds of learners that do not search."""
    methods = []
    for part in team.parts:
        if not isinstance(part, FuzzyAgents):
            methods.append(type(part).__name__)
        elif not isinstance(part.evaluator, Aggregation):
            methods.append(part.settings.kind)
        else:
            settings = part.settings.decision.evaluator
            if isinstance(settings, AutoSettings):
                settings = settings.chosen(part.evaluator.problem)
            methods.append(settings.kind)
    return " ".join(dict.fromkeys(methods))


@contextmanager
def sample_parts() -> Iterator[dict[str, float]]:
    """Sample processor time by part while the context is active [s]."""
    seconds = dict.fromkeys(PARTS, 0.0)
    last = process_time()

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal last
        now = process_time()
        if part := _part(frame):
            seconds[part] += now - last
        last = now

    former = signal.signal(signal.SIGALRM, ask)
    signal.setitimer(signal.ITIMER_REAL, INTERVAL, INTERVAL)
    try:
        yield seconds
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, former)


def _part(frame: FrameType | None) -> str:
    """Return the running part; empty outside a step of the control loop."""
    room = ""
    within = None
    while frame is not None and frame.f_code is not control_loop.__code__:
        room = room or _room(frame.f_code)
        within = frame.f_code
        frame = frame.f_back
    if frame is None:
        return ""
    if within is None or within is Team.act.__code__:
        return room or "messages"
    if within is Team.learn.__code__:
        return "learn"
    return "" if within.co_name == "reset" else "world"


@cache
def _room(code: CodeType) -> str:
    """Return the part of a decision that code belongs to; empty if it counts for its caller."""
    path = Path(code.co_filename)
    inside = path.relative_to(PACKAGE).as_posix() if path.is_relative_to(PACKAGE) else ""
    return next((part for room, part in ROOMS.items() if inside.startswith(f"{room}/")), "")


HEADS = ("condition", "evaluator", "tried", "formula", "ms", "us each")


def lines(profiles: pd.DataFrame) -> Iterator[str]:
    """Yield the tables of counts and of times by part."""
    rows = profiles.to_dict("records")
    is_limited = any(row["budget"] is not None for row in rows)
    counted = [[*HEADS, "budget"] if is_limited else [*HEADS]]
    timed: list[tuple[str, ...]] = [("ms", *PARTS)]
    for row in rows:
        deciding = sum(row[part] for part in DECIDING)
        each = _figures(1e6 * deciding / row["tried"]) if row["tried"] else "-"
        numbers = (format_count(round(row[name]), 10**7) for name in ("tried", "formula"))
        ms = _figures(1e3 * deciding)
        counted.append([row["condition"], row["evaluator"], *numbers, ms, each])
        if is_limited:
            counted[-1].append("-" if row["budget"] is None else f"{row['budget']:,}")
        timed.append((row["condition"], *(_figures(1e3 * row[part]) for part in PARTS)))
    yield from align(counted, "<<>>>>>"[: len(counted[0])])
    yield ""
    yield from align(timed, f"<{'>' * len(PARTS)}")
    yield ""
    yield from wrap(
        "tried: joint actions per decision; formula: joint actions of exact enumeration (Eq. "
        "18); ms: processor time of a decision without learning and the environment; us each: "
        "time per joint action tried.",
        WIDTH,
    )


def _figures(value: float) -> str:
    return "-" if value == 0.0 else format_number(value)
