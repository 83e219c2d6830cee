"""Other settings of a spec, drawn at random and tried on seeds of their own.

They are conditions of one ordinary study, so what has run is kept and never run again. By
successive halving (Jamieson and Talwalkar 2016) all of them are tried on two seeds, the better half
on four, and so on: seeds are spent on what may be best. All meet the same worlds.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import reduce
from itertools import starmap
from os import PathLike
from pathlib import Path

import numpy as np

from ...core.learners import LearnerSettings
from ...core.numerics import pd
from ...core.plugins.words import expect, show
from ..errors import SpecError
from ..presentation.progress import Terminal, count
from ..results.results import Results, read
from ..spec.conditions import Condition
from ..spec.controls import WITH_REWARDS, without_learning
from ..spec.spec import Spec
from ..spec.tables import TomlTable, dumps, nested, override
from ..store import durable
from ..trials.arrangement import check_conditions
from ..trials.trial import Trial, trials_of
from ..workers.runner import Backend, Observer
from .loading import load
from .running import run_study
from .study import StudyResults

FIRST_SEED = 10_000
"""The smallest seed to tune on: those below it are for reports."""
GIVEN = "given"
"""The configuration of the spec itself."""
CONTROLS: dict[str, TomlTable] = {
    name: {"preset": name, "learner": {"kind": "frozen", "decision": {"rule": rule}}}
    for name, rule in (("frozen", "value"), ("planner", "reward"))
}
"""Controls of the best configuration, as overrides of a spec."""
AS = "frozen, as "
"""Prefix of the names of controls."""
USUAL: dict[str, tuple[object, ...]] = {
    "learner.weights": ("own", "role"),
    "learner.decision.value_of": ("own", "below", "team"),
    "learner.decision.rule": ("value", "reward-and-value"),
    "learner.rule_base.order": (1, 2),
    "learner.rule_base.memberships": (5, 9),
    "learner.discount": (0.5, 0.9, 0.97),
    "learner.predictor.horizon": (1, 3),
    "scenario.prediction_horizon": (12, 24, 48),
    "learner.ridge": (0.1, 1.0, 10.0, 100.0),
    "learner.exploration.rate": (0.1, 0.3, 0.6),
}
"""Values that are tried without a table ``[tune]``, if learner and scenario have these keys."""
BEST_FILE = "best.toml"
TABLE_FILE = "configurations.csv"
DRAWS = 50
"""Maximum number of draws per configuration; if no new one is found, there are no others."""

Point = Mapping[str, object]
"""Values by dotted key."""


@dataclass(frozen=True)
class Tuning:
    """Result of tuning."""

    best: Spec
    """The spec with the best configuration, and its own seeds."""
    changes: Point
    """Changes of the spec by the best configuration; empty if no configuration is better."""
    study: StudyResults
    """The finalists and the controls, on all seeds."""
    configurations: pd.DataFrame
    """Best first: the name of each configuration, on how many seeds it was tried, its
    mean evaluation success (or nothing) and return, and its values."""
    control: str = "frozen"
    """The condition that differs from the best configuration in learning alone."""

    def __str__(self) -> str:
        return "\n".join([str(self.study.table(self.columns)), "", *self.lines])

    __repr__ = __str__

    @property
    def columns(self) -> list[str]:
        """The columns of the finalists' table that are of evaluation."""
        return [title for title in self.study.table().titles if "evaluation" in title]

    @property
    def lines(self) -> list[str]:
        """Results, line by line."""
        name, success = self.configurations.loc[0, ["name", "success"]]
        lines = [f"Best of {len(self.configurations)} configurations: {name}"]
        lines += [f"  {key} = {show(value)}" for key, value in self.changes.items()]
        main = self.study.results.main
        if not main.is_rate:
            lines.append("Nothing is a success: they are ranked by evaluation return.")
        elif success == 0.0:
            lines.append("None of them reaches the goal in evaluation: they are ranked by return.")
        if self.control.startswith(AS):
            lines.append("Untrained weights plan by the reward under its rule of decision: judge")
            lines.append(f"learning by the difference to {self.control!r}.")
        return [
            *lines,
            f"Its {main.title} on these seeds is flattered, as it was chosen by it.",
            "The spec's own seeds tell how good it is.",
        ]


def tune(
    spec: Spec | Mapping[str, object] | str | PathLike[str],
    out: str | PathLike[str],
    *,
    trials: int = 20,
    seeds: int = 16,
    first_seed: int = FIRST_SEED,
    draw: int = 0,
    jobs: int | None = None,
    backend: Backend = "loky",
    address: str | None = None,
    accept_code: bool = False,
    progress: bool = True,
) -> Tuning:
    """Look for a better configuration of a spec; the same call again continues.

    Parameters
    ----------
    spec
        A `Spec` of one condition, a table, or the path of a TOML file. Its table ``[tune]`` has
        lists of values by dotted key; without it, `USUAL` ones are tried.
    out
        Directory of the study of all configurations, which also gets ``best.toml``, the spec of the
        best one, and ``configurations.csv``.
    trials
        Configurations to try, the spec's own among them.
    seeds
        On which the last ones are compared, from `first_seed` on.
    first_seed
        10,000 or more.
    draw
        Seed of the draw of configurations.
    jobs, backend, address, accept_code
        As those of `nested_agents.run`.
    progress
        Whether to show how it goes.

    Raises
    ------
    SpecError
        If there is nothing to tune, or it cannot be run; one line says why.
    """
    expect("the path of a folder", str | PathLike, out=out)
    out = Path(out)
    spec = Spec.read(spec, study=out)
    _check_request(spec, trials, seeds, first_seed, draw)
    points = _sample(spec, trials, draw)
    study = _study(spec, points, range(first_seed, first_seed + seeds))
    everything = trials_of(study)
    planned = dict[str, Trial]()
    observer = Terminal() if progress else Observer()

    def run(wanted: Container[str], n_seeds: int) -> Results:
        """Run conditions on the first seeds, together with all trials planned before."""
        for trial in everything:
            if trial.condition in wanted and trial.seed < first_seed + n_seeds:
                planned[trial.identity] = trial
        with run_study(
            study,
            out,
            jobs=jobs,
            backend=backend,
            address=address,
            accept_code=accept_code,
            observer=observer,
            chosen=list(planned.values()),
        ) as store:
            return read(store)

    names = list(points)
    for n_configurations, n_seeds in rungs(len(points), seeds):
        names = names[:n_configurations]
        wanted = {*names, GIVEN}
        if n_seeds == seeds:
            wanted |= CONTROLS.keys()
        table = _table(run(wanted, n_seeds), points, range(first_seed, first_seed + n_seeds))
        observer.note(f"compared {count(len(names), 'configuration')} on {count(n_seeds, 'seed')}")
        names = [name for name in table["name"] if name in names]
    best = points[table["name"].iloc[0]]
    control = _control_of(table["name"].iloc[0], study)
    if control not in CONTROLS:
        run({control}, seeds)
    tuned = _lay_over_spec(spec, best)
    durable.write(out / BEST_FILE, dumps(tuned.table()).encode())
    durable.write(out / TABLE_FILE, table.to_csv(index=False).encode())
    finalists = load(out).where(f"condition in {[GIVEN, *names, *CONTROLS, control]}")
    return Tuning(tuned, best, finalists, table, control)


def rungs(configurations: int, seeds: int) -> Iterator[tuple[int, int]]:
    """Yield how many configurations are tried on how many seeds, halving the ones, doubling these.

    Examples
    --------
    >>> list(rungs(20, 16)), list(rungs(3, 5))
    ([(20, 2), (10, 4), (5, 8), (3, 16)], [(3, 2), (2, 4), (2, 5)])
    """
    n = 2
    while n < seeds:
        yield configurations, n
        configurations = max(2, (configurations + 1) // 2)
        n *= 2
    yield configurations, seeds


def _check_request(spec: Spec, trials: int, seeds: int, first_seed: int, draw: int) -> None:
    """Refuse numbers out of range, and specs that have nothing to tune or to compare."""
    numbers = {
        "trials": (trials, range(2, 10_001)),
        "seeds": (seeds, range(2, 10_001)),
        "first-seed": (first_seed, range(FIRST_SEED, 10**9)),
        "draw": (draw, range(10**9)),
    }
    for name, (value, allowed) in numbers.items():
        if value not in allowed:
            raise SpecError(f"--{name} {value}: allowed {allowed[0]:,} to {allowed[-1]:,}")
    if spec.sweep or spec.overrides:
        raise SpecError("sweep, overrides: must be absent, tune takes a spec of one condition")
    if spec.evaluation < 1:
        raise SpecError("evaluation = 0: tune compares evaluation success, needs 1 or more")
    if shared := sorted(set(spec.seeds) & set(range(first_seed, first_seed + seeds))):
        raise SpecError(
            f"seeds: {shared[0]} would be tuned on and reported; --first-seed tunes on others"
        )


def _lay_over(table: TomlTable, point: Point) -> TomlTable:
    """Return a table overridden by values."""
    return reduce(override, starmap(nested, point.items()), table)


def _lay_over_spec(spec: Spec, point: Point) -> Spec:
    """Return a spec overridden by values, without its table ``[tune]``."""
    table = {key: value for key, value in spec.table().items() if key != "tune"}
    return Spec.of(_lay_over(table, point), spec.sources)


def _content(spec: Spec) -> str:
    """Return what the only condition of a spec consists of, if it can be built."""
    check_conditions(spec)
    return spec.conditions()[0].settings.canonical()


def _space(spec: Spec) -> dict[str, Sequence[object]]:
    """Return the values to draw from by key: the spec's own, or the usual ones that it may have."""
    if spec.tune:
        for key, values in spec.tune.items():
            for value in values:
                _lay_over_spec(spec, {key: value})  # refuses what no configuration can have
        return dict(spec.tune)
    with spec.sources.active():
        scenario = spec.conditions()[0].settings.scenario.build()
    usual = dict(USUAL)
    if len({*scenario.roles}) == len(scenario.agents):
        del usual["learner.weights"]  # no two agents share a role
    possible = dict[str, Sequence[object]]()
    for key, values in usual.items():
        for value in values:
            with suppress(SpecError):
                _content(_lay_over_spec(spec, {key: value}))
                possible[key] = [*possible.get(key, ()), value]
    return possible


def _sample(spec: Spec, trials: int, draw: int) -> dict[str, Point]:
    """Return distinct configurations that can be built, by name; the spec's own is the first."""
    space = _space(spec)
    rng = np.random.default_rng(draw)
    problem = "all are the spec's own"
    points: dict[str, Point] = {_content(spec): {}}
    tried = set[str]()
    for _ in range(DRAWS * trials):
        point = {key: values[int(rng.integers(len(values)))] for key, values in space.items()}
        if len(points) < trials and repr(point) not in tried:
            tried.add(repr(point))
            try:
                points.setdefault(_content(_lay_over_spec(spec, point)), point)
            except SpecError as error:
                problem = str(error)
    if len(points) == 1:
        raise SpecError(f"tune: there is nothing to try: {problem}")
    return {f"c{i:02}" if i else GIVEN: point for i, point in enumerate(points.values())}


def _study(spec: Spec, points: Mapping[str, Point], seeds: Iterable[int]) -> Spec:
    """Return the study of all configurations and of the controls that the scenario allows."""
    left_out = ("tune", "evaluations", "keep_teams")
    base = {key: value for key, value in spec.table().items() if key not in left_out}
    base |= {"study": "learning-curve", "seeds": list(seeds)}
    overrides = [_lay_over({"name": name}, point) for name, point in points.items()]
    for name, table in CONTROLS.items():
        control = {"name": name, **table}
        with suppress(SpecError):  # if no rewards are predicted
            check_conditions(Spec.of({**base, "overrides": [control]}, spec.sources))
            overrides.append(control)
    study = Spec.of({**base, "overrides": overrides}, spec.sources)
    planning = [c.label for c in study.conditions() if c.label in points and _plans(c)]
    overrides += [_frozen_as(name, points[name]) for name in planning]
    return Spec.of({**base, "overrides": overrides}, spec.sources)


def _plans(condition: Condition) -> bool:
    """Return whether the zero weights of a condition plan, by predicted rewards."""
    learner = condition.settings.learner
    return isinstance(learner, LearnerSettings) and learner.decision.rule in WITH_REWARDS


def _frozen_as(name: str, point: Point) -> TomlTable:
    """Return the override that differs from a configuration in learning alone."""
    control = _lay_over({"name": f"{AS}{name}"}, without_learning(point))
    return override(control, {"learner": {"kind": "frozen"}})


def _control_of(name: str, study: Spec) -> str:
    """Return the condition that differs from a configuration in learning alone."""
    label = f"{AS}{name}"
    for condition in study.conditions():
        if label in (condition.label, *condition.same):
            return condition.label
    return next(iter(CONTROLS))


def _table(results: Results, points: Mapping[str, Point], seeds: Iterable[int]) -> pd.DataFrame:
    """Return the data frame of all configurations: those of most of the seeds first, then by score.

    The score is the mean evaluation success, 0 where it is not measured, then the return.
    """
    episodes = results.episodes.query("phase == 'evaluation' and seed in @seeds")
    by_name = episodes.groupby("condition")
    means = by_name[["success", "return"]].mean().astype(float).fillna({"success": 0.0})
    means.insert(0, "seeds", by_name["seed"].nunique())
    lines = pd.DataFrame({"name": list(points)}).join(means, on="name").fillna({"seeds": 0})
    values = pd.DataFrame(list(points.values()), dtype=object)
    table = lines.astype({"seeds": int}).join(values).astype(object)
    return table.sort_values(list(means), ascending=False, ignore_index=True)
