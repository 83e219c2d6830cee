"""Loads results: of kept studies, of published files, of tables of scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Literal

from ...core.numerics import pd
from ...core.plugins.sources import Sources
from ...core.plugins.words import expect, expect_each
from ..errors import SpecError
from ..results import foreign, published
from ..results.parts import join_parts
from ..results.results import combine
from ..spec.tables import SpecTable, TomlTable
from ..store.store import Store
from .comparison import Comparison
from .study import Place, StudyResults


def load(
    *places: Place, columns: Sequence[str] = (), better: Literal["higher", "lower"] = "higher"
) -> StudyResults:
    """Return the results of a study that is kept in a directory, or of several together.

    Parameters
    ----------
    *places
        Directories of studies; or single files that ``export --format json`` has written, or of the
        form of marl-eval, as those of BenchMARL are; or tables of scores of others: CSV, JSON lines
        or Parquet, see `nested_agents.studies.results.foreign`.
        Parts of one study, whose specs differ in their seeds alone, are put together. Conditions
        of several studies whose labels are equal get the name of their directory; the first study
        says how all of them are analysed.
    columns
        Of tables of scores, which column is what: ``"condition=model,seed=run,score=accuracy"``; as
        `compare_table` has them.
    better
        Which scores of tables are better.

    Raises
    ------
    SpecError
        If there is no readable study, or its rows are damaged; one line says what.
    """
    if not places:
        raise SpecError("load: needs a directory at least")
    for place in places:
        expect("paths of studies or files", str | PathLike, places=place)
    expect_each("pairs of a role and a column, ROLE=COLUMN", str, columns=columns)
    paths = [Path(place) for place in places]
    _check_distinct(paths)
    is_table = [path.suffix in foreign.SUFFIXES for path in paths]
    if columns and not any(is_table):
        raise SpecError(f"columns: are of tables, {', '.join(foreign.SUFFIXES)}")
    loaded = [
        _load_table(path, columns, better) if table else _load_one(path)
        for path, table in zip(paths, is_table, strict=True)
    ]
    return loaded[0] if len(loaded) == 1 else _merge(paths, loaded)


def compare_table(
    table: pd.DataFrame | Place,
    *,
    condition: str | Sequence[str] = "condition",
    score: str | Sequence[str] = "score",
    seed: str | None = None,
    item: str | None = None,
    better: Literal["higher", "lower"] = "higher",
    by: str | None = None,
    reference: str | None = None,
) -> Comparison:
    """Compare conditions of which a table has the scores, whoever has made it.

    Parameters
    ----------
    table
        A row for each score; or a file of it, CSV, JSON lines or Parquet.
    condition
        Column of what is compared; several are crossed.
    score
        Column of what is measured; of several the first is compared.
    seed
        Column of the runs on which conditions are compared; None: on the items.
    item
        Column of what each score was measured on: a question, a task.
    better
        Which scores are better.
    by, reference
        As in `StudyResults.compare`.

    Raises
    ------
    SpecError
        If a column is missing, a score is no finite number, or nothing can be compared.

    Examples
    --------
    >>> scores = {"chain": [0.8, 0.7, 0.9], "star": [0.5, 0.6, 0.6]}
    >>> table = pd.DataFrame(
    ...     [(name, k, s) for name, own in scores.items() for k, s in enumerate(own)],
    ...     columns=["topology", "run", "accuracy"],
    ... )
    >>> comparison = compare_table(table, condition="topology", score="accuracy", seed="run")
    >>> round(float(comparison.differences[0].estimate.value), 2)
    -0.23
    """
    expect("a table of pandas or the path of a file", pd.DataFrame | str | PathLike, table=table)
    expect_each("names of columns", str, condition=condition, score=score)
    frame = table if isinstance(table, pd.DataFrame) else foreign.read_table(Path(table))
    names = foreign.ScoreColumns(_several(condition), _several(score), seed, item)
    return _of_table(foreign.results_of(frame, names, better)).compare(by, reference=reference)


def _several(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _load_table(
    path: Path, columns: Sequence[str], better: Literal["higher", "lower"]
) -> StudyResults:
    """Return the results of a file of scores; what is said of them names it."""
    frame = foreign.read_table(path)
    names = foreign.ScoreColumns.parse(columns, [str(name) for name in frame.columns])
    try:
        results = _of_table(foreign.results_of(frame, names, better))
    except SpecError as error:
        raise SpecError(f"{path}: {error}") from None
    return replace(results, remarks=tuple(f"{path}: {line}" for line in results.remarks))


def _of_table(table: foreign.Foreign) -> StudyResults:
    return StudyResults(table.outline, table.results, (), table.remarks)


def _check_distinct(paths: Sequence[Path]) -> None:
    """Refuse paths of which two are the same place."""
    known = set[Path]()
    for path in paths:
        if path.resolve() in known:
            raise SpecError(f"{path}: is named more than once")
        known.add(path.resolve())


def _load_one(path: Path) -> StudyResults:
    if path.is_file():
        kept = published.load(path)
        remarks = (f"{path}: {kept.note}",) if kept.note else ()
        sources = Sources(brought_by=str(path))
        return StudyResults(kept.outline, kept.results, (), remarks, sources)
    with Store.open(path) as store:
        store.verify()
        return StudyResults.of(store)


def _merge(paths: Sequence[Path], studies: Sequence[StudyResults]) -> StudyResults:
    """Return the results of several studies, or of parts of one, as those of one."""
    whole = join_parts([(study.outline, study.results) for study in studies])
    tables = dict[str, SpecTable]()
    if whole is not None:
        outline, results = whole
        labels = [{c: c for c in results.columns}] * len(studies)
    else:
        names = [path.name for path in paths]
        if len(set(names)) < len(names):
            names = list(map(str, paths))
        results, labels = combine(
            [(name, study.results) for name, study in zip(names, studies, strict=True)],
            [study._settings for study in studies],
        )
        outline = studies[0].outline._replace(columns=results.columns)
        tables = {n: study.outline.table for n, study in zip(names, studies, strict=True)}
    settings = dict[str, TomlTable]()
    failed = list[tuple[str, int, str]]()
    for study, new in zip(studies, labels, strict=True):
        settings |= {new[condition]: own for condition, own in study._settings.items()}
        failed += [(new[condition], seed, error) for condition, seed, error in study.failed]
    return StudyResults(
        outline=outline,
        results=results,
        failed=tuple(failed),
        remarks=tuple(remark for study in studies for remark in study.remarks),
        _sources=studies[0]._sources,
        _settings=settings,
        _directories=tuple(path for study in studies for path in study._directories),
        _tables=tables,
        _is_whole=False,
    )
