"""The predictor of a team: the scenario's own, adapted or not, or a learned one."""

from __future__ import annotations

from typing import Any

from ..interface.experience import Experience, Observation
from ..interface.prediction import Assumptions, EmbodiedPrediction, Prediction
from ..interface.scenario import Scenario
from ..plugins.settings import PartSettings
from .adaptive import Adaptive
from .calibration import Calibration, CalibrationSettings
from .learned_predictor import LearnedPredictor
from .pose_model import PoseModel
from .predictors import GivenPredictor, PosePredictorSettings, StaticPrediction, StaticPredictor
from .self_model import SelfModel, SelfModelSettings


class TeamModel:
    """Predicts for a team, and adapts its models.

    Parameters
    ----------
    predictor, self_model, calibration
        Settings of the predictor, and of the models that adapt the scenario's own predictor.
    scenario
        The scenario to predict.

    Attributes
    ----------
    predictor
        Model used instead of the scenario's predictor, or None.
    self_model
        Learned effects of the wheels; None: nominal effects.
    calibration
        Learned constants of the predictor; None: the scenario's constants.
    adaptive
        Those of the three models that adapt, by name.

    Raises
    ------
    ValueError
        If a model is to adapt that the scenario lacks or that another predictor replaces.
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
        self.predictor: LearnedPredictor | PoseModel | None = None
        self._is_static = isinstance(predictor, StaticPredictor)
        if not isinstance(predictor, GivenPredictor):
            named = f"learner.predictor.kind = {predictor.kind!r}"
            needs_given = not isinstance(predictor, PosePredictorSettings)
            revised = {
                "self_model": self_model.enabled and needs_given,
                "calibration": calibration.enabled,
            }
            for name in (name for name, enabled in revised.items() if enabled):
                raise ValueError(
                    f"learner.{name}.enabled: adapts the predictor of the scenario, but {named} "
                    "replaces it; use 'given'"
                )
            if not self._is_static:
                self.predictor = predictor.build(scenario)
        parts = {
            "self_model": self.self_model,
            "calibration": self.calibration,
            "predictor": self.predictor,
        }
        self.adaptive: dict[str, Adaptive[Any]] = {
            name: part for name, part in parts.items() if isinstance(part, Adaptive)
        }

    def predict(self, seen: Observation) -> Prediction:
        """Return the prediction from the present states."""
        if self._is_static:
            return StaticPrediction(seen.states)
        if isinstance(self.predictor, LearnedPredictor):
            return self.predictor.predict(seen.states)
        if not self.adaptive:
            return seen.prediction
        if not isinstance(seen.prediction, EmbodiedPrediction):
            raise ValueError("learner.self_model, calibration: the scenario has no bodies")
        assumed = Assumptions(effects=None if self.self_model is None else self.self_model.effects)
        if self.predictor is not None:
            weights, horizon = self.predictor.weights, self.predictor.horizon
            assumed = assumed._replace(regressions=weights, decisions=horizon)
        elif self.calibration is not None:
            assumed = assumed._replace(constants=self.calibration.constants)
        return seen.prediction.assuming(assumed)

    def learn(self, experience: Experience, prediction: Prediction) -> None:
        """Adapt the models by the outcome of a decision."""
        joint_action = experience.decision.joint_action
        for part in self.adaptive.values():
            part.adapt(prediction, joint_action, experience.transition)

    def end_episode(self) -> None:
        """Make the updates that follow an episode."""
        for part in self.adaptive.values():
            part.end_episode()

    def warm_start(self, former: TeamModel) -> None:
        """Start from the models of another team."""
        for name in self.adaptive.keys() & former.adaptive.keys():
            self.adaptive[name].warm_start(former.adaptive[name])
