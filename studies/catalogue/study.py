"""What a study is: a measure of one trial, an analysis of all, and figures of the analysis.

A study is one module that offers these, and one line in `nested_agents.studies.STUDIES`. It may
also offer ``check(spec)``, which raises `SpecError` if the spec has not what it needs.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, cast

from .. import STUDIES
from ..analysis.results import Results
from ..trials.trial import Trial, TrialResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Study(Protocol):
    """The functions of a study's module."""

    def measure(self, trial: Trial) -> TrialResult:
        """Run one trial; imported by name in worker processes."""
        ...

    def analyse(self, results: Results) -> Any:
        """Turn results into estimates; its attribute `table` holds the `Summary` lines.

        An attribute `notes`, if there is one, holds lines that are printed below the table; an
        attribute `headline` the title of the estimate that a report speaks of first.
        """
        ...

    def draw(self, analysis: Any) -> dict[str, Figure]:
        """Return the figures of an analysis by name."""
        ...


def load_study(name: str) -> Study:
    """Return the study of a name in `nested_agents.studies.STUDIES`."""
    return cast(Study, import_module(STUDIES[name], "nested_agents.studies"))
