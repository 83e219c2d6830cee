"""Settings of what fails: which things by name, and from when to when."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Annotated, ClassVar, Self, cast

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ..numerics import BoolArray
from .settings import Settings

Index = Annotated[int, Field(ge=0)]


def _names(value: object) -> object:
    several = value if isinstance(value, list | tuple) else (value,)
    return tuple(str(one) if isinstance(one, int | np.integer) else one for one in several)


Names = Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(_names)]
"""What fails by name, pattern or number, one or a list."""


class Scheduled(Settings):
    """From when to when something fails.

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
        return cast("tuple[str, ...]", getattr(self, self.part))

    def lasts(self, episode: int, step: int) -> bool:
        """Return whether it is on at a step of an episode."""
        now = episode, step
        over = self.end_episode is not None and now >= (self.end_episode, self.end_step)
        return now >= (self.episode, self.step) and not over

    def mask(self, agents: Sequence[str], where: str) -> BoolArray:
        """Return which of the agents ``(n,)`` it names.

        Raises
        ------
        ValueError
            If it names one that there is not; the line begins with the key `where` it stands.
        """
        mask = np.zeros(len(agents), dtype=bool)
        for name in self.names:
            hit = np.array([fnmatchcase(agent, name) for agent in agents])
            if not hit.any():
                shown = ", ".join(agents[:8]) + (", ..." if len(agents) > 8 else "")
                head, dot, _ = agents[0].rpartition(".")
                raise ValueError(
                    f"{where}.{self.part} = {name!r}: no such {self.part.removesuffix('s')}, "
                    f"allowed {shown} or a pattern such as {head}{dot}*"
                )
            mask |= hit
        return mask

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end_episode is None and self.end_step:
            raise ValueError("end_step needs an end_episode")
        end = self.end_episode, self.end_step
        if end[0] is not None and end <= (self.episode, self.step):
            raise ValueError(f"its end {end} must come after its begin {self.episode, self.step}")
        return self
