"""What bodies learn of themselves and of what they push, from how they were seen to move.

A *self-model* says what each wheel of a body does to its motion. The twist of a body in its own
frame is taken as linear in its commanded wheel speeds::

    twist = effect @ [u_1, ..., u_w, 1] + noise

For each of its three components a Kalman filter tracks the row of the ``(3, w + 1)`` effect,
starting from the nominal geometry. When an innovation is larger than the filter believes possible,
its covariance is inflated: something has changed, so old experience counts less. The effect feeds
the predictor; this is how a team learns that a wheel has failed.

Wheels that pull against each other skid, and a twist is then not linear in their speeds. The
filter takes what is left over for a change and goes after it, surer of it than it should be. So it
keeps count of how large its innovations have been, in units of what it expected: its own
covariance, which decides how fast it learns, stays as it is; the deviations that it reports are
multiplied by that ratio (Birge 1932).

*Calibration* estimates the constants of a team's predictor while bodies push.

Positive constants are known up to factors, whose logarithms x are estimated by a Kalman filter;
0 is what was believed at first. What a decision led to is a vector of speeds z = h(x) + noise, h
being the prediction. It has kinks where contacts stick or slip, so it is linearised statistically,
over the whole of what is thought possible (cubature rule: Arasaratnam & Haykin 2009). With
x = m + L u, L L' = P, and z+, z- predicted at u = +-sqrt(n) e_j::

    G_j = (z+_j - z-_j) / (2 sqrt(n)),   N = variance of (z+_j + z-_j) / 2 + noise^2
    P <- L (I + G' W / N G)^-1 L',       m <- m + L (I + G' W / N G)^-1 G' W / N (z - mean z)

N holds what is not linear, too. The weight W of a body falls below 1 when it did what the filter
does not believe possible: a jam, a wheel that fails, a body that gets in the way. Of such a
decision little is learned. What drifts is added to P, so that it never falls to nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..interface.prediction import EmbodiedPrediction
from ..interface.scenario import Scenario, Transition
from ..numerics import FloatArray, IntArray
from ..plugins.settings import NonNegative, Positive, Settings
from .adaptive import Adaptive

MEMORY = 100
"""Decisions over which the size of innovations is averaged."""


class SelfModelSettings(Settings):
    """Whether and how fast a body revises what it believes its wheels to do."""

    enabled: bool = False
    """Whether bodies learn it; otherwise prediction takes every body as nominal."""
    prior_effect: Positive = 0.3
    """Standard deviation of a wheel's effect around the nominal one [m/s per m/s]."""
    prior_constant: Positive = 0.003
    """Standard deviation of the constant part of the motion [m/s]."""
    noise: Positive = 0.004
    """Standard deviation of a measured speed around the model's [m/s]."""
    surprise: Positive = 9.0
    """Squared innovation, in units of its expected square, from which on a change is assumed."""
    inflation: Positive = 1.0
    """Share of the prior covariance that is added then."""


class SelfModel(Adaptive[EmbodiedPrediction]):
    """Kalman filters on the wheel effects of all bodies.

    Parameters
    ----------
    settings
        Uncertainties of prior and measurement.
    nominal
        Per body the ``(3, w + 1)`` effect of its nominal geometry: rows are the speed ahead and
        to the left [m/s] and the turning rate [rad/s], columns the wheel speeds [m/s] and 1.

    Examples
    --------
    A cart with one wheel, which turns out to be seized.

    >>> nominal = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    >>> model = SelfModel(SelfModelSettings(enabled=True), [nominal])
    >>> for speed in (0.1, -0.1, 0.1, -0.1):
    ...     model.observe(0, np.array([speed]), np.zeros(3))
    >>> abs(float(model.effects[0][0, 0])) < 0.01
    True
    """

    def __init__(self, settings: SelfModelSettings, nominal: Sequence[FloatArray]) -> None:
        self._settings = settings
        self._nominal = [np.array(effect, dtype=float) for effect in nominal]
        self.effects = tuple(effect.copy() for effect in self._nominal)
        """Per body the ``(3, w + 1)`` effect of its wheels, as learned so far."""
        # A turning rate is measured in units of the nominal body's own turning per wheel speed.
        turning = [max(1.0, float(np.abs(effect[2]).max())) for effect in nominal]
        self._units = [np.array([1.0, 1.0, unit]) for unit in turning]
        of_effect, of_constant = settings.prior_effect**2, settings.prior_constant**2
        wheels = [effect.shape[1] - 1 for effect in nominal]
        self._priors = [np.diag([of_effect] * w + [of_constant]) for w in wheels]
        self._covariances = [np.stack([prior] * 3) for prior in self._priors]
        # Mean squared innovation of each component in units of the expected square.
        self._ratios: list[FloatArray] = [np.ones(3) for _ in nominal]

    @property
    def deviations(self) -> tuple[FloatArray, ...]:
        """Per body the ``(3, w + 1)`` standard deviations of its effect.

        Those of its filters, times how much larger their innovations are than they expect.
        """
        larger = (np.sqrt(np.maximum(1.0, ratio)) for ratio in self._ratios)
        scales = (scale[:, None] for scale in map(np.multiply, self._units, larger))
        own = (np.sqrt(np.diagonal(c, axis1=1, axis2=2)) for c in self._covariances)
        return tuple(map(np.multiply, scales, own))

    @classmethod
    def of(cls, settings: SelfModelSettings, scenario: Scenario) -> SelfModel | None:
        """Return that of a scenario's bodies, none if it is not enabled.

        Raises
        ------
        ValueError
            If the scenario has no bodies on wheels.
        """
        if not settings.enabled:
            return None
        bodies = scenario.embodiment()
        if bodies is None:
            raise ValueError("learner.self_model.enabled: the scenario has no bodies on wheels")
        return cls(settings, bodies.nominal_effects)

    def adapt(
        self, prediction: EmbodiedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Revise all effects by how the bodies moved by a joint action.

        What contact is predicted to take from the motion is given back: a body that moves a load
        is slow, not broken.
        """
        if transition.twists is None:
            return
        speeds, slips = prediction.commands(joint_action), prediction.slips(joint_action)
        free = transition.twists[-len(slips) :] - slips
        for body, group in enumerate(prediction.groups):
            self.observe(body, speeds[list(group)], free[body])

    def observe(self, body: int, speeds: FloatArray, twist: FloatArray) -> None:
        """Take in one twist ``(3,)`` measured under commanded wheel speeds ``(w,)``."""
        settings, regressor, ratio = self._settings, np.append(speeds, 1.0), self._ratios[body]
        noise, effect, covariance = settings.noise**2, self.effects[body], self._covariances[body]
        for row, unit in enumerate(self._units[body]):
            innovation = float(twist[row] - effect[row] @ regressor) / unit
            carried = covariance[row] @ regressor
            expected = float(regressor @ carried) + noise
            ratio[row] += (innovation**2 / expected - ratio[row]) / MEMORY
            if innovation**2 > settings.surprise * expected:
                covariance[row] += settings.inflation * self._priors[body]
                carried = covariance[row] @ regressor
                expected = float(regressor @ carried) + noise
            gain = carried / expected
            effect[row] += gain * innovation * unit
            covariance[row] -= np.outer(gain, carried)

    def arrays(self) -> dict[str, FloatArray]:
        """Return effects, covariances and ratios of innovations by robot."""
        kept = {"effect": self.effects, "covariance": self._covariances, "ratio": self._ratios}
        return {f"{name}{r}": array for name in kept for r, array in enumerate(kept[name])}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        for name, own in self.arrays().items():
            own[:] = arrays[name]

    def continue_from(self, former: SelfModel) -> None:
        """Go on from what another one has learned, if its bodies are built alike; else anew."""
        mine, theirs = self._nominal, former._nominal
        if len(mine) == len(theirs) and all(map(np.array_equal, mine, theirs)):
            self.restore(former.arrays())


class CalibrationSettings(Settings):
    """Whether and how fast a team revises the constants of its predictor."""

    enabled: bool = False
    """Whether constants are revised; otherwise they stay as the scenario believes them to be."""
    prior: Positive = 0.7
    """Standard deviation of the logarithm of a constant at first: 0.7 is a factor of 2."""
    noise: Positive = 0.008
    """Standard deviation of a measured speed around the predicted one [m/s]."""
    surprise: Positive = 4.0
    """Mean squared innovation of a body, in units of the expected square, above which it counts
    less."""
    drift: NonNegative = 0.003
    """What is added to the standard deviation (as squares) by every decision that pushes."""


class Calibration(Adaptive[EmbodiedPrediction]):
    """Estimates the logarithms of ``n`` constants, in units of what was believed at first.

    Parameters
    ----------
    settings
        Uncertainties of prior and measurement.
    n
        Number of constants.
    levers
        ``(B,)`` speed per turning rate of each body that is measured [m].

    Examples
    --------
    A box that moves at half the speed per constant: measured is what a constant 1.5 times as large
    as believed would give.

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
        self.constants: FloatArray = np.zeros(n)
        self._covariance: FloatArray = settings.prior**2 * np.eye(n)
        self._root = np.linalg.cholesky(self._covariance)
        self._units = np.stack([np.ones_like(levers), np.ones_like(levers), levers], axis=1)

    @classmethod
    def of(cls, settings: CalibrationSettings, scenario: Scenario) -> Calibration | None:
        """Return that of a scenario's predictor, none if it is not enabled.

        Raises
        ------
        ValueError
            If the predictor has no constants.
        """
        if not settings.enabled:
            return None
        bodies = scenario.embodiment()
        if bodies is None or not bodies.constants:
            raise ValueError(
                "learner.calibration.enabled: the scenario's predictor has no constants to "
                "calibrate"
            )
        return cls(settings, len(bodies.constants), bodies.levers)

    def adapt(
        self, prediction: EmbodiedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Hold the constants against how what bodies push moved by a joint action, if it did."""
        twists, n_bodies = transition.twists, len(prediction.groups)
        if twists is not None and twists[:-n_bodies].any():
            self.observe(twists, prediction.outcomes(joint_action, self.points))

    @property
    def points(self) -> FloatArray:
        """Constants ``(2 n, n)`` whose outcomes are to be predicted: m + L u, then m - L u."""
        spread = np.sqrt(len(self.constants)) * self._root.T
        return self.constants + np.concatenate([spread, -spread])

    def observe(self, measured: FloatArray, predicted: FloatArray) -> None:
        """Take in the twists ``(B, 3)`` of all bodies against those ``(2 n, B, 3)`` predicted."""
        n, settings = len(self.constants), self.settings
        plus, minus = self._units * predicted[:n], self._units * predicted[n:]
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
        self.constants += root @ (posterior @ (weighted @ innovation.ravel()))
        covariance = root @ posterior @ root.T
        # Nothing becomes less certain than it was at first.
        known = np.diagonal(covariance) + settings.drift**2 < settings.prior**2
        self._covariance = 0.5 * (covariance + covariance.T) + np.diag(known * settings.drift**2)
        self._root = np.linalg.cholesky(self._covariance)

    def arrays(self) -> dict[str, FloatArray]:
        """Return constants and covariance."""
        return {"constants": self.constants, "covariance": self._covariance}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.constants[:] = arrays["constants"]
        self._covariance = arrays["covariance"].copy()
        self._root = np.linalg.cholesky(self._covariance)

    def continue_from(self, former: Calibration) -> None:
        """Go on from what another one has learned, if it measures bodies alike; else anew."""
        if np.array_equal(self._units, former._units):
            self.restore(former.arrays())
