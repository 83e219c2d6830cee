"""Studies that a command opens: their results, how far they are, and whether they are trusted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ...core.plugins.trust import LIBRARIES, is_trusted, module_text, modules_in
from ...core.plugins.trust import trust as trust_text
from ..presentation.progress import say
from ..spec.outline import other_spec
from ..store.database import DATABASE
from ..store.store import Store

if TYPE_CHECKING:
    from ..api.study import StudyResults


@contextmanager
def open_study(directory: Path) -> Iterator[Store]:
    """Open a study to read it, and say so if the spec beside its database is another one."""
    with Store.open(directory) as store:
        if (remark := other_spec(store)) is not None:
            say(remark)
        yield store


def load_results(
    sources: Sequence[Path],
    *,
    study: str | None = None,
    where: str | None = None,
    trust: bool,
    columns: Sequence[str] = (),
    better: Literal["higher", "lower"] = "higher",
) -> StudyResults:
    """Return the results at some places, as a study analyses them, or a choice of the trials."""
    from ..api.loading import load

    if trust:
        trust_files(*sources)
    results = load(*sources, columns=columns, better=better)
    for remark in results.remarks:
        say(remark)
    results = results if where is None else results.where(where)
    return results if study is None else results.as_study(study)


def trust_files(*sources: Path) -> None:
    """Allow what studies keep and name to be run and imported, and say what."""
    for source in sources:
        for title, text in untrusted(source).items():
            say(f"{title} is trusted from now on")
            trust_text(text)


def trust_beside(*places: Path) -> None:
    """Do so for the studies that places are, or lie in as their specs do."""
    folders = {place if place.is_dir() else place.parent for place in map(Path.resolve, places)}
    trust_files(*(folder for folder in folders if (folder / DATABASE).exists()))


def untrusted(source: Path) -> dict[str, str]:
    """Return the code of others that a study brings along or names, by what it is.

    These are the Python files that are kept with it, and modules by name; those of a file of
    results are named in its spec.
    """
    texts: dict[str, str] = {}
    if source.is_dir():
        with Store.open(source) as store:
            kept = store.sources()
            tables: object = [store.spec(), *store.settings().values()]
        texts = {f"{n}, which came with {source},": t for n, t in kept.items() if n.endswith(".py")}
    else:
        from ..results import published  # pandas takes its time

        tables = published.load(source).outline.table
    modules = {m for m, _ in modules_in(tables) if m.partition(".")[0] not in LIBRARIES}
    texts |= {f"{name}, which {source} names,": module_text(name) for name in modules}
    return {title: text for title, text in texts.items() if not is_trusted(text)}
