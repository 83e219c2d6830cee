"""A dynamics model of poses, from which the scenario derives the state variables.

The scenario knows outlines and kinematics of its bodies. It predicts their poses by linear
regressions on features of contacts. Their weights are learned online, starting from zero, by ridge
regression (Hoerl and Kennard 1970) on sums over all experience.
"""

from __future__ import annotations

import numpy as np

from ..interface.abilities import Embodiment
from ..interface.prediction import EmbodiedPrediction
from ..interface.scenario import Scenario, Transition
from ..numerics import FloatArray, IntArray
from .adaptive import Adaptive
from .predictors import PosePredictorSettings
from .regression import INTERVAL, solve_ridge


class PoseModel(Adaptive[EmbodiedPrediction]):
    """Weights with which bodies predict their poses, see `Assumptions.regressions`.

    Parameters
    ----------
    settings
        Horizon and penalty.
    scenario
        The scenario to predict.

    Raises
    ------
    ValueError
        If the scenario has no bodies with poses; one line.
    """

    def __init__(self, settings: PosePredictorSettings, scenario: Scenario) -> None:
        if not isinstance(scenario, Embodiment) or not scenario.regression_shapes:
            raise ValueError(
                "learner.predictor.kind = 'poses': the scenario has no bodies with poses; use "
                "'given', 'learned' or 'static'"
            )
        self.horizon = settings.horizon
        self._ridge = settings.ridge
        self.bodies = (scenario.levers,)
        self.memory = {"decisions": np.zeros(1)}
        for i, (f, t) in enumerate(scenario.regression_shapes):
            self.memory[f"gram{i}"] = np.zeros((f, f))
            self.memory[f"moment{i}"] = np.zeros((f, t))
            self.memory[f"weights{i}"] = np.zeros((f, t))

    @property
    def weights(self) -> list[FloatArray]:
        """Weights ``(f, t)`` of all regressions."""
        return [array for name, array in self.memory.items() if name.startswith("weights")]

    def adapt(
        self, prediction: EmbodiedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Add the outcome of a joint action to the sums."""
        samples = prediction.pose_samples(joint_action, transition.info)
        for i, (features, targets) in enumerate(samples):
            self.memory[f"gram{i}"] += features.T @ features
            self.memory[f"moment{i}"] += features.T @ targets
        self.memory["decisions"] += 1
        if self.memory["decisions"] % INTERVAL == 0:
            self.end_episode()

    def end_episode(self) -> None:
        """Regress on all experience."""
        for i in range(len(self.weights)):
            sums = self.memory[f"gram{i}"], self.memory[f"moment{i}"]
            self.memory[f"weights{i}"] = solve_ridge(*sums, self._ridge)
