"""What predicts, as it stands in ``[learner] predictor`` of a spec, and plain persistence."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..interface.scenario import Scenario
from ..numerics import FloatArray, IntArray
from ..plugins.settings import PartSettings, Positive, unwritten


class GivenPredictor(PartSettings):
    """What the scenario itself predicts."""

    kind: Literal["given"] = "given"


class StaticPredictor(PartSettings):
    """Persistence: whatever is done, nothing changes. The baseline of every other predictor."""

    kind: Literal["static"] = "static"
    factory: ClassVar[str] = f"{__name__}:Persistence"


class LearnedPredictorSettings(PartSettings):
    """What is regressed from experience, online and from nothing: no model is given."""

    kind: Literal["learned"] = "learned"
    factory: ClassVar[str] = f"{__package__}.learned_predictor:LearnedPredictor"
    horizon: Annotated[int, Field(ge=1, le=50)] | None = None
    """Decisions that it looks ahead, what agents do in the first being held; none: as many as the
    scenario's own predictions do, 1 without such."""
    ridge: Positive = 10.0
    """Weight of the squared weights against the squared errors."""
    products: Literal["none", "private", "all"] = "private"
    """Pairs of which variables of a body say, beside each alone, what an agent moves: of none, of
    those that are its own to the body, or of the ``common`` ones, too."""
    memberships: Annotated[int, Field(ge=2, le=15)] | None = None
    """Membership functions per variable, spread evenly; none: the state space's own centres."""
    midpoint: Annotated[bool, unwritten(False)] = False
    """Whether what moves what is taken from the middle of the way of a decision, where motion
    changes what moves what, and not from its beginning."""
    mirrored: bool | None = None
    """Whether what the mirror image of the team would have met is experience as well; none: if the
    scenario tells what a mirror does."""


Predictor = Annotated[
    GivenPredictor | StaticPredictor | LearnedPredictorSettings, Field(discriminator="kind")
]
"""The settings of any predictor, distinguished by ``kind``."""


class Persistence:
    """Predicts that nothing changes."""

    def __init__(self, settings: StaticPredictor, scenario: Scenario) -> None:
        pass

    def predict(self, states: FloatArray) -> StaticPrediction:
        """Predict from states ``(n, d)``."""
        return StaticPrediction(states)


class StaticPrediction:
    """The present states ``(n, d)``, whatever is done."""

    def __init__(self, present: FloatArray) -> None:
        self._present = present

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the present state of `agent` for joint actions ``(m, n)``: ``(m, d)``."""
        return np.tile(self._present[agent], (len(joint_actions), 1))
