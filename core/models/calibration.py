"""Calibration: Kalman estimates of a predictor's constants while bodies push.

Positive constants are known up to factors. A Kalman filter estimates the logarithms x of these
factors; x = 0 is the prior. The outcome of a decision is a vector of speeds z = h(x) + noise, where
h is the prediction. Since h has kinks where contacts stick or slip, it is linearized statistically
over the whole distribution of x (cubature rule: Arasaratnam & Haykin 2009). With x = m + L u,
L L' = P, and z+, z- predicted at u = +-sqrt(n) e_j::

    G_j = (z+_j - z-_j) / (2 sqrt(n)),   N = variance of (z+_j + z-_j) / 2 + noise^2
    P <- L (I + G' W / N G)^-1 L',       m <- m + L (I + G' W / N G)^-1 G' W / N (z - mean z)

N includes the nonlinear part. The weight W of a body falls below 1 when its motion is improbable
under the filter, as after a jam, a failed wheel or a collision; the filter then learns little. A
drift is added to P, which therefore never vanishes.
"""

from __future__ import annotations

import numpy as np

from ..interface.abilities import Embodiment
from ..interface.prediction import EmbodiedPrediction
from ..interface.scenario import Scenario, Transition
from ..numerics import FloatArray, IntArray
from ..plugins.settings import NonNegative, Positive, Settings
from .adaptive import Adaptive


class CalibrationSettings(Settings):
    """Whether and how fast a team adapts the constants of its predictor."""

    enabled: bool = False
    """Whether constants adapt; otherwise the scenario's constants are used."""
    prior: Positive = 0.7
    """Prior standard deviation of the logarithm of a constant: 0.7 is a factor of 2."""
    noise: Positive = 0.008
    """Standard deviation of a measured speed around the predicted one [m/s]."""
    surprise: Positive = 4.0
    """Mean squared innovation of a body, in units of its expected square, above which the body has
    less weight."""
    drift: NonNegative = 0.003
    """Standard deviation of the drift of a logarithm in one decision with contact."""


class Calibration(Adaptive[EmbodiedPrediction]):
    """Estimates the logarithms of ``n`` constants relative to their priors.

    Parameters
    ----------
    settings
        Uncertainties of prior and measurement.
    n
        Number of constants.
    levers
        ``(B,)`` speed per turning rate of each measured body [m].

    Examples
    --------
    A box moves in proportion to one constant, which is 1.5 times as large as its prior.

    >>> calibration = Calibration(CalibrationSettings(enabled=True), 1, np.array([0.1]))
    >>> for _ in range(20):
    ...     predicted = np.zeros((2, 1, 3))
    ...     predicted[:, 0, 0] = 0.05 * np.exp(calibration.points[:, 0])
    ...     calibration.observe(np.array([[0.075, 0.0, 0.0]]), predicted)
    >>> round(float(np.exp(calibration.constants[0])), 1)
    1.5
    """

    def __init__(self, settings: CalibrationSettings, n: int, levers: FloatArray) -> None:
        self.settings = settings
        self.memory = {"constants": np.zeros(n), "covariance": settings.prior**2 * np.eye(n)}
        self._units = np.stack([np.ones_like(levers), np.ones_like(levers), levers], axis=1)
        self.bodies = (self._units,)

    @property
    def constants(self) -> FloatArray:
        """Estimated logarithms ``(n,)`` of the constants."""
        return self.memory["constants"]

    @property
    def _root(self) -> FloatArray:
        """Triangular root L of the covariance."""
        return np.linalg.cholesky(self.memory["covariance"])

    @classmethod
    def of(cls, settings: CalibrationSettings, scenario: Scenario) -> Calibration | None:
        """Return the calibration of a scenario's predictor, None if it is not enabled.

        Raises
        ------
        ValueError
            If the predictor has no constants.
        """
        if not settings.enabled:
            return None
        if not isinstance(scenario, Embodiment) or not scenario.constants:
            raise ValueError(
                "learner.calibration.enabled: the scenario's predictor has no constants to "
                "calibrate"
            )
        return cls(settings, len(scenario.constants), scenario.levers)

    def adapt(
        self, prediction: EmbodiedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Update the constants if a pushed object moved."""
        twists = transition.measured_twists()
        n_bodies = len(prediction.groups)
        if twists is not None and twists[:-n_bodies].any():
            self.observe(twists, prediction.outcomes(joint_action, self.points))

    @property
    def points(self) -> FloatArray:
        """Sigma points ``(2 n, n)`` at which outcomes are predicted: m + L u, then m - L u."""
        spread = np.sqrt(len(self.constants)) * self._root.T
        return self.constants + np.concatenate([spread, -spread])

    def observe(self, measured: FloatArray, predicted: FloatArray) -> None:
        """Update by measured twists ``(B, 3)`` of all bodies and predicted ones ``(2 n, B, 3)``."""
        n = len(self.constants)
        settings = self.settings
        plus = self._units * predicted[:n]
        minus = self._units * predicted[n:]
        slope = (plus - minus) / (2.0 * np.sqrt(n))
        if not slope.any():
            return
        middle = 0.5 * (plus + minus)
        mean = middle.mean(axis=0)
        noise = settings.noise**2 + ((middle - mean) ** 2).mean(axis=0)
        innovation = self._units * measured - mean
        surprise = (innovation**2 / (noise + (slope**2).sum(axis=0))).mean(axis=1)
        weight = np.minimum(1.0, settings.surprise / np.maximum(surprise, 1e-300)) ** 2
        slope = slope.reshape(n, -1)
        weighted = slope * (weight[:, None] / noise).ravel()
        posterior = np.linalg.inv(np.eye(n) + weighted @ slope.T)
        root = self._root
        self.memory["constants"] += root @ (posterior @ (weighted @ innovation.ravel()))
        covariance = root @ posterior @ root.T
        # No constant becomes less certain than its prior.
        known = np.diagonal(covariance) + settings.drift**2 < settings.prior**2
        drift = np.diag(known * settings.drift**2)
        self.memory["covariance"] = 0.5 * (covariance + covariance.T) + drift
