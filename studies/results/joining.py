"""Studies that are parts of one: of other seeds, as a Slurm array has them, or of other sizes.

Parts belong to one study if their specs differ in their seeds alone, and no trial is in two of
them. Sizes belong to one study if their specs differ in one number alone.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain

from ...core.numerics import pd
from ...core.plugins.words import show
from ..errors import SpecError
from ..spec.outline import StudyOutline
from ..spec.tables import SpecTable, flat
from ..trials.episodes import join_measures
from .results import Results, assemble
from .scores import name_key

Part = tuple[StudyOutline, Results]
"""Outline and results of a part."""


def join_parts(parts: Sequence[Part]) -> Part | None:
    """Return the study that parts are of; None if they are parts of no one study.

    Rows are in the order in which the whole study has them, so that exported files are the same.
    """
    first, results = parts[0]
    if any(_without_seeds(outline) != _without_seeds(first) for outline, _ in parts):
        return None
    trials = pd.concat([part.trials[["condition", "seed"]] for _, part in parts])
    if trials.duplicated().any():
        return None
    place = {condition: i for i, condition in enumerate(results.columns)}
    joined = assemble(
        [_in_order([part.episodes for _, part in parts], place)],
        [_in_order([part.trials for _, part in parts], place)],
        dict.fromkeys(chain.from_iterable(part.phases for _, part in parts)),
        results.columns,
        results.measures,
        chain.from_iterable(part.usage for _, part in parts),
    )
    seeds = tuple(dict.fromkeys(chain.from_iterable(outline.seeds for outline, _ in parts)))
    table = {**first.table, "seeds": list(seeds)}
    joined = replace(joined, step_limits=results.step_limits, pairs_episodes=results.pairs_episodes)
    return first._replace(seeds=seeds, table=table), joined


def _without_seeds(outline: StudyOutline) -> object:
    own = {key: value for key, value in outline.table.items() if key != "seeds"}
    return own, outline.columns


def _in_order(frames: Sequence[pd.DataFrame], place: dict[str, int]) -> pd.DataFrame:
    """Return rows below each other, by condition and seed; what a trial has stays in its order."""
    whole = pd.concat(frames, ignore_index=True)
    keys = pd.DataFrame(
        {"place": whole["condition"].map(place), "seed": whole["seed"].map(name_key)}
    )
    order = keys.sort_values(["place", "seed"], kind="stable").index
    return whole.loc[order].reset_index(drop=True)


def join_sizes(
    results: Results,
    tables: Mapping[str, SpecTable],
    settings: Mapping[str, SpecTable],
    size: str | None,
) -> Results:
    """Return the results of several studies with the size among the columns of their conditions.

    Parameters
    ----------
    results
        Combined results with a column `DIRECTORY`.
    tables
        Specs by study.
    settings
        Settings by condition, as far as they are known.
    size
        The key of the size, or its last part; none: the only key in which the specs differ.

    Raises
    ------
    SpecError
        If the specs differ in another key, or two conditions are the same; one line.
    """
    specs = {name: _values(table) for name, table in tables.items()}
    size_key = _only_difference(specs, size)
    keys = dict.fromkeys(key for row in results.columns.values() for key in row if key != DIRECTORY)
    columns: dict[str, dict[str, object]] = {}
    for condition, row in results.columns.items():
        own = {key: row.get(key, "") for key in (*keys, size_key) if key is not None}
        fixed = {k: v for k, (v, *_) in specs[str(row[DIRECTORY])].items()}
        fixed |= flat(settings.get(condition, {}))
        own |= {key: fixed.get(key, "") for key, value in own.items() if value == ""}
        for other, there in columns.items():
            if there == own:
                raise SpecError(f"{condition}: has the same settings as {other}: {show(own)}")
        columns[condition] = own
    return replace(results, columns=columns)


def _only_difference(
    specs: Mapping[str, Mapping[str, tuple[object, ...]]], size: str | None
) -> str | None:
    """Return the only key in which specs differ, None if they are equal; refuse several."""
    (first, base), *others = specs.items()
    keys = dict.fromkeys(chain.from_iterable(specs.values()))
    differing = [key for key in keys if len({repr(own.get(key)) for own in specs.values()}) > 1]
    named = [k for k in differing if size is None or size in (k, k.rpartition(".")[2])]
    is_swept = {k: any(len(own.get(k, ())) > 1 for own in specs.values()) for k in named}
    # Swept keys first, then those of the scenario.
    key = min(named, key=lambda k: (not is_swept[k], not k.startswith("scenario.")), default=None)
    rest = [other for other in differing if other != key]
    if rest:
        name, own = next((n, own) for n, own in others if own.get(rest[0]) != base.get(rest[0]))
        here, there = (_shown(spec.get(rest[0])) for spec in (own, base))
        raise SpecError(
            f"{name}: {rest[0]} = {here}, but {there} in {first}: the specs of one law must be "
            "equal except for the size"
        )
    return key


def _shown(values: tuple[object, ...] | None) -> str:
    if values is None:
        return "absent"
    return show(values[0] if len(values) == 1 else list(values))


def _values(table: SpecTable) -> dict[str, tuple[object, ...]]:
    """Return the values of every key of a spec: one, or those of its sweep."""
    fixed = flat({key: value for key, value in table.items() if key != "sweep"})
    swept = table.get("sweep", {})
    return {k: (v,) for k, v in fixed} | {k: tuple(values) for k, values in swept.items()}


DIRECTORY = "directory"
"""Column that tells from which study a condition came, where there are several."""


def combine(
    studies: Sequence[tuple[str, Results]],
) -> tuple[Results, list[dict[str, str]]]:
    """Return the results of several studies as those of one, and the new labels of each.

    Conditions with the same label are distinguished by the name of their study, which is also in
    their column `DIRECTORY`.

    Raises
    ------
    SpecError
        If two studies mean different things by the name of a measure.
    """
    names, parts = zip(*studies, strict=True)
    times = Counter(condition for part in parts for condition in part.columns)
    several = [condition for condition, count in times.items() if count > 1]
    labels = [
        {c: f"{c} ({name})" if c in several else c for c in part.columns} for name, part in studies
    ]
    # Tables of scores with one condition column have no swept keys: their labels are compared.
    rows = [{c: row or {"name": c} for c, row in part.columns.items()} for part in parts]
    keys = dict.fromkeys(k for part in rows for row in part.values() for k in row)
    columns = {
        new[condition]: {**{key: row.get(key, "") for key in keys}, DIRECTORY: name}
        for name, part, new in zip(names, rows, labels, strict=True)
        for condition, row in part.items()
    }

    def rename(frame: pd.DataFrame, new: Mapping[str, str]) -> pd.DataFrame:
        label = frame["condition"].map(new)
        swept = {k: label.map(lambda c, k=k: columns[c][k]) for k in (*keys, DIRECTORY)}
        return frame.assign(condition=label, **swept)

    pairs = [*zip(parts, labels, strict=True)]
    episodes = [rename(part.episodes, new) for part, new in pairs]
    trials = [rename(part.trials, new) for part, new in pairs]
    phases = dict.fromkeys(phase for part in parts for phase in part.phases)
    usage = (name for part in parts for name in part.usage)
    measures = join_measures(part.measures for part in parts)
    results = assemble(episodes, trials, phases, columns, measures, usage)
    limits = [part.step_limits for part in parts]
    training, evaluation = (
        own[0] if len({*own}) == 1 else None for own in zip(*limits, strict=True)
    )
    pairs_episodes = any(part.pairs_episodes for part in parts)
    return replace(
        results, step_limits=(training, evaluation), pairs_episodes=pairs_episodes
    ), labels
