"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro

from ...workers.worker import CORES as CORES

Directory = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DIR")]
"""An existing study, as argument."""

Jobs = Annotated[int, tyro.conf.arg(metavar="N")]
"""Number of worker processes."""

MostJobs = Annotated[int | None, tyro.conf.arg(metavar="N", help_behavior_hint="")]
"""The same where their number may be left to the backend."""

Number = Annotated[int | None, tyro.conf.arg(help_behavior_hint="")]
"""A number that has no default, or one that its help tells."""

Figure = Annotated[Path | None, tyro.conf.arg(metavar="PATH", help_behavior_hint="")]
"""A picture to write."""

Backend = Literal["loky", "dask"]
"""Kind of workers; named here, since importing `nested_agents.studies.workers` delays the help."""

Address = Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT", help_behavior_hint="")]
"""Of a Dask scheduler."""

Changes = Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")]
"""Assignments laid over a spec, see `nested_agents.studies.spec.overlay.assignment`."""
