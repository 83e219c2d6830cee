"""Compatibility of learners with the other parts of a condition, found by running each pair.

``python -m research.combinations [LEARNER ...]`` prints the exceptions as Markdown; ``--write``
writes them into docs/combinations.md. Each pair of a learner and a case, such as a topology or a
failure of messages, is a trial of a few decisions, which is trained, evaluated and, where its team
is kept, restored. It runs; or the part is left out with a warning, because the learner does not use
it; or it is refused.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from nested_agents import LearnerSettings, Spec, SpecError
from nested_agents.parts import LEARNERS
from nested_agents.study import Session, check_conditions, run_trial, trials_of
from nested_agents.terminal import closest, print_lines, run_to_status

from . import FOLDER

SpecTable = dict[str, Any]
PAGE = FOLDER.parent / "docs" / "combinations.md"
MARK = "<!-- Written by: python -m research.combinations --write -->\n\n"
"""Line of the page before the generated part."""
TEAM = "team"
"""Name of the file that holds a kept team."""


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
EXAMPLES = FOLDER.parent / "examples" / "worlds"
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
    "neighbors": {
        "simultaneous": _joined("simultaneous"),
        "coordination-graph": _joined("coordination-graph"),
        "oriented": _joined("coordination-graph", decision_order="listed"),
    },
    "communication": {
        "parents": _chain(communication="parents"),
        "none": _chain(communication="none"),
        "own body": _chain(communication=["body"]),
        "next body": _chain(communication=["next"]),
    },
    "lookahead": {
        "children": _chain(lookahead="children"),
        "none": _chain(lookahead="none"),
        "own body": _chain(lookahead=["body"]),
        "next body": _chain(lookahead=["next"]),
    },
    "messages": {
        "lost": failing("lost", "*1"),
        "delayed": failing("delayed", "*1"),
        "noisy": failing("noisy", "*1"),
        "absent": failing("absent", "*2"),
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
        "poses": {"scenario": BOX, **_predicted("poses")},
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
    """Run every case with some learners, or with all that are built in, axis by axis.

    Raises
    ------
    SpecError
        If there is no such learner.
    """
    unknown = [name for name in learners if name not in LEARNERS.built_in]
    if unknown:
        raise SpecError(f"{unknown[0]}: unknown learner; {closest(unknown[0], LEARNERS.built_in)}")
    for axis, cases in AXES.items():
        for learner in learners or LEARNERS.built_in:
            for case, changes in cases.items():
                yield Combination(axis, case, learner, attempt(spec_of(learner, changes)))


def exceptions(tried: Iterable[Combination]) -> Iterator[str]:
    """Yield a table of what does not run as asked, as Markdown.

    Learners that have the same cases with the same reason share a row.
    """
    cases: dict[tuple[str, str, str, str], list[str]] = {}
    for axis, case, learner, (verdict, sentence) in tried:
        if verdict != "yes":
            own = f"learner.kind = {learner!r}"
            reason = sentence.removeprefix(f"{own}: ").replace(own, "learner.kind = ...")
            cases.setdefault((axis, verdict, reason, learner), []).append(case)
    learners: dict[tuple[str, str, str, str], list[str]] = {}
    for (axis, verdict, reason, learner), own in cases.items():
        learners.setdefault((axis, ", ".join(own), verdict, reason), []).append(learner)
    yield "| part | cases | learners | outcome | reason |"
    yield "|---|---|---|---|---|"
    for (axis, own_cases, verdict, reason), names in learners.items():
        outcome = {"left out": "left out", "no": "refused"}[verdict]
        yield f"| {axis} | {own_cases} | {', '.join(names)} | {outcome} | {reason} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print or write the exceptions, and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m research.combinations", description=__doc__)
    parser.add_argument("learners", nargs="*", metavar="LEARNER", help="by default all")
    parser.add_argument(
        "--write",
        nargs="?",
        type=Path,
        const=PAGE,
        metavar="PAGE.md",
        help=f"by default {PAGE.name}",
    )
    options = parser.parse_args(arguments)
    lines = exceptions(cells(options.learners))
    if not options.write:
        print_lines(lines)
        return 0
    if options.learners:
        raise SpecError(f"--write: the page has all learners, not {options.learners}")
    before, mark, _ = PAGE.read_text(encoding="utf-8").partition(MARK)
    generated = "".join(f"{line}\n" for line in lines)
    options.write.write_text(before + mark + generated, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(run_to_status("research.combinations", main))
