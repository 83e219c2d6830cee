"""The benchmark push-n: teams of 2 to 64 robots push a box to its goal, in worlds that are fixed.

World k of a seed is that of evaluation episode k in every study, so that published rows of studies
are entries, too. What an entry may choose of its world is how it is perceived, predicted and paid,
see `FREE`. Entries of others are files of JSON in the form of `Entry`.

``python -m research.push_n table [ENTRY.json ...]`` prints entries by number of robots,
``check [ENTRY.json ...]`` checks the rules that a file can show, and ``run SPEC.toml --out DIR``
trains and evaluates a spec by the rules and writes ``DIR/entry.json``.

Examples
--------
>>> from nested_agents.environments import joint
>>> env = joint("box-pushing", STEPS, robots=2)
>>> evaluate(lambda observation: [2, 2, 2, 2], env, seed=0)[0]
'0000000000'
"""

import argparse
import json
import tomllib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Literal, Self, get_args

import gymnasium
import numpy as np
from numpy.typing import ArrayLike
from pydantic import ConfigDict, Field, model_validator

import nested_agents as na
from nested_agents import BoxPushingSettings, Settings, Spec, SpecError, Summary, bootstrap, rate
from nested_agents.analysis import NOT_NEGATIVE, Results
from nested_agents.study import EVALUATION_WORLDS, world_seed
from nested_agents.terminal import (
    in_form,
    print_data,
    print_table,
    print_text,
    print_wrapped,
    run_to_status,
    tabulate,
)

from . import RESULTS, FloatArray

Size = Literal[2, 4, 8, 16, 32, 64]
SIZES: tuple[int, ...] = get_args(Size)
"""Numbers of robots."""
EPISODES = 10
"""Episodes of evaluation."""
STEPS = 450
"""The most decisions of an episode."""
LEAST_SEEDS = 5
"""The fewest seeds."""
FREE = ("state_space", "predictor", "belief", "prediction_horizon", "reward", "speed_increment")
"""Keys of the scenario that an entry may choose."""

Given = Literal["nothing", "predictor", "predictor and reward"]
Outcomes = Annotated[str, Field(pattern=f"^[01]{{{EPISODES}}}$")]
Steps = Annotated[int, Field(ge=1, le=STEPS)]

EXPLAINED = ConfigDict(use_attribute_docstrings=True)
"""For models whose schema is printed, with the text beside their fields."""


class TeamScores(Settings):
    """What teams of one size did, by seed; seeds count from 0."""

    model_config = EXPLAINED

    robots: Size
    """How many there are."""
    success: Annotated[tuple[Outcomes, ...], Field(min_length=LEAST_SEEDS)]
    """The episodes of evaluation: 1 where the box was brought to its goal, else 0."""
    steps: tuple[tuple[Steps, ...], ...]
    """The decisions of these episodes."""
    decisions: tuple[Annotated[int, Field(ge=0)], ...]
    """The joint decisions experienced in training, in all its stages."""

    @model_validator(mode="after")
    def _of_equal_seeds(self) -> Self:
        seeds = len(self.success), len(self.steps), len(self.decisions)
        if len(set(seeds)) > 1 or {len(row) for row in self.steps} != {EPISODES}:
            raise ValueError(
                f"success, steps, decisions: of {seeds} seeds, must be equally many, and steps of "
                f"{EPISODES} episodes"
            )
        return self


class Entry(Settings):
    """What one learner did."""

    model_config = EXPLAINED

    benchmark: Literal["push-n"] = "push-n"
    version: Literal[1] = 1
    name: Annotated[str, Field(min_length=1)]
    """What tables call it."""
    about: Annotated[str, Field(min_length=1)]
    """How it learns, in a line."""
    given: Given
    """What it is given of the world, beside what its agents perceive."""
    teams: Annotated[tuple[TeamScores, ...], Field(min_length=1)]
    """Its results, by number of robots."""


def tuples(value: object) -> object:
    """Return a value of JSON with tuples for its lists, which strict validation requires."""
    if isinstance(value, dict):
        return {key: tuples(inner) for key, inner in value.items()}
    return tuple(map(tuples, value)) if isinstance(value, list) else value


def load_entry(path: Path) -> Entry:
    """Return the entry of a file.

    Raises
    ------
    SpecError
        If it cannot be read or breaks a rule; one line.
    """
    try:
        return Entry(**tuples(json.loads(path.read_text(encoding="utf-8"))))
    except TypeError:  # it is a list
        raise SpecError(f"{path}: must be one table with the keys of an entry") from None
    except (ValueError, RecursionError) as error:  # of JSON, or of a rule
        raise SpecError(f"{path}: {error}") from None


def committed_entries() -> list[Entry]:
    """Return the entries whose rows are committed, see ``push_n.toml``."""
    table = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    for entry in table["entries"]:
        entry["teams"] = tuple(
            team_of(na.load(RESULTS / row.pop("file")).results, **row) for row in entry["teams"]
        )
    return [Entry(**entry) for entry in table["entries"]]


def team_of(results: Results, robots: int, condition: str, phase: str = "evaluation") -> TeamScores:
    """Return the trials of a condition as the part of an entry, by an evaluation of them."""
    outcomes = results.success(condition, phase).astype(int)
    stages = [p for p in results.phases if p.startswith("training") and results.has(condition, p)]
    training = np.hstack([results.values(condition, "steps", stage) for stage in stages])
    return TeamScores(
        robots=robots,
        success=tuple("".join(map(str, row)) for row in outcomes),
        steps=tuples(results.values(condition, "steps", phase).tolist()),
        decisions=tuple(training.sum(axis=1).tolist()),
    )


def run_spec(
    path: Path, out: Path, robots: Sequence[int], seeds: int, jobs: int | None
) -> tuple[TeamScores, ...]:
    """Return what the one condition of a spec does, trained anew with each number of robots.

    Raises
    ------
    SpecError
        If it has more conditions, or the world is not that of the benchmark; one line.
    """
    rules = {"seeds": seeds, "steps": STEPS, "evaluation": EPISODES}
    changes = [f"{key}={value}" for key, value in rules.items()]
    spec = Spec.load(path, [*changes, f"sweep.scenario.robots={list(robots)}"], study=out)
    conditions = spec.conditions()
    if len(conditions) != len(robots) or spec.evaluation_steps is not None:
        raise SpecError(f"{path}: must have one condition, and no evaluation_steps")
    for condition, number in zip(conditions, robots, strict=True):
        fixed = BoxPushingSettings(robots=number).model_dump(exclude={*FREE})
        for key, value in condition.settings.scenario.model_dump(exclude={*FREE}).items():
            if value != fixed.get(key):
                allowed = f"push-n has {fixed.get(key)!r}, an entry may choose {', '.join(FREE)}"
                raise SpecError(f"scenario.{key} = {value!r}: {allowed}")
    results = na.run(spec, out, jobs=jobs).results
    return tuple(
        team_of(results, number, condition.label)
        for condition, number in zip(conditions, robots, strict=True)
    )


def evaluate(
    policy: Callable[[FloatArray], ArrayLike], env: gymnasium.Env, seed: int
) -> tuple[str, tuple[int, ...]]:
    """Return success and steps of a seed, as `TeamScores` has them.

    Parameters
    ----------
    policy
        Returns an action for an observation.
    env
        An environment with the scenario of the benchmark, except for the keys in `FREE`.
    seed
        Whose worlds they are.
    """
    success = ""
    steps: list[int] = []
    for k in range(EPISODES):
        world = world_seed(seed, EVALUATION_WORLDS + k)
        observation, _ = env.reset(options={"world": world})
        reached = False
        truncated = False
        count = 0
        while not (reached or truncated):
            observation, _, reached, truncated, _ = env.step(policy(observation))
            count += 1
        steps.append(count)
        success += str(int(reached))
    return success, tuple(steps)


def table_of(entries: Iterable[Entry], measure: str) -> list[Summary]:
    """Return a line for each entry, a column for each number of robots; 95% intervals.

    Parameters
    ----------
    entries
        The entries.
    measure
        ``success`` in evaluation, or the ``decisions`` of training.
    """
    lines = []
    for entry in entries:
        cells = {}
        for team in entry.teams:
            if measure == "success":
                value = rate([list(map(int, row)) for row in team.success])
            else:
                value = bootstrap(team.decisions, bounds=NOT_NEGATIVE)
            cells[f"{team.robots} robots"] = value
        lines.append(Summary(entry.name, min(len(team.success) for team in entry.teams), cells))
    return lines


def _run(options: argparse.Namespace) -> int:
    """Train and evaluate a spec by the rules; the same command again resumes it."""
    robots = list(dict.fromkeys(options.robots or SIZES[:3]))
    teams = run_spec(options.spec, options.out, robots, options.seeds, options.jobs)
    entry = Entry(name=options.name, about=options.about, given=options.given, teams=teams)
    path = options.out / "entry.json"
    path.write_text(f"{entry.model_dump_json(indent=1)}\n", encoding="utf-8")
    print_text(path)
    return 0


def _check(options: argparse.Namespace) -> int:
    """Check the rules that a file can show."""
    if options.schema:
        print_text(json.dumps(Entry.model_json_schema(), indent=1))
    for path in options.entries:
        entry = load_entry(path)
        teams = ", ".join(f"{t.robots} robots x {len(t.success)} seeds" for t in entry.teams)
        print_text(f"passed  {path}: {entry.name}, {teams}")
    return 0


def _table(options: argparse.Namespace) -> int:
    """Print the committed entries, then others, by number of robots."""
    compared = [*committed_entries(), *map(load_entry, options.entries)]
    estimates = tabulate(table_of(compared, options.measure))
    if options.format != "table":
        print_data(in_form(estimates, options.format))
        return 0
    print_table(estimates)
    print_text("")
    for entry in compared:
        print_wrapped(f"{entry.name}: {entry.about}; is given {entry.given}")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command on entries and return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m research.push_n", description="Enter a learner, and compare entries."
    )
    commands = parser.add_subparsers(required=True, metavar="run | check | table")
    run = commands.add_parser("run", help="train and evaluate a spec of one condition")
    run.set_defaults(run=_run)
    run.add_argument("spec", type=Path, metavar="SPEC.toml")
    run.add_argument("--out", type=Path, metavar="DIR", required=True, help="of the study")
    run.add_argument("--robots", type=int, choices=SIZES, nargs="+", help="team sizes")
    run.add_argument("--seeds", type=int, default=LEAST_SEEDS, metavar="N", help="from seed 0 on")
    run.add_argument("--name", metavar="TEXT", required=True, help="label in tables")
    run.add_argument("--about", metavar="TEXT", required=True, help="how it learns, in a line")
    run.add_argument("--given", choices=get_args(Given), default="predictor")
    run.add_argument("--jobs", type=int, metavar="N", help="worker processes")
    check = commands.add_parser("check", help="check entries")
    check.set_defaults(run=_check)
    check.add_argument("--schema", action="store_true", help="print the JSON schema of entries")
    table = commands.add_parser("table", help="print the committed entries and others")
    table.set_defaults(run=_table)
    table.add_argument("--measure", choices=("success", "decisions"), default="success")
    table.add_argument("--format", default="table", choices=("table", "markdown", "latex", "csv"))
    for command in (check, table):
        command.add_argument("entries", type=Path, metavar="ENTRY.json", nargs="*")
    options = parser.parse_args(arguments)
    if options.run is _run and options.seeds < LEAST_SEEDS:
        raise SpecError(f"--seeds = {options.seeds}: must be {LEAST_SEEDS} or more")
    return int(options.run(options))


if __name__ == "__main__":
    raise SystemExit(run_to_status("research.push_n", main))
