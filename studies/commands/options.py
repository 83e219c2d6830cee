"""Options that several commands share."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import tyro

Directory = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DIR")]
"""An existing study, as argument."""

Jobs = Annotated[int, tyro.conf.arg(metavar="N")]
"""Number of worker processes."""

Changes = Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")]
"""Assignments laid over a spec, see `nested_agents.studies.overlay.assignment`."""

CORES = len(os.sched_getaffinity(0))
"""Cores that this process may use."""
