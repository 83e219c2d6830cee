"""Curricula: what a team is trained on before the scenario of its condition.

A stage is a number of episodes in a scenario. It is described by changes of the condition's
own scenario: what a sweep or an override says of it holds in the stages, too, unless they say
otherwise.
"""

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, Field

from ...core.plugins.settings import ScenarioSettings, Settings

Length = Annotated[int, Field(ge=1, le=1_000_000)]
"""A number of episodes, or of steps."""


def _printable(name: str) -> str:
    if not name.strip() or not name.isprintable():
        raise ValueError("must be a name that can be printed")
    return name


Name = Annotated[str, AfterValidator(_printable)]
"""How users call something of theirs."""


class StageSettings(Settings):
    """A stage of a curriculum, as it stands in a spec."""

    name: Name
    """How its episodes are called."""
    episodes: Length
    """Training episodes in it."""
    scenario: Mapping[str, Any] = Field(default_factory=dict)
    """Laid over the condition's scenario."""


def _distinct(stages: tuple[StageSettings, ...]) -> tuple[StageSettings, ...]:
    if len({stage.name for stage in stages}) < len(stages):
        raise ValueError("must be stages of distinct names")
    return stages


Curriculum = Annotated[tuple[StageSettings, ...], AfterValidator(_distinct)]
"""Stages in the order in which they are trained."""


class Stage(NamedTuple):
    """A stage of a curriculum, resolved for a condition."""

    name: str
    episodes: int
    scenario: ScenarioSettings

    def table(self) -> dict[str, Any]:
        """Return it as a table, fit for JSON."""
        return {**self._asdict(), "scenario": self.scenario.model_dump(mode="json")}
