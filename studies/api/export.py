"""Results as files: tidy tables as CSV or Parquet, or one small JSON file."""

from __future__ import annotations

import io
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ..catalogue.study import published_part
from ..errors import SpecError
from ..presentation.csv_text import write_frame
from ..results import published
from ..results.results import read
from ..spec.outline import StudyOutline
from ..store.durable import replacing
from ..store.store import Store

if TYPE_CHECKING:
    from pandas import DataFrame

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
    results = read(store)
    if form == "json":
        outline = StudyOutline.kept(store)
        kept = published_part(outline.study, results)
        return {"results": lambda path: published.write(path, outline, kept)}
    if form == "parquet" and not find_spec("pyarrow"):
        raise SpecError(
            "--format parquet: pyarrow is not installed; pip install 'nested-agents[parquet]'"
        )
    write = _write_csv if form == "csv" else _write_parquet
    return {
        "episodes": lambda path: write(results.episodes, path),
        "trials": lambda path: write(results.trials, path),
    }


def _write_csv(frame: DataFrame, path: Path) -> None:
    """Write a frame as CSV: truth values as 0 and 1, texts as they may stand in a spreadsheet."""
    with replacing(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        write_frame(text, frame)
        text.detach()


def _write_parquet(frame: DataFrame, path: Path) -> None:
    """Write a frame as Parquet; a column of numbers and texts is one of texts."""
    mixed = [n for n in frame if frame[n].dtype == object]
    texts = {n: frame[n].map(str, na_action="ignore") for n in mixed}
    with replacing(path) as file:
        frame.assign(**texts).to_parquet(file, index=False)
