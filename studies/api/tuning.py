"""Random search for better settings of a spec, on seeds that no report uses.

All configurations are conditions of one ordinary study, so interrupted tuning resumes. By
successive halving (Jamieson and Talwalkar 2016) all of them run on two seeds, the better half on
four, and so on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import reduce
from itertools import starmap
from os import PathLike
from typing import Any

import numpy as np

from ...core.numerics import pd
from ...core.plugins.words import show
from ..errors import SpecError
from ..presentation.progress import Terminal, count
from ..spec.spec import Spec
from ..spec.tables import TomlTable, dumps, nested, override
from ..store import durable
from ..trials.arrangement import check_conditions
from ..trials.trial import trials_of
from ..workers.runner import Observer
from .running import folder, run
from .study import StudyResults

FIRST_SEED = 10_000
"""The smallest seed for tuning: smaller ones are for reports."""
GIVEN = "given"
"""Name of the configuration of the spec itself."""
CONTROLS = ("frozen", "planner")
"""Presets that learn nothing, which run on all seeds for comparison."""
USUAL: dict[str, Sequence[object]] = {
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
"""Values by key for a spec without a table ``[tune]``, if its learner and scenario accept them."""
BEST_FILE = "best.toml"
TABLE_FILE = "configurations.csv"
MAX_DRAWS = 50
"""Maximum number of draws per configuration."""

Configuration = Mapping[str, object]
"""Values by dotted key."""


@dataclass(frozen=True)
class Tuning:
    """Result of tuning."""

    best: Spec
    """The spec with the best configuration, and its own seeds."""
    changes: Configuration
    """Changes of the spec by the best configuration; empty if no configuration is better."""
    study: StudyResults
    """Results of the last configurations and the controls, on all seeds."""
    configurations: pd.DataFrame
    """Configurations, the best first: name, number of seeds, mean evaluation success (0 if nothing
    is a success), mean evaluation return, and values."""

    def __str__(self) -> str:
        return "\n".join([str(self.study.table(self.columns)), "", *self.lines])

    __repr__ = __str__

    @property
    def columns(self) -> list[str]:
        """Titles of the columns about evaluation."""
        return [title for title in self.study.table().titles if "evaluation" in title]

    @property
    def lines(self) -> list[str]:
        """Results, line by line."""
        best = self.configurations["name"].iloc[0]
        return [
            f"Best of {len(self.configurations)} configurations: {best}",
            *(f"  {key} = {show(value)}" for key, value in self.changes.items()),
            f"Its {self.study.results.main.title} on these seeds is too optimistic, because it was",
            "selected by them. Run the best spec on its own seeds.",
            *self.best.warnings(),
        ]


def tune(
    spec: Spec | Mapping[str, object] | str | PathLike[str],
    out: str | PathLike[str],
    *,
    trials: int = 20,
    seeds: int = 16,
    first_seed: int = FIRST_SEED,
    draw: int = 0,
    progress: bool = True,
    **running: Any,
) -> Tuning:
    """Search for a better configuration of a spec; the same call resumes an interrupted search.

    Parameters
    ----------
    spec
        A `Spec` of one condition, a table, or the path of a TOML file. Its table ``[tune]`` lists
        the values to try by dotted key; without it, the search uses `USUAL`.
    out
        Folder of the study of all configurations. Also receives ``best.toml``, the spec with the
        best configuration, and ``configurations.csv``.
    trials
        Number of configurations, including that of the spec.
    seeds
        Number of seeds on which the last configurations are compared, from `first_seed` on.
    first_seed
        First seed, 10,000 or more.
    draw
        Seed of the random search.
    progress
        Whether to show progress.
    **running
        ``jobs``, ``backend``, ``address`` and ``accept_code`` as in `nested_agents.run`.

    Raises
    ------
    SpecError
        If there is nothing to tune, or the study cannot run; one line.
    """
    out = folder(out)
    spec = Spec.read(spec, study=out)
    _check_request(spec, trials, seeds, first_seed, draw)
    configurations = _sample(spec, trials, draw)
    study = _study(spec, configurations, range(first_seed, first_seed + seeds))
    observer = Terminal() if progress else Observer()
    names = list(configurations)
    every_trial = trials_of(study)
    for n_configurations, n_seeds in rungs(len(configurations), seeds):
        names = names[:n_configurations]
        wanted = {*names, GIVEN, *(CONTROLS if n_seeds == seeds else ())}
        last_seed = first_seed + n_seeds - 1
        chosen = {t.identity for t in every_trial if t.condition in wanted and t.seed <= last_seed}
        results = run(study, out, observer=observer, chosen=chosen, **running)
        episodes = results.episodes
        table = _ranking(episodes[episodes["seed"] <= last_seed], configurations)
        observer.note(f"compared {count(len(names), 'configuration')} on {count(n_seeds, 'seed')}")
        names = [name for name in table["name"] if name in names]
    best = configurations[table["name"].iloc[0]]
    tuned = _with_configuration(spec, best)
    durable.write(out / BEST_FILE, dumps(tuned.table()).encode())
    durable.write(out / TABLE_FILE, table.to_csv(index=False).encode())
    finalists = results.where(f"condition in {[GIVEN, *names, *CONTROLS]}")
    return Tuning(tuned, best, finalists, table)


def rungs(configurations: int, seeds: int) -> Iterator[tuple[int, int]]:
    """Yield the number of configurations, which halves, and of seeds, which doubles.

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


def _merged(table: TomlTable, configuration: Configuration) -> TomlTable:
    return reduce(override, starmap(nested, configuration.items()), table)


def _with_configuration(spec: Spec, configuration: Configuration) -> Spec:
    """Return a spec with the values of a configuration, without its table ``[tune]``."""
    table = {key: value for key, value in spec.table().items() if key != "tune"}
    return Spec.of(_merged(table, configuration), spec.sources)


def _content(spec: Spec) -> str:
    """Return the settings of the only condition of a spec as text, if it can be built."""
    check_conditions(spec)
    return spec.conditions()[0].settings.canonical()


def _space(spec: Spec) -> dict[str, Sequence[object]]:
    """Return the values to draw by key: those of the spec, or the usual values that it accepts."""
    if spec.tune:
        for key, values in spec.tune.items():
            for value in values:
                _with_configuration(spec, {key: value})  # refuses unknown keys and values
        return dict(spec.tune)
    possible: dict[str, list[object]] = {}
    for key, usual in USUAL.items():
        for value in usual:
            with suppress(SpecError):
                _content(_with_configuration(spec, {key: value}))
                possible.setdefault(key, []).append(value)
    return dict(possible)


def _sample(spec: Spec, trials: int, draw: int) -> dict[str, Configuration]:
    """Return distinct configurations that can be built, by name; that of the spec is the first."""
    space = _space(spec)
    rng = np.random.default_rng(draw)
    problem = "all are the spec's own"
    drawn: dict[str, Configuration] = {_content(spec): {}}
    for _ in range(MAX_DRAWS * trials):
        if len(drawn) == trials:
            break
        changes = {key: values[int(rng.integers(len(values)))] for key, values in space.items()}
        try:
            drawn.setdefault(_content(_with_configuration(spec, changes)), changes)
        except SpecError as error:
            problem = str(error)
    if len(drawn) == 1:
        raise SpecError(f"tune: there is nothing to try: {problem}")
    return {f"c{i:02}" if i else GIVEN: changes for i, changes in enumerate(drawn.values())}


def _study(spec: Spec, configurations: Mapping[str, Configuration], seeds: Sequence[int]) -> Spec:
    """Return the study of all configurations and of the controls that the scenario allows."""
    left_out = ("tune", "evaluations", "keep_teams")
    base = {key: value for key, value in spec.table().items() if key not in left_out}
    base |= {"study": "learning-curve", "seeds": list(seeds)}
    overrides = [_merged({"name": name}, drawn) for name, drawn in configurations.items()]
    for name in CONTROLS:
        control = {"name": name, "preset": name}
        with suppress(SpecError):  # the scenario predicts no rewards
            check_conditions(Spec.of({**base, "overrides": [control]}, spec.sources))
            overrides.append(control)
    return Spec.of({**base, "overrides": overrides}, spec.sources)


def _ranking(episodes: pd.DataFrame, configurations: Mapping[str, Configuration]) -> pd.DataFrame:
    """Return all configurations by number of seeds, then evaluation success, then return."""
    by_name = episodes[episodes["phase"] == "evaluation"].groupby("condition")
    means = by_name[["success", "return"]].mean().astype(float).fillna({"success": 0.0})
    means.insert(0, "seeds", by_name["seed"].nunique())
    table = pd.DataFrame({"name": list(configurations)}).join(means, on="name")
    values = pd.DataFrame(list(configurations.values()), dtype=object)
    table = table.fillna({"seeds": 0}).astype({"seeds": int}).join(values).astype(object)
    return table.sort_values(list(means), ascending=False, ignore_index=True)
