"""Copies of users' files in a private folder, next to which numba caches compiled code.

The index of numba's cache is a pickle in ``__pycache__`` next to the file that defines the
function. In a downloaded folder, reading this index would run the code of another person, and a
file that is kept with a study is not in any folder.
"""

import os
import tempfile
from pathlib import Path

from .trust import sha256


def compiled_name(name: str, text: str) -> str:
    """Return the file name for compiling the text of a file: for numba users, that of a copy.

    Parameters
    ----------
    name
        Path of the file.
    text
        Text of the file.
    """
    if not any(word in text for word in ("numba", "njit")):
        return name
    try:
        cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        copy = Path(cache, "nested-agents", "files", sha256(text)[:16], Path(name).name)
        copy.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not copy.exists() or copy.read_text(encoding="utf-8") != text:
            with tempfile.NamedTemporaryFile(
                "w", encoding="utf-8", dir=copy.parent, delete=False
            ) as file:
                file.write(text)
            os.replace(file.name, copy)
    except (OSError, RuntimeError, ValueError):  # no home, or nothing can be written there
        return f"<{name}>"  # numba then has nowhere to read or write compiled code
    return str(copy)
