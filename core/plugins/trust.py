"""Which Python files of users may be run: what they ran themselves, or declared that they trust.

A study keeps the files that its spec names, and runs them again when it is explained or continued.
Of a study that came from somebody else, nothing may be run unasked; a digest inside it would
protect nobody. So every file that is run from a spec in hand is noted, by the SHA-256 of its text,
in a list outside of all studies: ``$XDG_STATE_HOME/nested-agents/trusted``, by default below
``~/.local/state``. What a study brings along is run if the list has it.
"""

import contextlib
import hashlib
import os
from pathlib import Path

_here: set[str] = set()
"""What this process trusts, also where no list can be written."""


def trusted_list() -> Path:
    """Return where the list is."""
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "nested-agents" / "trusted"


def is_trusted(text: str) -> bool:
    """Tell whether a file of this text may be run."""
    digest = _digest(text)
    if digest in _here:
        return True
    try:
        return digest in trusted_list().read_text(encoding="ascii").split()
    except (OSError, ValueError):
        return False


def trust(text: str) -> None:
    """Allow a file of this text to be run from now on; if no list can be written, only for now."""
    if is_trusted(text):
        return
    digest = _digest(text)
    _here.add(digest)
    path = trusted_list()
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "a", encoding="ascii") as file:
            file.write(f"{digest}\n")


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
