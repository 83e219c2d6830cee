"""``nested-agents export``: what a study holds, as files for other programs."""

from pathlib import Path
from typing import Literal

import click

from ...catalogue.study import published_part
from ...errors import SpecError
from ...presentation.row_formats import in_csv
from ...results import published
from ...results.results import read
from ...spec.outline import StudyOutline
from ...store import durable
from ...store.store import Store
from .. import options
from ..loading import opened

Form = Literal["csv", "json", "marl-eval"]


@click.command()
@options.directory
@options.formats(
    "csv",
    "json",
    "marl-eval",
    text="Of the files; distances and returns are left out of json.",
)
@options.out("Folder of the files; by default export in the study's own.", "PATH")
@click.option("--overwrite", is_flag=True, help="Replace files that are there.")
def command(directory: Path, form: Form, out: Path | None, overwrite: bool) -> int:
    """Write one file with a row for every episode, and one with a row for every trial.

    DIR is where the study is kept. JSON is one small file of spec, seeds and rounded measures, fit
    to be published with a paper; `nested-agents table` reads it.
    """
    with opened(directory) as store:
        folder = directory / "export" if out is None else out
        for path in export(store, folder, form, overwrite=overwrite):
            print(path)
    return 0


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
        If a file is in the way, or the database is damaged.
    """
    store.verify()
    paths = {folder / name: text for name, text in _texts(store, form).items()}
    there = [path for path in paths if path.exists()]
    # Of an export that was killed the first file is left, and is what would be written.
    is_rest = len(there) < len(paths) and all(_holds(path, paths[path]) for path in there)
    if there and not (overwrite or is_rest):
        raise SpecError(f"{there[0]}: exists; --overwrite replaces it, --out writes elsewhere")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SpecError(f"--out {folder}: {error.strerror or error}") from None
    for path, text in paths.items():
        durable.write(path, text.encode())
    return list(paths)


def _holds(path: Path, text: str) -> bool:
    return path.is_file() and path.read_bytes() == text.encode()


def _texts(store: Store, form: Form) -> dict[str, str]:
    """Return the content of each file by its name."""
    results, outline = read(store), StudyOutline.kept(store)
    if form == "json":
        kept = published_part(outline.study, results)
        return {"results.json": published.dumps(outline, kept)}
    if form == "marl-eval":
        kinds = {c: own["scenario"]["kind"] for c, own in store.settings().items()}
        return {"marl-eval.json": published.dumps_marl_eval(results, kinds, outline.study)}
    frames = {"episodes.csv": results.episodes, "trials.csv": results.trials}
    return {name: in_csv(frame) for name, frame in frames.items()}
