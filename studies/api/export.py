"""Results as files: tidy tables as CSV, or one JSON file."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ..catalogue.study import published_part
from ..errors import SpecError
from ..presentation.csv_text import write_frame
from ..results import marl_eval, published
from ..results.results import read
from ..spec.outline import StudyOutline
from ..store import durable
from ..store.store import Store

if TYPE_CHECKING:
    from pandas import DataFrame

Form = Literal["csv", "json", "marl-eval"]


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
        `nested_agents.studies.results.published`, marl-eval, ``marl-eval.json``, that of
        `nested_agents.studies.results.marl_eval`.
    overwrite
        Whether files of these names may be replaced.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    SpecError
        If a file is in the way, or the database is damaged.
    """
    writers = _writers(store, form)
    suffix = "json" if form == "marl-eval" else form
    paths = {name: folder / f"{name}.{suffix}" for name in writers}
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
    if form == "marl-eval":
        kinds = {c: own["scenario"]["kind"] for c, own in store.settings().items()}
        text = marl_eval.dumps(results, kinds, StudyOutline.kept(store).study)
        return {"marl-eval": lambda path: durable.write(path, text.encode())}
    return {
        "episodes": lambda path: _write_csv(results.episodes, path),
        "trials": lambda path: _write_csv(results.trials, path),
    }


def _write_csv(frame: DataFrame, path: Path) -> None:
    """Write a frame as CSV: truth values as 0 and 1, texts as they may stand in a spreadsheet."""
    with durable.replacing(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        write_frame(text, frame)
        text.detach()
