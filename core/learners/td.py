"""Online TD(lambda) with accumulating traces (Eq. 7-13)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..numerics.arrays import FloatArray, IntArray
from ..plugins.settings import Fraction, Positive
from ..rules.rule_base import RuleBase
from .learner import LearnerSettings
from .online import Online


class TDLambdaSettings(LearnerSettings):
    """Online TD(lambda), Eq. 7-13."""

    kind: Literal["td-lambda"] = "td-lambda"
    factory: ClassVar[str] = f"{__name__}:TDLambda"
    step_size: Positive = 0.00012
    """Step size, alpha of Eq. 13."""
    trace_decay: Fraction = 0.4
    """Trace decay, lambda of Eq. 8."""
    normalised: bool = False
    """Divide the step size by the squared length of the feature vector."""
    averaging: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 1.0
    """Steps over which the weights that decide average those that learn; 1: they are the same."""


class TDLambda(Online):
    """The paper's learner: one update of all agents per step.

    On entering state s' after state s::

        delta = R(s) + gamma f(s') - f(s)          (Eq. 7)
        e     = gamma lambda e + phi(s)            (Eq. 8, 12)
        theta = theta + alpha delta e              (Eq. 13)

    With a normalised step size alpha is divided by the squared length of phi(s), so that
    ``step_size = 1`` would remove the TD error of s at once.

    With averaging over n steps this is learned by w in place of theta, and the agent decides by::

        theta = theta + (w - theta) / min(t, n)    after t updates

    the mean of all w so far, later an exponential one (Polyak and Juditsky 1992): a constant step
    size then keeps learning without its noise deciding.
    """

    def __init__(self, settings: TDLambdaSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.updates: FloatArray = np.zeros(())
        if settings.averaging > 1:
            self.weights = np.zeros_like(self.theta)
            self.kept = (*self.kept, "weights", "updates")

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        lengths: FloatArray = np.ones(len(states))
        if self.settings.normalised:
            lengths = self.rules.squared_lengths(states)
        self.rules.td_update(
            self.weights, self.rows, self.trace, self.reach, states,
            states if entered is None else entered, rewards,
            0.0 if entered is None else self.discount, self.settings.step_size, lengths,
            self.discount * self.settings.trace_decay, self.rules.layout,
        )  # fmt: skip
        if self.settings.averaging > 1:
            self.updates += 1.0
            rate = 1.0 / min(float(self.updates), self.settings.averaging)
            self.theta += rate * (self.weights - self.theta)
        return self.theta.size
