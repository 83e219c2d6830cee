"""What fails, how, and from when to when, as it stands in the ``[[scenario.failures]]`` of a spec.

The kinds of failure know nothing of what fails. A scenario says under which key its actuators are
named, ``wheels`` or ``joints``, in a model of its own that inherits `FailureSettings`, and joins it
with the kinds that can befall them::

    class WheelFailure(FailureSettings):
        part = "wheels"
        wheels: Names

    class SeizedSettings(Seized, WheelFailure):
        kind: Literal["seized"] = "seized"
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

from pydantic import BeforeValidator, Field, model_validator

from ...core.plugins.settings import Settings

Index = Annotated[int, Field(ge=0)]


def _one(value: object) -> object:
    return (value,) if isinstance(value, str) else value


Names = Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(_one)]
"""Agents by name or pattern, one or a list."""


class FailureSettings(Settings):
    """From when to when something fails; see `nested_agents.scenarios.faults.schedule`.

    A failure begins at its step of its episode and lasts, from episode to episode, until its end;
    evaluation comes after all training.
    """

    part: ClassVar[str] = ""
    """The field that names what fails."""

    episode: Index = 0
    """Episode in which it begins, counted from 0."""
    step: Index = 0
    """Step of that episode at which it begins."""
    end_episode: Index | None = None
    """Episode in which it ends; none: it lasts."""
    end_step: Index = 0
    """Step of that episode at which it ends."""

    @property
    def names(self) -> tuple[str, ...]:
        """What fails, by name or pattern."""
        found: tuple[str, ...] = getattr(self, self.part)
        return found

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end_episode is None and self.end_step:
            raise ValueError("end_step needs an end_episode")
        end = self.end_episode, self.end_step
        if end[0] is not None and end <= (self.episode, self.step):
            raise ValueError(f"its end {end} must come after its begin {self.episode, self.step}")
        return self


class Seized(FailureSettings):
    """It does not move."""


class Free(FailureSettings):
    """It has no drive and gives way."""


class Weak(FailureSettings):
    """It moves at a fraction of its command."""

    gain: Annotated[float, Field(gt=0, lt=1)] = 0.3
    """Fraction of its command at which it moves."""


class Reversed(FailureSettings):
    """It moves against its command."""


class Stuck(FailureSettings):
    """It moves at one speed whatever its command."""

    speed: Annotated[float, Field(ge=-1, le=1)] = 0.5
    """Speed at which it moves, as a fraction of the greatest."""


class Delayed(FailureSettings):
    """It carries out its commands too late."""

    periods: Annotated[int, Field(ge=1, le=1000)] = 8
    """Control periods by which commands are late."""


class Noisy(FailureSettings):
    """It moves at its command plus noise."""

    deviation: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Standard deviation of the noise, as a fraction of the greatest speed."""
