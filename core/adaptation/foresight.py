"""What agents predict by: the scenario's own predictor, revised or not, or one in its place."""

from __future__ import annotations

from typing import Any

from ..interface.experience import Experience, Observation
from ..interface.plain import as_prediction
from ..interface.prediction import Prediction
from ..interface.scenario import Scenario
from ..numerics import FloatArray
from ..plugins.settings import PartSettings
from .adaptive import Adaptive, DynamicsModel
from .calibration import Calibration, CalibrationSettings
from .predictors import GivenPredictor
from .self_model import SelfModel, SelfModelSettings


class Foresight:
    """Predicts, and revises what its predictions rest on.

    Parameters
    ----------
    predictor, self_model, calibration
        Settings of what predicts, and of what revises the scenario's own predictions.
    scenario
        What is predicted.

    Attributes
    ----------
    predictor
        What predicts in place of the scenario; none: the scenario does.
    self_model
        What the wheels do, as learned; none: prediction takes every body as nominal.
    calibration
        The predictor's constants, as learned; none: as the scenario believes them to be.
    adaptive
        Those of the three that revise themselves, by name.

    Raises
    ------
    ValueError
        If what is to be revised is not there, or is not what predicts; one line.
    """

    def __init__(
        self,
        predictor: PartSettings,
        self_model: SelfModelSettings,
        calibration: CalibrationSettings,
        scenario: Scenario,
    ) -> None:
        self.self_model = SelfModel.of(self_model, scenario)
        self.calibration = Calibration.of(calibration, scenario)
        self.predictor: DynamicsModel | None = None
        if not isinstance(predictor, GivenPredictor):
            named = f"learner.predictor.kind = {predictor.kind!r}"
            revised = {"self_model": self_model.enabled, "calibration": calibration.enabled}
            for name in (name for name, enabled in revised.items() if enabled):
                raise ValueError(
                    f"learner.{name}.enabled: revises what the scenario predicts, and {named} "
                    "predicts in its place; use 'given'"
                )
            self.predictor = predictor.build(scenario)
        parts = {
            "self_model": self.self_model,
            "calibration": self.calibration,
            "predictor": self.predictor,
        }
        self.adaptive: dict[str, Adaptive[Any]] = {
            name: part for name, part in parts.items() if isinstance(part, Adaptive)
        }

    def predict(self, seen: Observation, errors: FloatArray | None = None) -> Prediction | None:
        """Return the prediction from where agents are; None where nothing is predicted.

        Parameters
        ----------
        seen
            Where they are.
        errors
            ``(c,)`` added to the logarithms of the predictor's constants; none: it has no errors.
        """
        if seen.imagined is not None:
            return seen.imagined
        if self.predictor is not None:
            return self.predictor.predict(seen.present)
        if self.self_model is None and self.calibration is None and errors is None:
            return as_prediction(seen.scenario.predict())
        bodies = seen.scenario.embodiment()
        if bodies is None:
            raise ValueError(
                "learner.self_model, calibration, decision.errors: the scenario has no bodies"
            )
        effects = bodies.nominal_effects if self.self_model is None else self.self_model.effects
        constants = None if self.calibration is None else self.calibration.constants
        if errors is not None:
            constants = errors if constants is None else constants + errors
        return bodies.predict_with(effects, constants)

    def learn(self, experience: Experience, prediction: Prediction | None) -> None:
        """Revise what a prediction rested on."""
        joint_action = experience.decision.joint_action
        for part in self.adaptive.values():
            part.adapt(prediction, joint_action, experience.transition)

    def end_episode(self) -> None:
        """Revise what is revised after an episode."""
        for part in self.adaptive.values():
            part.end_episode()

    def continue_from(self, former: Foresight) -> None:
        """Go on from what another one has learned."""
        for name in self.adaptive.keys() & former.adaptive.keys():
            self.adaptive[name].continue_from(former.adaptive[name])
