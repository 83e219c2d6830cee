"""Exported tables of a study, read back: its episodes, or its trials.

They are recognized by their columns, which the file ``study.json`` in their folder describes.
"""

from __future__ import annotations

from collections.abc import Mapping

from ...core.numerics import pd
from ..errors import SpecError
from ..spec.tables import SpecTable
from .results import DONE, TRIAL_COLUMNS, Results, assemble
from .results_file import Header
from .score_tables import ScoreTable
from .scores import (
    KEYS,
    PHASES,
    ScoreResults,
    refuse_repeated,
    results_of,
    whole_names,
)
from .spreadsheet import harmless

EPISODES = ("condition", "seed", "phase", "episode", "steps")
"""Columns by which a table of episodes is recognized."""
TRIALS = ("condition", "seed", "state", "identity")
"""Columns by which a table of trials is recognized."""


def is_exported(table: ScoreTable, *, is_listed: bool = False) -> bool:
    """Return whether a table has the columns of an exported study.

    Tables of scores may have them, too, unless the file that describes a study lists the table.
    """
    names = {*table.columns}
    is_other = "score" in names and not is_listed
    return not is_other and ({*EPISODES} <= names or {*TRIALS} <= names)


def read_export(
    table: ScoreTable, header: Header | None, trials: ScoreTable | None = None
) -> ScoreResults:
    """Return the results of an exported table, in any order of its rows and columns.

    Parameters
    ----------
    table
        The table, of episodes or of trials.
    header
        Description of the study.
    trials
        Exported trials of a table of episodes, whose numbers are added.

    Raises
    ------
    SpecError
        If a cell is not what was exported, or there is no description; one line names the place.
    """
    if header is None:
        raise SpecError(
            "has the columns of an exported study, but its folder has no study.json, which "
            "describes them; columns condition, score, seed and item can be named instead"
        )
    conditions = header.columns
    written = {text: c for c in conditions for text in (c, str(harmless(c)))}
    cells = table.names("condition")
    unknown = ": must be a condition of study.json in its folder"
    table.refuse(~cells.isin(list(written)), "condition", unknown)
    keys = pd.DataFrame({"condition": cells.map(written), "seed": whole_names(table.names("seed"))})
    swept = {key for row in conditions.values() for key in row}
    if {*TRIALS} <= {*table.columns}:
        return _read_trials(table, keys, conditions)
    scores = keys.assign(
        phase=table.names("phase"), episode=_whole(table, "episode"), steps=_whole(table, "steps")
    )
    is_known = scores["phase"].str.partition(":")[0].isin(PHASES)
    table.refuse(~is_known, "phase", f": must begin with {' or '.join(PHASES)}")
    values = {n: table.numbers(n) for n in table.columns if n not in (*EPISODES, *swept)}
    for rate in (m.name for m in header.measures if m.is_rate and m.name in values):
        is_truth = values[rate].isna() | values[rate].isin((0.0, 1.0))
        table.refuse(~is_truth, rate, ": must be 0 or 1, or blank")
    scores = scores.assign(**values)
    refuse_repeated(table, scores, {key: key for key in KEYS})
    missing = [m.name for m in header.measures if m.name not in table.columns]
    measures = [m for m in header.measures if m.name not in missing]
    notes = [f"no column {', '.join(missing)}, which study.json has"] * bool(missing)
    results = results_of(scores, conditions, measures)
    if trials is not None:
        results = _with_numbers(results, read_export(trials, header).results)
    return ScoreResults(results, tuple(notes))


def _with_numbers(episodes: Results, trials: Results) -> Results:
    """Return results of episodes with the numbers of their whole trials."""
    known = trials.trials.drop(columns=["state", *episodes.trials], errors="ignore")
    keys = ["condition", "seed"]
    numbers = known.assign(**{key: trials.trials[key] for key in keys})
    rows = episodes.trials.merge(numbers, how="left", on=keys)
    own = episodes.phases, episodes.columns, episodes.measures, ()
    return assemble([episodes.episodes], [rows], *own)


def _read_trials(
    table: ScoreTable, keys: pd.DataFrame, columns: Mapping[str, SpecTable]
) -> ScoreResults:
    """Return the numbers of whole trials; those of trials that have not finished are left out."""
    refuse_repeated(table, keys, {"condition": "condition", "seed": "seed"})
    others = {*TRIAL_COLUMNS, *(key for row in columns.values() for key in row)}
    numbers = {name: table.numbers(name) for name in table.columns if name not in others}
    trials = keys.assign(state=table.names("state"), **numbers)
    unfinished = int((trials["state"] != DONE).sum())
    note = f"{unfinished} of {len(trials)} trials have not finished: left out"
    results = assemble([], [trials], (), columns, (), ())
    return ScoreResults(results, (note,) if unfinished else ())


def _whole(table: ScoreTable, column: str) -> pd.Series:
    """Return a column of whole numbers, none below 0."""
    numbers = table.numbers(column)
    is_whole = (numbers >= 0) & (numbers % 1 == 0)
    table.refuse(~is_whole, column, ": must be a whole number from 0 on")
    return numbers.astype(int)
