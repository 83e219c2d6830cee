"""Online TD(lambda) with accumulating traces (Eq. 7-13).

And what online learners share, traces and one update per step, and the one that never learns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..numerics import FloatArray, IntArray
from ..plugins.settings import Fraction, Positive
from ..rules.kernels.compact import td_update
from ..rules.rule_base import RuleBase
from .learner import LearnerSettings


class Online(ABC):
    """Learns from one state to the next, agent by agent; those of one row change it in turn.

    A terminal state is followed by itself for ever, which adds one update with the reward
    R / (1 - discount) and no next state.
    """

    kept: tuple[str, ...] = ("theta", "trace", "reach")
    """Names of the arrays that are saved: those of rows, and of agents the `traces`."""
    traces = ("trace", "reach")

    def __init__(self, settings: Any, rules: RuleBase, rows: IntArray) -> None:
        self.settings, self.discount = settings, settings.discount
        self.rules, self.rows = rules, rows
        n_rows = int(rows.max()) + 1
        self.theta: FloatArray = np.zeros((n_rows, rules.n_rules), rules.dtype)
        self.weights = self.theta
        """The consequent weights that learn; those that decide, theta, may be an average."""
        self.trace: FloatArray = np.zeros((len(rows), rules.n_rules), rules.dtype)
        self.reach: FloatArray = np.zeros((len(rows), rules.n_parts))
        self._previous: FloatArray | None = None
        self._rewards: FloatArray = np.zeros(len(rows))

    @property
    def of_agents(self) -> FloatArray:
        """The weights of every agent ``(n, n_rules)``, no copy if each has its own row."""
        return self.weights if len(self.weights) == len(self.rows) else self.weights[self.rows]

    def errors(
        self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None
    ) -> FloatArray:
        """Return the TD errors ``(n,)`` of `states` (Eq. 7)."""
        met = states[:, None]
        if entered is not None:
            met = np.empty((len(states), 2, states.shape[1]))
            met[:, 0], met[:, 1] = states, entered
        values = self.rules.each(self.of_agents, met)
        ahead = 0.0 if entered is None else self.discount * values[:, 1]
        return rewards + ahead - values[:, 0]

    def begin_episode(self) -> None:
        """Clear the traces."""
        if self._previous is not None:  # memory that is never written is never taken
            self.trace[:], self.reach[:] = 0.0, 0.0
        self._previous = None

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Update for the step from the previous states to these."""
        changed = 0
        if self._previous is not None:
            changed += self._update(self._previous, self._rewards, states)
        self._previous = states.copy()
        self._rewards = np.broadcast_to(np.asarray(reward, dtype=float), (len(states),)).copy()
        if terminated:
            changed += self._update(states, self._rewards / (1.0 - self.discount), None)
        return changed

    def end_episode(self) -> int:
        """Nothing is left to learn."""
        return 0

    @abstractmethod
    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        """Learn from R(s) of `states` and the states entered after them, none if terminal.

        Returns the number of weights changed.
        """

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, traces and the previous states with their rewards."""
        previous = self._previous if self._previous is not None else np.zeros((0, 0))
        named: dict[str, FloatArray] = {name: getattr(self, name) for name in self.kept}
        return named | {"previous": previous, "rewards": self._rewards}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        for name in self.kept:
            setattr(self, name, arrays[name].copy())
        if "weights" not in self.kept:
            self.weights = self.theta
        self._previous = arrays["previous"].copy() if arrays["previous"].size else None
        self._rewards = arrays["rewards"].copy()

    def continue_from(self, former: Online, rows: IntArray) -> None:
        """Begin with all weights of another team; traces are of an episode, and begin anew."""
        for name in (name for name in self.kept if name not in self.traces):
            array = getattr(former, name)
            setattr(self, name, array[rows] if array.ndim else array.copy())
        if "weights" not in self.kept:
            self.weights = self.theta


class FrozenSettings(LearnerSettings):
    """No learning: the consequents stay zero. The control of every learning curve."""

    kind: Literal["frozen"] = "frozen"
    factory: ClassVar[str] = f"{__name__}:Frozen"


class Frozen(Online):
    """Never learns: the consequent weights stay as they are, zero from the start."""

    kept = ("theta",)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        return 0

    def arrays(self) -> dict[str, FloatArray]:
        """Return the weights, which is all there is."""
        return {"theta": self.theta}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        super().restore({"previous": self.theta[:0], "rewards": self._rewards, **arrays})


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
        td_update(
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
