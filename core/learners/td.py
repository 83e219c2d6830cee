"""Online TD(lambda) with accumulating traces (Eq. 7-13)."""

from __future__ import annotations

from .. import kernels
from ..arrays import FloatArray
from ..config import TDLambdaSettings
from ..rules import RuleBase
from .online import Online


class TDLambda(Online):
    """The paper's learner: one update of all agents per step.

    On entering state s' after state s::

        delta = R(s) + gamma f(s') - f(s)          (Eq. 7)
        e     = gamma lambda e + phi(s)            (Eq. 8, 12)
        theta = theta + alpha delta e              (Eq. 13)

    With a normalised step size alpha is divided by the squared length of phi(s), so that
    ``step_size = 1`` would remove the TD error of s at once.
    """

    def __init__(self, settings: TDLambdaSettings, rules: RuleBase, n_agents: int) -> None:
        super().__init__(settings.discount, rules, n_agents)
        self.settings = settings

    def _update(self, states: FloatArray, reward: float, entered: FloatArray | None) -> int:
        steps = self.settings.step_size * self._errors(states, reward, entered)
        if self.settings.normalised:
            steps = steps / self.rules.squared_lengths(states)
        decay = self.discount * self.settings.trace_decay
        kernels.td_update(
            self.theta, self.trace, self.reach, states, steps, decay, self.rules.layout
        )
        return self.theta.size
