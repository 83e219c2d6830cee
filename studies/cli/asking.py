"""Results that a command asks for: of one study or several, or a part of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..api.study import StudyResults, load
from ..presentation.progress import say
from .trusting import trust_files


def asked(
    sources: Sequence[Path], study: str | None, where: str | None, *, trust: bool
) -> StudyResults:
    """Return the results at some places, as a study analyses them, or a choice of the trials."""
    if trust:
        for source in sources:
            if source.is_dir():
                trust_files(source)
    found = load(*sources)
    for remark in found.remarks:
        say(remark)
    found = found if where is None else found.where(where)
    return found if study is None else found.as_study(study)
