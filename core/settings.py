"""What all settings share, and the numbers that they hold.

Settings are the tables of a spec. Each model refuses unknown keys and values outside the stated
ranges when it is built; every field is documented beside it, with its unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from .places import located

NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]


class Settings(BaseModel):
    """A frozen model that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ScenarioSettings(Settings):
    """What the settings of all scenarios inherit."""

    kind: str = ""
    factory: ClassVar[str] = ""
    """Where the class is that is built of them, imported when it is wanted."""

    def build(self) -> Any:
        """Return the scenario.

        Raises
        ------
        ValueError
            If there can be none of these settings; one line.
        """
        return located(self.factory)(self)

    def suited(self, preset: str) -> Mapping[str, Any]:
        """Return what this scenario lays over a preset: its ``learner`` and ``topology`` tables.

        A preset is made for box pushing; what learns best elsewhere may be something else, and
        depend on the settings. What a spec says itself lies over both. Nothing by default.
        """
        return {}

    @property
    def onset(self) -> int | None:
        """Episode in which something is scheduled to change, such as a failure; none: never."""
        return None


def tuples(value: Any) -> Any:
    """Return `value` with every list in it as a tuple, which strict validation asks for."""
    if isinstance(value, Mapping):
        return {key: tuples(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return tuple(tuples(inner) for inner in value)
    return value
