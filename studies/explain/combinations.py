"""What goes with what: every built-in learner against every other part of a condition, by trying.

A cell is a learner and one case of an axis: a topology, say, or a failure of messages. It is a
trial of a few decisions, which is trained, evaluated and, where its team is kept, restored. Then it
runs; or what the case asks for is left out, as the learner knows nothing of it; or it is refused.
The sentence that says why is that of the warning, or of the refusal itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from ...core.learners import LEARNERS, LearnerSettings
from ...core.plugins.words import closest
from ..errors import SpecError
from ..spec.spec import Spec
from ..spec.tables import SpecTable
from ..store.durable import TEAM
from ..trials.arrangement import check_conditions
from ..trials.session import Session, run_trial
from ..trials.trial import trials_of

"""A spec, or what is laid over it."""


class Setting(NamedTuple):
    """Where the cells of a learner are run."""

    scenario: SpecTable
    """Three agents, none of which has others in its body."""
    size: str
    """The key of their number."""
    first: str
    """The name of the first."""
    bodies: SpecTable
    """One whose bodies have several actuators."""


BOX: SpecTable = {"kind": "box-pushing", "robots": 2}
LINE = Setting({"kind": "line-up", "carts": 3}, "carts", "cart1", BOX)
EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "worlds"
PLAYERS: SpecTable = {"kind": f"{EXAMPLES / 'levers.py'}:Levers", "players": 3}
LEVERS = Setting(PLAYERS, "players", "player1", PLAYERS)
"""For Q-learning: a state holds what was done. Every player is a body."""
POLICY: SpecTable = {"hidden": [8], "batch_size": 4, "rollout": 4, "epochs": 1}
BATCH: SpecTable = {"kind": "batch-td", "weights": "role"}
SHORT: dict[str, SpecTable] = {
    "ppo": POLICY,
    "ippo": POLICY,
    "hierarchy-ppo": POLICY,
    "mappo": POLICY,
    "written": {"value": {"distance": -1.0}},
}
"""What learners are set to in trials so short."""


def failing(kind: str, agents: str, **more: str) -> SpecTable:
    """Return the table of a chain whose messages fail."""
    return _chain(failures=[{"kind": kind, "agents": agents, **more}])


def _chain(**more: object) -> SpecTable:
    return {"topology": {"kind": "chain", **more}}


def _joined(kind: str, **more: object) -> SpecTable:
    return {"topology": {"kind": kind, **more}}


def _predicted(kind: str) -> SpecTable:
    return {"learner": {"predictor": {"kind": kind}}}


WALKER = {
    "kind": "gymnasium",
    "id": "BipedalWalker-v3",
    "actions": 2,
    "variables": {"angle": 0, "speed": 2},
}
"""A world that predicts nothing."""
SEIZED = {"kind": "seized", "wheels": "robot1*"}
AXES: dict[str, dict[str, SpecTable]] = {
    "topology": {
        "chain": _chain(order="reversed"),
        "tree": _joined("tree"),
        "star": _joined("star"),
        "teams": _joined("teams"),
        "independent": _joined("independent"),
    },
    "neighbours": {
        "simultaneous": _joined("simultaneous"),
        "coordination-graph": _joined("coordination-graph"),
        "oriented": _joined("coordination-graph", oriented="listed"),
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
        "lost": failing("lost", "*1"),
        "delayed": failing("delayed", "*1"),
        "noisy": failing("noisy", "*1"),
        "absent": failing("absent", "*2"),
        "reparented": failing("reparented", "*3", superior="FIRST"),
        "left": failing("left", "*2"),
    },
    "one agent for": {
        "an actuator": {"scenario": "BODIES", "agents": "actuator"},
        "a body": {"scenario": "BODIES", "agents": "body"},
        "the team": {"agents": "team"},
    },
    "evaluated in": {
        "more agents": {"evaluations": {"there": {"SIZE": 4}}},
        "another topology": {"evaluations": {"there": _joined("star")}},
        "failing messages": {"evaluations": {"there": failing("lost", "*1")}},
    },
    "further": {
        "curriculum": {"curriculum": [{"name": "two", "episodes": 1, "scenario": {"SIZE": 2}}]},
        "kept team": {"keep_teams": True},
        "actuator fault": {"scenario": {**BOX, "failures": [SEIZED]}},
    },
    "predictor": {
        "given": {},
        "static": _predicted("static"),
        "learned": _predicted("learned"),
        "none": {"scenario": WALKER},
        "none but learned": {"scenario": WALKER, **_predicted("learned")},
    },
}
"""What a learner is combined with: cases by axis, and what each lays over the spec of a cell."""
NO_PREDICTOR = "learner.predictor: networks predict nothing, so there is nothing to choose"
"""Said of a key that settings of networks do not have."""


class Trying(NamedTuple):
    """What has come of a cell."""

    verdict: Literal["yes", "left out", "no"]
    """It runs; it runs without what is asked for; it is refused."""
    sentence: str = ""
    """Why, unless it runs."""


class Combination(NamedTuple):
    """A learner, a case of an axis, and what has come of it."""

    axis: str
    case: str
    learner: str
    outcome: Trying


def spec_of(learner: str, changes: SpecTable) -> dict[str, object]:
    """Return the spec of a cell, as a table.

    What is said of learners of a mixed team is said of the last of them. Words in capitals stand
    for what differs from world to world.
    """
    world = LEVERS if learner == "q-learning" else LINE
    own: dict[str, Any] = {"kind": learner, **SHORT.get(learner, {})}
    if issubclass(LEARNERS.model(learner), LearnerSettings):
        own["weights"] = "role"
    laid = changes.get("learner", {})
    if learner == "mixed":
        policy = {"kind": "hierarchy-ppo", **POLICY}
        own["parts"] = [
            {"agents": ["cart1", "actuator1", "robot1*"], "learner": policy},
            {"agents": "*", "learner": {**BATCH, **laid}},
        ]
        laid = {}
    table = {
        "preset": "own-value",
        "seeds": [1],
        "episodes": 1,
        "steps": 4,
        "evaluation": 1,
        "scenario": world.scenario,
        "agents": "actuator",
        **changes,
        "learner": {**own, **laid},
    }
    words = {"SIZE": world.size, "FIRST": world.first, "BODIES": world.bodies}
    return {key: _filled(value, words) for key, value in table.items()}


def _filled(value: object, words: SpecTable) -> object:
    if isinstance(value, Mapping):
        return {words.get(key, key): _filled(part, words) for key, part in value.items()}
    if isinstance(value, list):
        return [_filled(part, words) for part in value]
    return words.get(value, value) if isinstance(value, str) else value


def attempt(table: SpecTable) -> Trying:
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
        message = str(error)
        is_unknown = message.startswith("learner.predictor") and "unknown key" in message
        return Trying("no", NO_PREDICTOR if is_unknown else message)
    (trial,) = trials_of(spec)
    result = run_trial(trial)
    if trial.keep_teams:
        restored = Session.restored(trial, result.recordings[TEAM])
        restored.evaluate()
        evaluated = [row for row in result.rows if row.phase == "evaluation"]
        if list(restored.result().rows) != evaluated:
            raise RuntimeError(f"{trial.settings.learner.kind}: the kept team acts otherwise")
    others = [other for _, other in trial.evaluations]
    warnings = [line for each in (trial.settings, *others) for line in each.warnings()]
    return Trying("left out", warnings[0]) if warnings else Trying("yes")


def cells(learners: Sequence[str] = ()) -> Iterator[Combination]:
    """Run the cells of some learners, or of all that are built in, and yield them axis by axis.

    Raises
    ------
    SpecError
        If there is no such learner, or this is no checkout: a world is one of the examples.
    """
    if not EXAMPLES.is_dir():
        raise SpecError(f"{EXAMPLES}: is not there; combine runs in a checkout alone")
    unknown = [name for name in learners if name not in LEARNERS.built_in]
    if unknown:
        raise SpecError(f"{unknown[0]}: unknown learner; {closest(unknown[0], LEARNERS.built_in)}")
    for axis, cases in AXES.items():
        for learner in learners or LEARNERS.built_in:
            for case, changes in cases.items():
                yield Combination(axis, case, learner, attempt(spec_of(learner, changes)))
