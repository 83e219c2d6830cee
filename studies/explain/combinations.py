"""What goes with what: every built-in learner against every other part of a condition, by trying.

A cell is a learner and one case of an axis: a topology, say, or a failure of messages. It is a
trial of a few decisions, which is trained, evaluated and, where teams are kept, restored. Then it
runs; or what the case asks for is left out, as the learner knows nothing of it; or it is refused.
The sentence that says why is that of the warning, or of the refusal itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from ...core.learners import LEARNERS, LearnerSettings
from ..errors import SpecError
from ..spec.spec import Spec
from ..store.durable import TEAM
from ..trials.arrangement import check_conditions
from ..trials.session import Session, run_trial
from ..trials.trial import trials_of

Table = Mapping[str, Any]
"""A spec, or what is laid over it."""

LINE: Table = {"kind": "line-up", "carts": 3}
BOX: Table = {"kind": "box-pushing", "robots": 2}
POINTS: Table = {
    "kind": f"{Path(__file__).parents[2] / 'examples/worlds/pushing_points.py'}:PushingPoints",
    "robots": 3,
    "option_length": 1,
    "points": 3,
}
"""The world of Q-learning: what an agent has done is part of its state."""
NETWORK: Table = {"hidden": [8], "batch_size": 4}
POLICY: Table = {**NETWORK, "rollout": 4, "epochs": 1}
SHORT: dict[str, Table] = {
    "ppo": POLICY,
    "ippo": POLICY,
    "hierarchy-ppo": POLICY,
    "mappo": POLICY,
    "dqn": {**NETWORK, "begin": 2},
    "mixed": {
        "parts": [
            {"agents": ["cart1", "robot1*"], "learner": {"kind": "hierarchy-ppo", **POLICY}},
            {"agents": "*", "learner": {"kind": "batch-td", "weights": "role"}},
        ]
    },
}
"""What the learner of so short a trial is set to, beside its kind."""
SAID = {"predictor": "learner.predictor: networks predict nothing, there is nothing to choose"}
"""Sentences in place of those on keys that there are not, by axis."""


def _failing(kind: str, **more: Any) -> Table:
    failure = {"kind": kind, "agents": ["*3"], **more}
    return {"topology": {"kind": "chain", "failures": [failure]}}


def _chain(**more: Any) -> Table:
    return {"topology": {"kind": "chain", **more}}


def _predicted(kind: str) -> Table:
    return {"learner": {"predictor": {"kind": kind}}}


AXES: dict[str, dict[str, Table]] = {
    "topology": {
        "chain": _chain(),
        "tree": {"topology": {"kind": "tree"}},
        "star": {"topology": {"kind": "star"}},
        "teams": {"topology": {"kind": "teams"}},
        "independent": {"topology": {"kind": "independent"}},
    },
    "neighbours": {
        "simultaneous": {"topology": {"kind": "simultaneous"}},
        "coordination-graph": {"topology": {"kind": "coordination-graph"}},
        "oriented": {"topology": {"kind": "coordination-graph", "oriented": "listed"}},
    },
    "told": {
        "parents": _chain(told="parents"),
        "none": _chain(told="none"),
        "own body": _chain(told=["body"]),
        "next body": _chain(told=["next"]),
    },
    "considers": {
        "children": _chain(considers="children"),
        "none": _chain(considers="none"),
        "own body": _chain(considers=["body"]),
        "next body": _chain(considers=["next"]),
    },
    "messages": {
        "lost": _failing("lost", agents=["*1"]),
        "delayed": _failing("delayed", agents=["*1"]),
        "noisy": _failing("noisy", agents=["*1"]),
        "absent": _failing("absent", agents=["*2"]),
        "reparented": _failing("reparented", superior="FIRST"),
    },
    "agents": {
        "actuator": {"scenario": BOX, "agents": "actuator"},
        "body": {"scenario": BOX, "agents": "body"},
        "team": {"scenario": BOX, "agents": "team"},
    },
    "evaluation elsewhere": {
        "more agents": {"evaluations": {"there": {"SIZE": 4}}},
        "other topology": {"evaluations": {"there": {"topology": {"kind": "star"}}}},
        "failing messages": {
            "evaluations": {"there": _failing("lost", agents=["*1"])},
        },
    },
    "before and after": {
        "curriculum": {
            "curriculum": [{"name": "two", "episodes": 1, "scenario": {"SIZE": 2}}],
        },
        "kept team": {"keep_teams": True},
        "actuator fault": {
            "scenario": {**BOX, "failures": [{"kind": "seized", "wheels": ["robot1*"]}]},
        },
    },
    "predictor": {
        "given": {},
        "static": _predicted("static"),
        "learned": _predicted("learned"),
        "none": {"scenario": {"kind": "gymnasium", "id": "BipedalWalker-v3", "actions": 2}},
    },
}
"""What a learner is combined with: cases by axis, and what each lays over the spec of a cell."""


class Outcome(NamedTuple):
    """What has come of a cell."""

    verdict: Literal["yes", "left out", "no"]
    """It runs; it runs without what it asks for; it is refused."""
    sentence: str = ""
    """Why, unless it runs."""


class Cell(NamedTuple):
    """A learner, a case of an axis, and what has come of it."""

    axis: str
    case: str
    learner: str
    outcome: Outcome


def spec_of(learner: str, changes: Table) -> dict[str, Any]:
    """Return the spec of a cell, as a table.

    Worlds differ in how their agents are called and counted: ``SIZE`` and ``FIRST`` stand for the
    key of their number, and for the name of the first.
    """
    world = POINTS if learner == "q-learning" else LINE
    own = {"kind": learner, **SHORT.get(learner, {})}
    if issubclass(LEARNERS.model(learner), LearnerSettings):
        own["weights"] = "role"
    table: dict[str, Any] = {
        "preset": "own-value",
        "seeds": [1],
        "episodes": 1,
        "steps": 4,
        "evaluation": 1,
        "scenario": world,
        "agents": "team" if learner == "dqn" else "actuator",
        **changes,
        "learner": {**own, **changes.get("learner", {})},
    }
    words = {"SIZE": "robots" if world is POINTS else "carts"}
    words["FIRST"] = "robot1" if world is POINTS else "cart1"
    filled: dict[str, Any] = _filled(table, words)
    return filled


def _filled(value: Any, words: Mapping[str, str]) -> Any:
    if isinstance(value, Mapping):
        return {words.get(key, key): _filled(part, words) for key, part in value.items()}
    if isinstance(value, list):
        return [_filled(part, words) for part in value]
    return words.get(value, value) if isinstance(value, str) else value


def attempt(axis: str, table: Table) -> Outcome:
    """Run a cell.

    Raises
    ------
    RuntimeError
        If a team that was kept does not act as it did.
    """
    try:
        spec = Spec.of(table)
        check_conditions(spec)
    except SpecError as error:
        is_unknown = "unknown key" in str(error)
        return Outcome("no", SAID[axis] if is_unknown else str(error))
    (trial,) = trials_of(spec)
    result = run_trial(trial)
    if trial.keep_teams:
        again = Session.restored(trial, result.recordings[TEAM])
        again.evaluate()
        evaluated = [row for row in result.rows if row.phase == "evaluation"]
        if list(again.result().rows) != evaluated:
            raise RuntimeError(f"{trial.settings.learner.kind}: the kept team acts otherwise")
    settings = [spec.conditions()[0].settings]
    settings += [other for _, other in spec.conditions()[0].evaluations]
    warnings = [line for each in settings for line in each.warnings()]
    return Outcome("left out", warnings[0]) if warnings else Outcome("yes")


def cells(learners: Sequence[str] = ()) -> Iterator[Cell]:
    """Run the cells of some learners, or of all that are built in, and yield them axis by axis."""
    for axis, cases in AXES.items():
        for learner in learners or LEARNERS.built_in:
            for case, changes in cases.items():
                outcome = attempt(axis, spec_of(learner, changes))
                yield Cell(axis, case, learner, outcome)
