"""Trust in the Python files that a study brings along, if the user says so."""

from __future__ import annotations

from pathlib import Path

from ...core.plugins import trust
from ..presentation.progress import say
from ..store.store import Store


def trust_files(directory: Path) -> None:
    """Allow the files that are kept with a study to be run, and say which."""
    with Store.open(directory) as store:
        texts = store.sources()
    for name, text in texts.items():
        if name.endswith(".py") and not trust.is_trusted(text):
            say(f"{name}, which came with {directory}, is trusted from now on")
            trust.trust(text)
