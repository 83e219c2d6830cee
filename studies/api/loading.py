"""Loading of results: kept studies, exported files, and results of other tools."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import get_args

from ...core.numerics import pd
from ...core.plugins.sources import Sources
from ...core.plugins.words import closest, expect, expect_each
from ..errors import SpecError, refused
from ..results import published
from ..results.exported import is_exported, read_export
from ..results.foreign_tables import ROLES, columns_by_role, parse_roles, read_scores
from ..results.joining import combine, join_parts
from ..results.json_files import read_json
from ..results.marl_eval import Runs, is_exported_by, read_runs, results_of_runs
from ..results.results_file import HEADER, Header
from ..results.score_tables import SUFFIXES, ScoreTable, read_table, table_of
from ..results.scores import Better, ScoreResults
from ..spec.outline import StudyOutline
from ..spec.tables import SpecTable, TomlTable
from ..store.database import NoStudyError
from ..store.durable import read_text
from ..store.store import Store
from .comparison import Comparison
from .data import Place
from .study import StudyResults

Roles = Mapping[str, str | Sequence[str]]
"""Column of a table by its role, see `foreign_tables.ROLES`."""


def load(*places: Place, columns: Sequence[str] = (), better: Better | None = None) -> StudyResults:
    """Return the results of a study that is kept in a directory, or of several together.

    Parameters
    ----------
    *places
        Directories of studies; single files that ``export`` has written; files of the form of
        marl-eval, as BenchMARL and Mava write them, which are put together if no run is in two of
        them; or tables of scores of other tools: CSV, JSON lines, JSON or Parquet, see
        `nested_agents.studies.results.foreign_tables`.
        Parts of one study, with specs that differ only in their seeds, are joined. Conditions of
        several studies with equal labels get the name of their directory. The first study
        determines the analysis.
    columns
        Roles of the columns of tables of scores: ``"condition=model,seed=run,score=accuracy"``. By
        default a column has the role that it is called by.
    better
        Which scores of other tools are better, by default higher ones.

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
    paths = _without_descriptions(paths)
    roles = parse_roles(columns)
    opened = {path: _open(path) for path in paths}
    if roles and not any(isinstance(own, ScoreTable) for own in opened.values()):
        raise SpecError(f"columns: are of tables, {', '.join(SUFFIXES)}")
    if better is not None and all(isinstance(own, StudyResults) for own in opened.values()):
        raise SpecError("better: is of results of other tools; a study knows what is better")
    loaded = _results_of(opened, roles, better or "higher")
    return _merge(loaded) if len(loaded) > 1 else next(iter(loaded.values()))


def compare_table(
    table: pd.DataFrame | Place,
    *,
    better: Better = "higher",
    by: str | None = None,
    measure: str | None = None,
    phase: str | None = None,
    reference: str | None = None,
    **columns: str | Sequence[str] | None,
) -> Comparison:
    """Compare conditions by a table of scores of any tool.

    The command ``compare`` does the same. Runs and items are paired by name; a table without seeds
    and items holds independent samples.

    Parameters
    ----------
    table
        A row for each score; or a file of it, CSV, JSON lines, JSON or Parquet.
    better
        Which scores are better.
    by, measure, phase, reference
        As in `StudyResults.compare`. The reference is by default the first condition by name.
    **columns
        By role: `condition` is what is compared, and `score` what is measured (several conditions
        are crossed, and of several scores the first is compared); `seed` names the run, `item` the
        question or task, `step` the step of training. By default a column has the role that it is
        called by, also the role ``phase``.

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
    if better not in get_args(Better):
        raise SpecError(f"better = {better!r}, allowed: {' or '.join(get_args(Better))}")
    for role in columns:
        if role not in ROLES:
            raise TypeError(f"compare_table: unknown argument {role!r}; {closest(role, ROLES)}")
    roles = {role: column for role, column in columns.items() if column is not None}
    expect("names of columns", Sequence, **roles)
    expect_each("names of columns", str, **roles)
    if isinstance(table, pd.DataFrame):
        results = _of_table(table_of(table), None, roles, better)
    else:
        path = Path(table)
        results = _results_of({path: _open(path)}, roles, better)[path]
    return results.compare(by, measure, phase=phase, reference=reference)


Opened = StudyResults | ScoreTable | Runs
"""Content of a path: a study, a table, or runs in the form of marl-eval."""


def _open(path: Path) -> Opened:
    """Return what a path holds.

    Raises
    ------
    SpecError
        If it holds none of these.
    """
    if path.suffix in SUFFIXES and not path.is_dir():
        return read_table(path)
    if not path.is_file():
        return _open_study(path)
    try:
        text = read_text(path)
        file = read_json(text)
        if isinstance(file, list):
            return read_table(path)
        if not isinstance(file, dict) or "results_version" not in file:
            return read_runs(file)
        kept = published.loads(text)
    except (OSError, ValueError, RecursionError) as error:
        if isinstance(error, SpecError):
            raise
        raise SpecError(f"{path}: holds no published results: {error}") from None
    remarks = tuple(f"{path}: {note}" for note in kept.notes)
    return StudyResults(kept.outline, kept.results, (), remarks, _sources_beside(path))


def _open_study(path: Path) -> StudyResults:
    """Return the results of a study's folder; a refusal names a file of results in another one."""
    try:
        with Store.open(path) as store:
            store.verify()
            return StudyResults.of(store)
    except NoStudyError as error:
        files = [f for f in path.glob("*") if f.suffix in (*SUFFIXES, ".json") and f.name != HEADER]
        hint = f"; name a file of results, as {min(files)}" if files else ""
        raise NoStudyError(f"{error}{hint}") from None


def _sources_beside(path: Path | None) -> Sources:
    """Return the files that somebody else's file of results may name: those of its folder."""
    return Sources(path and path.parent, brought_by=str(path or "a table"))


def _results_of(
    opened: Mapping[Path, Opened], roles: Roles, better: Better
) -> dict[Path, StudyResults]:
    """Return the results of what paths hold; runs of several files are put together."""
    runs = {path: own for path, own in opened.items() if isinstance(own, dict)}
    joined = {name: rows for own in runs.values() for name, rows in own.items()}
    if len(runs) > 1 and len(joined) == sum(map(len, runs.values())):
        runs = {next(iter(runs)): joined}
    loaded: dict[Path, StudyResults] = {}
    with_episodes = {_trials_beside(path) for path in opened}
    for path, own in opened.items():
        if path in with_episodes:
            continue
        if isinstance(own, StudyResults):
            loaded[path] = own
        elif isinstance(own, ScoreTable):
            loaded[path] = _of_table(own, path, roles, better)
        elif path in runs:
            loaded[path] = _of_runs(runs[path], path, better)
    return loaded


def _trials_beside(path: Path) -> Path | None:
    """Return the exported trials of a table of exported episodes, if they are there unchanged."""
    if path.stem != "episodes":
        return None
    header = Header.in_folder_of(path)
    trials = path.with_stem("trials")
    is_known = header is not None and path.name in header.files and header.has_unchanged(trials)
    return trials if is_known else None


def _of_table(table: ScoreTable, path: Path | None, roles: Roles, better: Better) -> StudyResults:
    """Return the results of a table of scores, or of an exported one; messages name its file."""
    header = Header.in_folder_of(path) if path else None
    is_listed = header is not None and path is not None and path.name in header.files
    with refused(f"{path}: " if path else ""):
        if is_exported(table, is_listed=is_listed) and roles.keys() <= {"score"}:
            _check_better(better)
            measure = next(iter(map(str, roles.values())), None)
            beside = _trials_beside(path) if path else None
            trials = read_table(beside) if beside else None
            return _of_scores(read_export(table, header, trials), path, header, measure)
        columns = columns_by_role(roles, table.columns)
        read = read_scores(table, columns, better)
    notes = header.remarks(path) if header and path and is_listed else ()
    return _of_scores(read._replace(notes=(*notes, *read.notes)), path)


def _of_runs(runs: Runs, path: Path, better: Better) -> StudyResults:
    """Return the results of runs of the form of marl-eval."""
    header = Header.in_folder_of(path)
    notes: tuple[str, ...] = ()
    if header is not None and not is_exported_by(runs, header):
        notes = header.remarks(path) if path.name in header.files else ()
        header = None
    with refused(f"{path}: "):
        if header is not None:
            _check_better(better)
        read = results_of_runs(runs, better, header)
    return _of_scores(read._replace(notes=(*notes, *read.notes)), path, header)


def _check_better(better: Better) -> None:
    """Refuse ``lower`` for exported results: it is known which of their values are better."""
    if better == "lower":
        raise ValueError(
            "better = 'lower': the columns are those of an exported study, which knows what is "
            "better; allowed: no direction, or other names of columns"
        )


def _of_scores(
    read: ScoreResults,
    path: Path | None,
    header: Header | None = None,
    measure: str | None = None,
) -> StudyResults:
    """Return the results of a file of scores as those of a study."""
    results, notes = read.results, read.notes
    table = {"study": "learning-curve", "seeds": 1, "episodes": 0, "steps": 0, "evaluation": 1}
    outline = StudyOutline.noted(table, results.columns)
    if header is not None and path is not None:
        outline = header.outline
        results = header.limited(results)
        notes = (*header.remarks(path), *notes)
    remarks = tuple(f"{path}: {line}" if path else line for line in notes)
    sources = _sources_beside(path)
    return StudyResults(outline, results, (), remarks, sources, _defaults=(measure, read.by))


def _without_descriptions(paths: Sequence[Path]) -> list[Path]:
    """Return paths without the files that describe exported ones, which a pattern also names."""
    described: dict[Path, Header] = {}
    for path in paths:
        with suppress(SpecError):  # a file of this name may hold other results
            header = Header.in_folder_of(path) if path.name == HEADER else None
            described |= {path: header} if header else {}
    rest = [path for path in paths if path not in described]
    if not rest:
        names = ", ".join(described[paths[0]].files) or "none"
        raise SpecError(f"{paths[0]}: holds no results, it describes exported files: {names}")
    return rest


def _check_distinct(paths: Sequence[Path]) -> None:
    """Refuse paths of which two are the same place."""
    places = list(map(os.path.realpath, paths))
    for k, path in enumerate(paths):
        if places[k] in places[:k]:
            raise SpecError(f"{path}: is named more than once")


def _merge(loaded: Mapping[Path, StudyResults]) -> StudyResults:
    """Return the results of several studies, or of parts of one, as those of one."""
    studies = list(loaded.values())
    whole = join_parts([(study.outline, study.results) for study in studies])
    tables = dict[str, SpecTable]()
    if whole is not None:
        outline, results = whole
        labels = [{c: c for c in results.columns}] * len(studies)
    else:
        is_named = len({path.name for path in loaded}) == len(loaded)
        named = {path.name if is_named else str(path): own for path, own in loaded.items()}
        results, labels = combine([(name, study.results) for name, study in named.items()])
        outline = studies[0].outline._replace(columns=results.columns)
        tables = {name: study.outline.table for name, study in named.items()}
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
