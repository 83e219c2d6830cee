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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from textwrap import wrap
from time import process_time
from types import CodeType, FrameType, TracebackType
from typing import NamedTuple, Self

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
from ..spec.tables import label_but
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


class Profile(NamedTuple):
    """Profile of one condition."""

    condition: str
    group: str
    """Label of the condition without its size."""
    agents: int
    evaluator: str
    """Search method; for teams without search, the kind of learner."""
    decisions: int
    """Number of timed decisions."""
    tried: float
    """Joint actions tried per decision."""
    formula: int
    """Joint actions by the formula."""
    seconds: Mapping[str, float]
    """Time per decision by part [s]."""
    budget: int | None = None
    """Maximum number of joint actions per decision; None: no limit."""

    @property
    def deciding(self) -> float:
        """Time of a decision [s]."""
        return sum(self.seconds[part] for part in DECIDING)


@dataclass(frozen=True)
class ProfileTable:
    """Profiles of conditions; printed or shown by a notebook."""

    rows: tuple[Profile, ...]

    @property
    def frame(self) -> pd.DataFrame:
        """A row for each condition; times of parts [s]."""
        rows = [{**row._asdict(), **row.seconds} for row in self.rows]
        return pd.DataFrame(rows).drop(columns=["seconds", "group"])

    def __str__(self) -> str:
        return "\n".join(_lines(self.rows))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def profile(spec: Spec | Mapping[str, object] | Path | str, seconds: float = 1.0) -> ProfileTable:
    """Profile the decisions of every condition of a study; nothing is kept.

    Parameters
    ----------
    spec
        A `Spec`, a table, or the path of a TOML file.
    seconds
        Time for each condition after compilation and a few steps of learning [s].

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
            sizes = [k for k, v in condition.columns.items() if type(v) is int]
            names = condition.label, label_but(condition.columns, sizes)
            rows.append(_profile(names, own, spec.steps, seconds))
    return ProfileTable(tuple(rows))


def _profile(names: tuple[str, str], own: Arrangement, steps: int, wanted: float) -> Profile:
    """Return the profile of a condition with its label and that of its group."""
    team = own.team
    for _ in control_loop(own.scenario, team, episodes=2, steps=min(BEGINNING, steps), seed=SEED):
        pass
    before = team.counts.joint_actions
    sensing = 0.0
    reported = 0.0
    decisions = 0
    episodes = 0
    with Sampler() as sampler:
        for record in control_loop(
            own.scenario, team, episodes=10**9, steps=steps, seed=SEED, first_episode=2
        ):
            decisions += 1
            episodes += record.last
            seconds = record.transition.info.get("seconds", {})
            sensing += seconds.get("sensors", 0.0)
            reported += sum(seconds.values())
            spent = sum(sampler.seconds.values())
            if spent > wanted and (episodes or spent > LONGEST * wanted):
                break
    each = {part: sampler.seconds[part] / decisions for part in PARTS}
    each["sense"] = each["world"] * sensing / (reported or 1.0)
    each["world"] -= each["sense"]
    return Profile(
        *names,
        agents=len(team.hierarchy),
        evaluator=search_method(team),
        decisions=decisions,
        tried=(team.counts.joint_actions - before) / decisions,
        formula=team.hierarchy.count_joint_actions(len(team.action_set)),
        budget=budget_of(team),
        seconds=each,
    )


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


class Sampler:
    """Samples processor time by part while its context is active.

    Attributes
    ----------
    seconds
        Processor time by part [s].
    """

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PARTS, 0.0)
        self._parts: dict[CodeType, str] = {}
        self._last = 0.0

    def __enter__(self) -> Self:
        self._former = signal.signal(signal.SIGALRM, self._ask)
        self._last = process_time()
        signal.setitimer(signal.ITIMER_REAL, INTERVAL, INTERVAL)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, self._former)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        now = process_time()
        part = self._part(frame)
        if part:
            self.seconds[part] += now - self._last
        self._last = now

    def _part(self, frame: FrameType | None) -> str:
        """Return the running part; empty outside a step of the control loop."""
        room = ""
        within = None
        while frame is not None and frame.f_code is not control_loop.__code__:
            room = room or self._room(frame.f_code)
            within = frame.f_code
            frame = frame.f_back
        if frame is None:
            return ""
        if within is None or within is Team.act.__code__:
            return room or "messages"
        if within is Team.learn.__code__:
            return "learn"
        return "" if within.co_name == "reset" else "world"

    def _room(self, code: CodeType) -> str:
        if code not in self._parts:
            path = Path(code.co_filename)
            inside = path.relative_to(PACKAGE).as_posix() if path.is_relative_to(PACKAGE) else ""
            known = (part for room, part in ROOMS.items() if inside.startswith(f"{room}/"))
            self._parts[code] = next(known, "")
        return self._parts[code]


HEADS = ("condition", "evaluator", "tried", "formula", "ms", "us each")


def _lines(rows: Sequence[Profile]) -> Iterator[str]:
    """Yield the tables of counts and of times by part, then sentences on growth."""
    is_limited = any(row.budget is not None for row in rows)
    counted = [[*HEADS, "budget"] if is_limited else [*HEADS]]
    timed: list[tuple[str, ...]] = [("ms", *PARTS)]
    for row in rows:
        each = _figures(1e6 * row.deciding / row.tried) if row.tried else "-"
        tried = format_count(round(row.tried), 10**7)
        formula = format_count(row.formula, 10**7)
        ms = _figures(1e3 * row.deciding)
        counted.append([row.condition, row.evaluator, tried, formula, ms, each])
        if is_limited:
            counted[-1].append("-" if row.budget is None else f"{row.budget:,}")
        timed.append((row.condition, *(_figures(1e3 * row.seconds[part]) for part in PARTS)))
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
    yield from _growth(rows)


def _figures(value: float) -> str:
    return "-" if value == 0.0 else format_number(value)


def _growth(rows: Sequence[Profile]) -> Iterator[str]:
    """Yield a sentence for each group on the growth of time from its smallest to largest team."""
    groups: dict[str, list[Profile]] = {}
    for row in rows:
        groups.setdefault(row.group, []).append(row)
    for group, own in groups.items():
        first = min(own, key=lambda row: row.agents)
        last = max(own, key=lambda row: row.agents)
        if first.agents == last.agents or not first.tried:
            continue
        tried = last.tried / first.tried
        longer = last.deciding / first.deciding
        shares = {part: last.seconds[part] / last.deciding for part in DECIDING}
        most = max(shares, key=shares.__getitem__)
        text = (
            f"{f'{group}: ' * bool(group)}{first.agents} to {last.agents} agents: decisions take "
            f"{format_number(longer)} times as long: {format_number(tried)} times the joint "
            f"actions, each {format_number(longer / tried)} times as long. The largest part is "
            f"{most} ({shares[most]:.0%})"
        )
        yield from wrap(f"{text}; {_evaluators(own)}.", WIDTH, subsequent_indent="  ")


def _evaluators(rows: Sequence[Profile]) -> str:
    """Return the search methods, and which of them try as many joint actions as the formula."""
    names = list(dict.fromkeys(row.evaluator for row in rows))
    others = [row for row in rows if round(row.tried) != row.formula]
    if not others:
        return "as many as by the formula"
    agents = ", ".join(str(row.agents) for row in others)
    return f"{' then '.join(names)}: not as by the formula with {agents} agents"
