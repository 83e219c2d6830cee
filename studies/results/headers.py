"""The file ``study.json``, which describes the study of the exported files in its folder."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from ..spec.outline import StudyOutline
from ..store.durable import read_text
from .json_files import CHECKSUM, checksum, in_lines
from .published import header
from .results import Results
from .results_file import HEADER


def describe(
    outline: StudyOutline, results: Results, files: Mapping[str, bytes], folder: Path
) -> bytes:
    """Return the content of the file that describes exported files by name.

    It also lists the files of the same study in another form that were exported to the folder.
    """
    described = json.loads(json.dumps(header(outline, results)))
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    with suppress(OSError, ValueError, RecursionError):
        there = json.loads(read_text(folder / HEADER))
        if there[CHECKSUM] == checksum(there) and there.items() >= described.items():
            digests = there["files"] | digests
    return in_lines({**described, "files": digests}).encode()


def extends(path: Path, content: bytes) -> bool:
    """Return whether a content is that of a file, or lists more files of the same study."""
    there = path.read_bytes()
    if path.name != HEADER or there == content:
        return there == content
    with suppress(ValueError, RecursionError, AttributeError, KeyError, TypeError):
        old, new = json.loads(there), json.loads(content)
        files = new["files"] | old["files"]
        return bool({**old, "files": files, CHECKSUM: ""} == {**new, CHECKSUM: ""})
    return False
