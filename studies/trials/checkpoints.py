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
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.interface.agents import select_prefix
from ...core.learners import LEARNERS
from ...core.plugins.sources import Checkpoints
from ..store.durable import Recording, read_bytes, write
from .episodes import EpisodeRow
from .trial import Trial

TABLE = "table"
"""Name of the array that holds the JSON text."""
DIGEST_LENGTH = 64
"""Number of characters before the arrays."""


class CheckpointState(NamedTuple):
    """State of a running trial."""

    rows: Sequence[EpisodeRow]
    """Episodes so far."""
    seconds: Mapping[str, float]
    """Duration of each part of the control loop [s]."""
    usage: Mapping[str, float]
    """Other resources that the trial has used, by name."""
    training_cpu_s: float
    """Processor time of `Session.train_until` [s]."""
    recordings: Mapping[str, Recording]
    """Recordings as in `TrialResult`."""
    team: Recording
    """State of the team."""


class Checkpoint:
    """The checkpoint file of a trial."""

    def __init__(self, trial: Trial) -> None:
        self._location = location(trial)
        self._identity = trial.identity
        self._next = time.monotonic() + (self._location.seconds if self._location else 0.0)

    @property
    def is_due(self) -> bool:
        """Whether it is time to write a checkpoint."""
        return self._location is not None and time.monotonic() >= self._next

    def write(self, state: CheckpointState) -> None:
        """Replace the file. If it cannot be written, the trial continues without it."""
        if self._location is None:
            return
        table = {
            "identity": self._identity,
            "code": self._location.code,
            "rows": [[*row] for row in state.rows],
            "seconds": dict(state.seconds),
            "usage": dict(state.usage),
            "training_cpu_s": state.training_cpu_s,
        }
        groups = {f"recordings/{name}": arrays for name, arrays in state.recordings.items()}
        groups["team"] = state.team
        arrays = {
            f"{group}/{k}": array for group, own in groups.items() for k, array in own.items()
        }
        text = np.frombuffer(json.dumps(table, allow_nan=False).encode(), np.uint8)
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, **{TABLE: text, **arrays})
        content = buffer.getvalue()
        digest = hashlib.sha256(content).hexdigest().encode()
        with suppress(OSError, ValueError):
            write(self._location.file(self._identity), digest + content)
        self._next = time.monotonic() + self._location.seconds

    def read(self) -> CheckpointState | None:
        """Return the saved state; None if there is none from which this trial can resume."""
        if self._location is None:
            return None
        try:
            content = _content(self._location.file(self._identity))
            if content is None:
                return None
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays = dict(file)
            table = json.loads(arrays.pop(TABLE).tobytes())
            if (table["identity"], table["code"]) != (self._identity, self._location.code):
                return None
            names = {key.split("/", 2)[1]: None for key in arrays if key.startswith("recordings/")}
            return CheckpointState(
                rows=[EpisodeRow(*row) for row in table["rows"]],
                seconds=table["seconds"],
                usage=table["usage"],
                training_cpu_s=float(table["training_cpu_s"]),
                recordings={name: select_prefix(f"recordings/{name}/", arrays) for name in names},
                team=select_prefix("team/", arrays),
            )
        except (OSError, ValueError, KeyError, TypeError, EOFError):
            return None


def location(trial: Trial) -> Checkpoints | None:
    """Return where the checkpoint of a trial is stored; None if it has none.

    The state of user code is unknown, so a trial with user code starts from the beginning.
    """
    is_built_in = trial.settings.learner.kind in LEARNERS.built_in
    if not is_built_in or any(name.endswith(".py") for name in trial.sources.texts):
        return None
    return trial.sources.checkpoints


def remove_damaged(folder: Path) -> Iterator[str]:
    """Delete incomplete and damaged checkpoints, and yield a remark on each damaged one."""
    for incomplete in folder.glob(".*.new"):
        incomplete.unlink()
    for file in sorted(folder.glob("*.npz")):
        if _content(file) is None:
            file.unlink()
            yield f"{file}: is damaged, its trial starts from the beginning"


def _content(path: Path) -> bytes | None:
    """Return the arrays in a file as bytes; None if they do not match their digest."""
    content = read_bytes(path)
    digest = hashlib.sha256(content[DIGEST_LENGTH:]).hexdigest().encode()
    return content[DIGEST_LENGTH:] if content[:DIGEST_LENGTH] == digest else None
