"""The settings of a topology, as they stand in the ``[topology]`` table of a spec."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ..core.config import Settings


class ChainSettings(Settings):
    """The paper's nested chain, from the first agent of `order` down to the last."""

    kind: Literal["chain"] = "chain"
    order: tuple[str, ...] | Literal["listed", "reversed", "interleaved"] = "listed"
    """The agents' own order, its reverse, wheel by wheel across robots, or all names in order."""


class TeamsSettings(Settings):
    """Robots of wheels: the leading wheels form a chain, each above its own robot's wheels."""

    kind: Literal["teams"] = "teams"


Topology = Annotated[ChainSettings | TeamsSettings, Field(discriminator="kind")]
"""Any topology's settings, told apart by `kind`."""
