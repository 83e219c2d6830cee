"""Self-models: Kalman estimates of the effect of every wheel on the motion of its body.

The twist of a body in its own frame is modeled as linear in its commanded wheel speeds::

    twist = effect @ [u_1, ..., u_w, 1] + noise

For each of its three components a Kalman filter tracks the row of the ``(3, w + 1)`` effect,
starting from the nominal geometry. When an innovation is improbably large, something has changed:
the covariance is inflated, so that old experience counts less. The predictor uses the effect; this
is how a team learns that a wheel has failed.

Wheels that pull against each other skid, and the twist is then not linear in their speeds. The
filter treats the residual as a change and becomes overconfident. It therefore records the size of
its innovations in units of their expected size. Its covariance, which sets the learning rate, is
unaffected; the reported standard deviations are multiplied by this ratio (Birge 1932).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..interface.abilities import Embodiment
from ..interface.prediction import EmbodiedPrediction
from ..interface.scenario import Scenario, Transition
from ..numerics import FloatArray, IntArray
from ..plugins.settings import Positive, Settings
from .adaptive import Adaptive

MEMORY = 100
"""Number of decisions over which the size of innovations is averaged."""


class SelfModelSettings(Settings):
    """Whether and how fast a body adapts the estimated effects of its wheels."""

    enabled: bool = False
    """Whether effects adapt; otherwise predictions use the nominal geometry."""
    prior_effect: Positive = 0.3
    """Standard deviation of a wheel's effect around the nominal one [m/s per m/s]."""
    prior_constant: Positive = 0.003
    """Standard deviation of the constant part of the motion [m/s]."""
    noise: Positive = 0.004
    """Standard deviation of a measured speed around the model's [m/s]."""
    surprise: Positive = 9.0
    """Squared innovation, in units of its expected square, above which a change is assumed."""
    inflation: Positive = 1.0
    """Share of the prior covariance that is added at a change."""


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
    A cart with a single wheel, which is seized.

    >>> nominal = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    >>> model = SelfModel(SelfModelSettings(enabled=True), [nominal])
    >>> for speed in (0.1, -0.1, 0.1, -0.1):
    ...     model.observe(0, np.array([speed]), np.zeros(3))
    >>> abs(float(model.effects[0][0, 0])) < 0.01
    True
    """

    def __init__(self, settings: SelfModelSettings, nominal: Sequence[FloatArray]) -> None:
        self._settings = settings
        self.bodies = [np.array(effect, dtype=float) for effect in nominal]
        # A turning rate is measured in units of the nominal body's own turning per wheel speed.
        turning = [max(1.0, float(np.abs(effect[2]).max())) for effect in nominal]
        self._units = [np.array([1.0, 1.0, unit]) for unit in turning]
        of_effect = settings.prior_effect**2
        of_constant = settings.prior_constant**2
        wheels = [effect.shape[1] - 1 for effect in nominal]
        self._priors = [np.diag([of_effect] * w + [of_constant]) for w in wheels]
        # By body, the effect, the covariance of each of its rows, and the mean squared innovation
        # of each row in units of the expected square.
        self.memory = {f"effect{r}": effect.copy() for r, effect in enumerate(self.bodies)}
        for r, prior in enumerate(self._priors):
            self.memory |= {f"covariance{r}": np.stack([prior] * 3), f"ratio{r}": np.ones(3)}

    def _by_body(self, name: str) -> tuple[FloatArray, ...]:
        return tuple(self.memory[f"{name}{r}"] for r in range(len(self.bodies)))

    @property
    def effects(self) -> tuple[FloatArray, ...]:
        """By body, the estimated ``(3, w + 1)`` effect of its wheels."""
        return self._by_body("effect")

    @property
    def deviations(self) -> tuple[FloatArray, ...]:
        """Standard deviations ``(3, w + 1)`` of the effect of every body.

        Those of the filters are multiplied by the ratio of actual to expected innovations.
        """
        larger = (np.sqrt(np.maximum(1.0, ratio)) for ratio in self._by_body("ratio"))
        scales = (scale[:, None] for scale in map(np.multiply, self._units, larger))
        own = (np.sqrt(np.diagonal(c, axis1=1, axis2=2)) for c in self._by_body("covariance"))
        return tuple(map(np.multiply, scales, own))

    @classmethod
    def of(cls, settings: SelfModelSettings, scenario: Scenario) -> SelfModel | None:
        """Return the self-model of a scenario's bodies, None if it is not enabled.

        Raises
        ------
        ValueError
            If the scenario has no bodies on wheels.
        """
        if not settings.enabled:
            return None
        if not isinstance(scenario, Embodiment):
            raise ValueError("learner.self_model.enabled: the scenario has no bodies on wheels")
        return cls(settings, scenario.nominal_effects)

    def adapt(
        self, prediction: EmbodiedPrediction, joint_action: IntArray, transition: Transition
    ) -> None:
        """Update all effects by the motion of the bodies.

        The predicted effect of contacts is subtracted: a body that moves a load is slow, not
        broken.
        """
        twists = transition.measured_twists()
        if twists is None:
            return
        speeds = prediction.commands(joint_action)
        slips = prediction.slips(joint_action)
        free = twists[-len(slips) :] - slips
        for body, group in enumerate(prediction.groups):
            self.observe(body, speeds[list(group)], free[body])

    def observe(self, body: int, speeds: FloatArray, twist: FloatArray) -> None:
        """Update by a twist ``(3,)`` measured under commanded wheel speeds ``(w,)``."""
        settings = self._settings
        regressor = np.append(speeds, 1.0)
        ratio = self.memory[f"ratio{body}"]
        noise = settings.noise**2
        effect = self.memory[f"effect{body}"]
        covariance = self.memory[f"covariance{body}"]
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
