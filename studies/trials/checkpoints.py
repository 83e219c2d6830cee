"""Checkpoints: the state of a running trial, from which an interrupted trial continues.

A file per trial in the folder of the study, replaced every few minutes and at evaluations on the
way, gone when its trial is kept. It holds arrays of numbers and a table of JSON, behind a digest of
both. What is damaged, of another trial, or of other code is as if it were not there; damage is
remarked when a study is run. A trial that goes on has the rows that it would have had, bit by bit.
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
"""The array that holds the text of the table."""
DIGEST = 64
"""Characters before the arrays."""


class Reached(NamedTuple):
    """What a trial select_prefix way has come to."""

    rows: Sequence[EpisodeRow]
    """Of the episodes so far."""
    seconds: Mapping[str, float]
    """Time spent in each part of the control loop."""
    usage: Mapping[str, float]
    """What it took beside time."""
    spent: float
    """Processor time of training [s], where that is counted apart."""
    recordings: Mapping[str, Recording]
    """As in `TrialResult`."""
    team: Recording
    """What the team remembers."""
    environments: Recording
    """State of many environments; empty for a learner of one environment."""


class Checkpoint:
    """The checkpoint of a trial.

    Parameters
    ----------
    trial
        The trial.
    """

    def __init__(self, trial: Trial) -> None:
        self._place = place(trial)
        self._identity = trial.identity
        self._next = time.monotonic() + (self._place.seconds if self._place else 0.0)

    @property
    def is_due(self) -> bool:
        """Whether it is time to write one."""
        return self._place is not None and time.monotonic() >= self._next

    def write(self, reached: Reached) -> None:
        """Replace the file; where it cannot be written, the trial goes on without."""
        if self._place is None:
            return
        table = {
            "identity": self._identity,
            "code": self._place.code,
            "rows": [[*row] for row in reached.rows],
            "seconds": dict(reached.seconds),
            "usage": dict(reached.usage),
            "spent": reached.spent,
        }
        groups = {f"recordings/{k}": arrays for k, arrays in reached.recordings.items()}
        groups |= {"team": reached.team, "environments": reached.environments}
        arrays = {
            f"{group}/{k}": array for group, own in groups.items() for k, array in own.items()
        }
        text = np.frombuffer(json.dumps(table, allow_nan=False).encode(), np.uint8)
        with suppress(OSError, ValueError):
            _write(self._place.file(self._identity), {TABLE: text, **arrays})
        self._next = time.monotonic() + self._place.seconds

    def read(self) -> Reached | None:
        """Return what it holds; None if it holds nothing that this trial may go on from."""
        if self._place is None:
            return None
        try:
            content = _content(self._place.file(self._identity))
            if content is None:
                return None
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays = dict(file)
            table = json.loads(arrays.pop(TABLE).tobytes())
            if (table["identity"], table["code"]) != (self._identity, self._place.code):
                return None
            recordings = dict.fromkeys(
                key.split("/", 2)[1] for key in arrays if key.startswith("recordings/")
            )
            return Reached(
                rows=[EpisodeRow(*row) for row in table["rows"]],
                seconds=table["seconds"],
                usage=table["usage"],
                spent=float(table["spent"]),
                recordings={
                    name: select_prefix(f"recordings/{name}/", arrays) for name in recordings
                },
                team=select_prefix("team/", arrays),
                environments=select_prefix("environments/", arrays),
            )
        except (OSError, ValueError, KeyError, TypeError, EOFError):
            return None


def place(trial: Trial) -> Checkpoints | None:
    """Return where a trial puts down what it has come to; None: nowhere.

    What things of users remember is not known, so that trials with such begin anew.
    """
    known = trial.sources.checkpoints
    is_built_in = trial.settings.learner.kind in LEARNERS.built_in
    if known is None or not is_built_in or any(n.endswith(".py") for n in trial.sources.texts):
        return None
    return known


def sweep(folder: Path) -> Iterator[str]:
    """Remove what is half-written and what is damaged, and yield a remark on each of the latter."""
    for half_written in folder.glob(".*.new"):
        half_written.unlink()
    for file in sorted(folder.glob("*.npz")):
        if _content(file) is None:
            file.unlink()
            yield f"{file}: is damaged, its trial begins anew"


def _content(path: Path) -> bytes | None:
    """Return the arrays in a file as bytes; None if their digest is another one."""
    content = read_bytes(path)
    digest = hashlib.sha256(content[DIGEST:]).hexdigest().encode()
    return content[DIGEST:] if content[:DIGEST] == digest else None


def _write(path: Path, arrays: Recording) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    content = buffer.getvalue()
    write(path, hashlib.sha256(content).hexdigest().encode() + content)
