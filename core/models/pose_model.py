"""A dynamics model that predicts poses of bodies and derives the state variables from them.

The environment knows outlines and kinematics. It predicts poses by linear regressions, whose
features it computes from the contacts of its bodies. Their weights are learned online, from zero,
by ridge regression (Hoerl and Kennard 1970) on sums over all experience.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..interface.experience import Observation
from ..interface.prediction import EmbodiedPrediction
from ..interface.scenario import Embodiment, Scenario, Transition
from ..numerics import FloatArray, IntArray
from .adaptive import Adaptive, DynamicsModel
from .learned_predictor import INTERVAL
from .predictors import PosePredictorSettings


class PoseModel(DynamicsModel, Adaptive[EmbodiedPrediction]):
    """Learns how bodies move when they touch; see the module.

    Parameters
    ----------
    settings
        Horizon and regression.
    scenario
        The scenario to predict.

    Raises
    ------
    ValueError
        If the scenario has no bodies with poses; one line.
    """

    def __init__(self, settings: PosePredictorSettings, scenario: Scenario) -> None:
        self.settings = settings
        self.horizon = settings.horizon
        self._bodies = _bodies_of(scenario)
        self._masks: list[tuple[FloatArray, FloatArray]] = []
        self.memory: dict[str, FloatArray] = {"decisions": np.zeros(1)}
        """Sums over all experience, and the weights computed from them."""
        for i, (features, targets) in enumerate(self._bodies.regressions):
            gram = features[:, None] * features
            moment = features[:, None] * targets
            # A step and its mirror image cancel what only one of them has.
            keep = (np.ones_like(gram), np.ones_like(moment))
            self._masks.append((1.0 + gram, 1.0 + moment) if settings.mirrored else keep)
            self.memory |= {
                f"gram{i}": np.zeros_like(gram),
                f"moment{i}": np.zeros_like(moment),
                f"weights{i}": np.zeros_like(moment),
            }

    def predict(self, seen: Observation) -> EmbodiedPrediction:
        """Predict from the poses in an observation's scenario."""
        weights = [self.memory[f"weights{i}"] for i in range(len(self._masks))]
        return _bodies_of(seen.scenario).predict_poses(weights, self.horizon)

    def adapt(
        self, prediction: EmbodiedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Add the outcome of a joint action to the sums."""
        rows = self._bodies.pose_experience(prediction, joint_action, transition)
        for i, (features, targets) in enumerate(rows):
            self.memory[f"gram{i}"] += features.T @ features
            self.memory[f"moment{i}"] += features.T @ targets
        self.memory["decisions"] += 1
        if self.memory["decisions"] % INTERVAL == 0:
            self.end_episode()

    def end_episode(self) -> None:
        """Regress on all experience."""
        for i, (gram_mask, moment_mask) in enumerate(self._masks):
            gram = gram_mask * self.memory[f"gram{i}"]
            moment = moment_mask * self.memory[f"moment{i}"]
            regular = gram + self.settings.ridge * np.eye(len(gram))
            self.memory[f"weights{i}"] = np.linalg.solve(regular, moment)

    def state_dict(self) -> dict[str, FloatArray]:
        """Return sums over all experience, and the weights computed from them."""
        return self.memory

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        self.memory = {name: np.array(state[name]) for name in self.memory}

    def warm_start(self, former: PoseModel) -> None:
        """Start from another model if it describes the same bodies."""
        if np.array_equal(self._bodies.levers, former._bodies.levers):
            self.load_state_dict(former.memory)


def _bodies_of(scenario: Scenario) -> Embodiment:
    """Return the bodies of a scenario.

    Raises
    ------
    ValueError
        If they have no poses to predict; one line.
    """
    bodies = scenario.embodiment()
    if bodies is None or not bodies.regressions:
        raise ValueError(
            "learner.predictor.kind = 'poses': the environment has no bodies with poses; use "
            "'given', 'learned' or 'static'"
        )
    return bodies
