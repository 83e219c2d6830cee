"""Results chosen and put together: a part of a study's trials, or those of several studies."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.plugins import sources
from ...core.plugins.deferred import pd
from ..errors import SpecError
from ..spec.labels import label
from ..spec.overlay import flat
from ..trials.episodes import joined as joined_measures
from .results import Results, join, select

DIRECTORY = "directory"
"""Column that tells from which study a condition came, where there are several."""


def chosen(results: Results, choice: str, settings: Mapping[str, Any]) -> Results:
    """Return the results of the trials of a choice, such as ``robots == 8 and box == "circle"``.

    Parameters
    ----------
    results
        Of any studies.
    choice
        As `pandas.DataFrame.query` has it, over `condition`, `seed`, and what is set and swept: by
        the last part of the key, or, where several keys end so, by the whole in backticks.
    settings
        By condition, as tables; what is swept goes before them.

    Raises
    ------
    SpecError
        If it is no choice, or names what trials have not; one line.
    """
    trials = results.trials[["condition", "seed"]]
    set_ = [dict(flat(settings.get(c, {}))) for c in trials["condition"]]
    swept = results.columns.get
    known = [
        own | {k: _plain(v) for k, v in swept(c, {}).items() if v != ""}
        for own, c in zip(set_, trials["condition"], strict=True)
    ]
    frame = pd.DataFrame(known, index=trials.index).assign(**trials)
    ends = [name.rpartition(".")[2] for name in frame]
    names = {end: name for end, name in zip(ends, frame, strict=True) if ends.count(end) == 1}
    frame = frame.assign(**{end: frame[name] for end, name in names.items()})
    try:
        keep = frame.query(choice).index
    except Exception as error:  # of pandas, of Python's parser, of what is compared
        problem = f"{sources.message(error)}; must be such as robots == 8 and box == 'circle'"
        raise SpecError(f"where = {choice!r}: {problem}") from None
    return select(results, trials.index.isin(keep))


def _apart(name: str, tables: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return labels of conditions of one name, by one or two settings that tell all apart; or none.

    Examples
    --------
    >>> _apart("default", [{"scenario": {"robots": n, "box": "disc"}} for n in (2, 4)])
    ['default, robots=2', 'default, robots=4']
    """
    own = [dict(flat(table)) for table in tables]
    keys = dict.fromkeys(key for table in own for key in table)
    other = [key for key in keys if len({repr(table.get(key)) for table in own}) > 1]
    labels = [label({key: table.get(key, "") for key in other}, name) for table in own]
    return labels if len(other) <= 2 and len(set(labels)) == len(labels) else []


def together(
    studies: Sequence[tuple[str, Results]], settings: Sequence[Mapping[str, Any]] = ()
) -> tuple[Results, list[dict[str, str]]]:
    """Return the results of several studies as those of one, and the new labels of each.

    Conditions whose label occurs more than once are told apart by their `settings`, where one or
    two of these differ, else by the name of their study. Their columns tell it, too, as
    `DIRECTORY`.

    Raises
    ------
    SpecError
        If two studies mean different things by the name of a measure.
    """
    times = Counter(condition for _, results in studies for condition in results.columns)
    several = [condition for condition, count in times.items() if count > 1]
    labels = [
        {c: f"{c} ({name})" if c in several else c for c in results.columns}
        for name, results in studies
    ]
    for condition in several if settings else ():
        at = [i for i, (_, results) in enumerate(studies) if condition in results.columns]
        apart = _apart(condition, [settings[i].get(condition, {}) for i in at])
        if not times.keys() & set(apart):
            for i, text in zip(at, apart, strict=False):
                labels[i][condition] = text
    keys = dict.fromkeys(k for _, r in studies for row in r.columns.values() for k in row)
    columns = {
        new[condition]: {**{key: row.get(key, "") for key in keys}, DIRECTORY: name}
        for (name, results), new in zip(studies, labels, strict=True)
        for condition, row in results.columns.items()
    }
    whole = join(
        [results for _, results in studies],
        labels,
        columns,
        joined_measures(results.measures for _, results in studies),
    )
    return whole, labels


def _plain(value: Any) -> Any:
    """Return a value of a column as what it stands for: ``true`` is a truth value there."""
    return value == "true" if value in ("true", "false") else value
