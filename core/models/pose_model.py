"""A dynamics model of poses, from which the scenario derives the state variables.

The scenario knows outlines and kinematics of its bodies. It predicts their poses by linear
regressions on features of contacts. Their weights are learned online, starting from zero, by ridge
regression (Hoerl and Kennard 1970) on sums over all experience.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..interface.abilities import Embodiment
from ..interface.prediction import EmbodiedPrediction
from ..interface.scenario import Scenario, Transition
from ..numerics import FloatArray, IntArray
from .adaptive import Adaptive
from .learned_predictor import INTERVAL
from .predictors import PosePredictorSettings


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
        self._levers = scenario.levers
        self.memory: dict[str, FloatArray] = {"decisions": np.zeros(1)}
        """Sums over all experience, and the weights computed from them."""
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
            gram = self.memory[f"gram{i}"]
            regular = gram + self._ridge * np.eye(len(gram))
            self.memory[f"weights{i}"] = np.linalg.solve(regular, self.memory[f"moment{i}"])

    def state_dict(self) -> dict[str, FloatArray]:
        """Return sums over all experience, and the weights computed from them."""
        return self.memory

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        self.memory = {name: np.array(state[name]) for name in self.memory}

    def warm_start(self, former: PoseModel) -> None:
        """Start from another model if it describes the same bodies."""
        if np.array_equal(self._levers, former._levers):
            self.load_state_dict(former.memory)
