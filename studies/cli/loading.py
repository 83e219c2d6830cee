"""Studies that a command opens: their results, how far they are, and whether they are trusted."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ...core.plugins.sources import Sources, files_in, is_file, is_reference, split
from ...core.plugins.trust import is_trusted, module_text, modules_in
from ...core.plugins.trust import trust as trust_text
from ..errors import refused
from ..presentation.progress import say
from ..spec.outline import other_spec
from ..store.database import DATABASE, SPEC_FILE
from ..store.durable import read_text
from ..store.store import Store

if TYPE_CHECKING:
    from ..api.study import StudyResults
    from ..spec.spec import Spec


@contextmanager
def open_study(directory: Path) -> Iterator[Store]:
    """Open a study for reading, and report if the spec in its folder differs from its database."""
    with Store.open(directory) as store:
        if (remark := other_spec(store)) is not None:
            say(remark)
        yield store


def load_results(
    sources: Sequence[Path], *, study: str | None = None, where: str | None = None, trust: bool
) -> StudyResults:
    """Return the results at some places, as a study analyses them, and print their remarks."""
    results = read_results(sources, where=where, trust=trust)
    say_remarks(results)
    return results if study is None else results.as_study(study)


def read_results(
    sources: Sequence[Path],
    *,
    where: str | None,
    trust: bool,
    columns: Sequence[str] = (),
    better: Literal["higher", "lower"] | None = None,
) -> StudyResults:
    """Return the results at some places, or a choice of their trials."""
    from ..api.loading import load

    if trust:
        trust_files(*sources)
    results = load(*sources, columns=columns, better=better)
    return results if where is None else results.where(where)


def say_remarks(results: StudyResults) -> None:
    """Print the remarks on results, apart from what other programs read."""
    for remark in results.remarks:
        say(remark)


def trust_files(*sources: Path) -> None:
    """Allow what studies keep and name to be run and imported, and say what."""
    for source in sources:
        _trust(untrusted(source))


def trust_beside(*places: Path) -> None:
    """Do so for the studies that places are, or lie in as their specs do, and for what these name.

    The spec in the folder of a database may name other files than the database keeps.
    """
    folders = {place if place.is_dir() else place.parent for place in map(Path.resolve, places)}
    for folder in folders:
        if (folder / DATABASE).exists():
            _trust(untrusted(folder))
            _trust(_named_by_copy(folder))


def load_spec(path: Path, changes: Sequence[str], *, trust: bool, out: Path | None = None) -> Spec:
    """Read a spec and change it; `trust` allows the code of the study beside it or in `out`."""
    from ..spec.spec import Spec

    if trust:
        trust_beside(*filter(None, (out, path)))
    return Spec.load(path, changes, study=out)


def _trust(texts: Mapping[str, str]) -> None:
    for title, text in texts.items():
        lasting = trust_text(text)
        say(f"{title} is trusted {'from now on' if lasting else 'in this run, but not later'}")


def _named_by_copy(folder: Path) -> dict[str, str]:
    """Return the code that the spec in the folder of a database names; empty without a spec."""
    try:
        table = tomllib.loads(read_text(folder / SPEC_FILE))
        files = {name: Sources(folder).text(name) for name in sorted(files_in(table))}
    except (OSError, ValueError, RecursionError):
        return {}  # the reader of the spec reports this
    return _untrusted(folder, files, table)


def untrusted(source: Path) -> dict[str, str]:
    """Return the untrusted code that a study contains or names.

    These are the Python files that are kept with it, and modules by name; those of a file of
    results are named in its spec. Of the files that such a spec names, only the study's is run.
    """
    files: dict[str, str] = {}
    if source.is_dir():
        with Store.open(source) as store:
            files = store.sources()
            tables: object = [store.spec(), *store.settings().values()]
    else:
        from ..api.loading import load  # pandas takes its time

        outline = load(source).outline
        tables = outline.table
        if is_reference(outline.study):
            name = split(outline.study)[0]
            with refused(f"{source}: study: "):
                files = {name: Sources(source.parent).text(name)}
    return _untrusted(source, files, tables)


def _untrusted(source: Path, files: Mapping[str, str], tables: object) -> dict[str, str]:
    """Return untrusted files, and untrusted modules that tables and files of hierarchies name."""
    texts = {f"{n}, which came with {source},": t for n, t in files.items() if n.endswith(".py")}
    from ...topologies.files import read_file  # NumPy and pydantic take their time

    contents: list[object] = []
    with Sources(None, files).active():
        for name in filter(is_file, files):
            with suppress(ValueError):  # reported when the hierarchy is built
                contents.append(read_file(name))
    modules = {module for module, _ in modules_in([tables, contents])}
    texts |= {f"{name}, which {source} names,": module_text(name) for name in sorted(modules)}
    return {title: text for title, text in texts.items() if not is_trusted(text)}
