"""Results as files: tidy tables as CSV or Parquet, or one small JSON file."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence, Set
from pathlib import Path
from typing import Any, Literal

from ..results import published
from ..results.results import read
from ..spec.errors import SpecError
from ..spec.outline import Outline
from ..store.durable import replacing
from ..store.reading import NamesAndRows
from ..store.store import Store
from .csv_text import write_csv

Form = Literal["csv", "parquet", "json"]


def export(store: Store, folder: Path, form: Form, *, overwrite: bool = False) -> list[Path]:
    """Write what a study holds; a file is there whole or not at all.

    Parameters
    ----------
    store
        An open study.
    folder
        Where to write ``episodes`` and ``trials``, or with JSON ``results``; made if it does not
        exist.
    form
        Of the files, and their suffix; JSON is the form of
        `nested_agents.studies.results.published`.
    overwrite
        Whether files of these names may be replaced.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    SpecError
        If a file is in the way, the extra ``parquet`` is not installed, or the database is damaged.
    """
    writers = _writers(store, form)
    paths = {name: folder / f"{name}.{form}" for name in writers}
    for path in paths.values():
        if path.exists() and not overwrite:
            raise SpecError(f"{path}: exists; --overwrite replaces it, --out writes elsewhere")
    store.verify()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SpecError(f"--out {folder}: {error.strerror or error}") from None
    for name, write_to in writers.items():
        write_to(paths[name])
    return list(paths.values())


def _writers(store: Store, form: Form) -> dict[str, Callable[[Path], None]]:
    """Return what writes each file, by its name."""
    if form == "json":
        version = int(store.meta("results_version"))
        return {
            "results": lambda path: published.write(path, Outline.kept(store), read(store), version)
        }
    rates = {measure.name for measure in store.measures() if measure.is_rate}
    write_table = _write_csv if form == "csv" else _parquet_writer(rates)
    return {
        "episodes": lambda path: write_table(store.episodes(), path),
        "trials": lambda path: write_table(store.trials(), path),
    }


def _write_csv(table: NamesAndRows, path: Path) -> None:
    names, rows = table
    with replacing(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        write_csv(text, names, rows)
        text.detach()


def _parquet_writer(rates: Set[str]) -> Any:
    """Return what writes a table as Parquet, columns named in `rates` as truth values."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError as error:
        raise SpecError(
            f"--format parquet: {error.name} is not installed; pip install 'nested-agents[parquet]'"
        ) from None

    def write(table: NamesAndRows, path: Path) -> None:
        names, rows = table[0], list(table[1])
        columns = {
            n: _column([row[i] for row in rows], is_rate=n in rates) for i, n in enumerate(names)
        }
        with replacing(path) as file:
            pyarrow.parquet.write_table(pyarrow.table(columns), file)

    return write


def _column(values: Sequence[Any], *, is_rate: bool) -> list[Any]:
    """Return values of one type: numbers if all are, else text; what is missing stays missing."""
    if is_rate:
        return [None if value is None else bool(value) for value in values]
    types = {type(value) for value in values if value is not None}
    if len(types) <= 1:
        return list(values)
    if types == {int, float}:
        return [None if value is None else float(value) for value in values]
    return [None if value is None else str(value) for value in values]
