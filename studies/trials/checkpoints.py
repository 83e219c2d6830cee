"""Checkpoints: the state of a running trial, from which an interrupted trial resumes.

Each trial that takes minutes has one file in the folder of the study. It is replaced every few
minutes and deleted when the result of the trial is stored. It contains arrays of numbers and a JSON
table, after a digest of both. A checkpoint that is damaged or belongs to another trial or to other
code is ignored. A resumed trial gives the same rows, bit for bit.
"""

from __future__ import annotations

import hashlib
import io
import json
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...core.learners import LEARNERS
from ..store.durable import Recording, read_bytes, remove_incomplete, write
from .trial import Trial

TABLE = "table"
"""Name of the array that holds the JSON text."""
DIGEST_LENGTH = 64
"""Number of characters before the arrays."""


class Checkpoint:
    """The checkpoint file of a trial; see `Sources.checkpoints` for its folder.

    The state of user code is unknown, so a trial with user code has none.
    """

    def __init__(self, trial: Trial) -> None:
        is_built_in = trial.settings.learner.kind in LEARNERS.built_in
        has_own_code = any(name.endswith(".py") for name in trial.sources.texts)
        checkpoints = trial.sources.checkpoints if is_built_in and not has_own_code else None
        self._path: Path | None = None
        self._seconds = 0.0
        self._origin = [trial.identity, ""]
        if checkpoints is not None:
            folder, self._seconds, self._origin[1] = checkpoints
            self._path = folder / f"{trial.identity}.npz"
        self._next = time.monotonic() + self._seconds

    @property
    def is_due(self) -> bool:
        """Whether it is time to write a checkpoint."""
        return self._path is not None and time.monotonic() >= self._next

    def write(self, table: Mapping[str, Any], groups: Mapping[str, Recording]) -> None:
        """Replace the file by a JSON table and groups of arrays.

        If it cannot be written, the trial continues without it.
        """
        if self._path is None:
            return
        arrays = {
            f"{group}/{k}": array for group, own in groups.items() for k, array in own.items()
        }
        text = json.dumps({**table, "origin": self._origin}, allow_nan=False)
        buffer = io.BytesIO()
        arrays[TABLE] = np.frombuffer(text.encode(), np.uint8)
        np.savez(buffer, allow_pickle=False, **arrays)
        content = buffer.getvalue()
        digest = hashlib.sha256(content).hexdigest().encode()
        with suppress(OSError, ValueError):
            write(self._path, digest + content)
        self._next = time.monotonic() + self._seconds

    def read(self) -> tuple[dict[str, Any], dict[str, Recording]] | None:
        """Return table and arrays; None if there are none from which this trial can resume."""
        if self._path is None:
            return None
        try:
            content = _content(self._path)
            if content is None:
                return None
            groups: dict[str, Recording] = {}
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                table = json.loads(file[TABLE].tobytes())
                for key in file.files:
                    group, _, name = key.partition("/")
                    groups.setdefault(group, {})[name] = file[key]
        except (OSError, ValueError, KeyError, TypeError, EOFError):
            return None
        return (table, groups) if table.get("origin") == self._origin else None


def remove_damaged(folder: Path) -> Iterator[str]:
    """Delete incomplete and damaged checkpoints, and yield a remark on each damaged one."""
    remove_incomplete(folder)
    for file in sorted(folder.glob("*.npz")):
        if _content(file) is None:
            file.unlink()
            yield f"{file}: is damaged, its trial starts from the beginning"


def _content(path: Path) -> bytes | None:
    """Return the arrays in a file as bytes; None if they do not match their digest."""
    content = read_bytes(path)
    digest = hashlib.sha256(content[DIGEST_LENGTH:]).hexdigest().encode()
    return content[DIGEST_LENGTH:] if content[:DIGEST_LENGTH] == digest else None
