"""Results that a command reads: of one study or several, or a part of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.plugins.sources import is_trusted
from ...core.plugins.sources import trust as trust_text
from ..presentation.progress import say
from ..spec.outline import other_spec
from ..store.store import Store

if TYPE_CHECKING:
    from ..api.study import StudyResults


@contextmanager
def opened(directory: Path) -> Iterator[Store]:
    """Open a study to read it, and say so if the spec beside its database is another one."""
    with Store.open(directory) as store:
        if (remark := other_spec(store)) is not None:
            say(remark)
        yield store


def load_results(
    sources: Sequence[Path], *, study: str | None = None, where: str | None = None, trust: bool
) -> StudyResults:
    """Return the results at some places, as a study analyses them, or a choice of the trials."""
    from ..api.study import load

    if trust:
        for source in sources:
            if source.is_dir():
                trust_files(source)
    results = load(*sources)
    for remark in results.remarks:
        say(remark)
    results = results if where is None else results.where(where)
    return results if study is None else results.as_study(study)


def trust_files(directory: Path) -> None:
    """Allow the Python files that are kept with a study to be run, and say which."""
    with Store.open(directory) as store:
        texts = store.sources()
    for name, text in texts.items():
        if name.endswith(".py") and not is_trusted(text):
            say(f"{name}, which came with {directory}, is trusted from now on")
            trust_text(text)
