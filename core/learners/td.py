"""Online learners: TD(lambda) with accumulating traces (Eq. 7-13), and variants of TD(0).

An agent that does not observe the actions of others cannot distinguish a bad action from a good one
that they spoiled. Lauer and Riedmiller (2000) let values only rise; Matignon, Laurent and Le
Fort-Piat (2007) let them fall more slowly than they rise. The frequency of the maximum reward
distinguishes an action that pays well in coordination from a lucky one (Kapetanakis and Kudenko
2002).

Q-learning learns from the best next action. It requires a state space that includes the actions
taken, so that the value of a state is the value of an action (Watkins and Dayan 1992).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from itertools import product
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from ..numerics import FloatArray, IntArray
from ..plugins.settings import Fraction, NonNegative, Positive
from ..values.rule_base import RuleBase
from ..values.updates import td_lambda_update
from .learner import Learner, LearnerSettings


class Online(Learner):
    """Learns at every step, agent by agent. Agents that share a row update it in turn.

    A terminal state counts as entered forever: it adds one update with the reward
    R / (1 - discount) and no next state.
    """

    def __init__(self, settings: Any, rules: RuleBase, rows: IntArray) -> None:
        self.settings = settings
        self.discount = settings.discount
        self.rules = rules
        self.rows = rows
        n_rows = int(rows.max()) + 1
        self.theta: FloatArray = np.zeros((n_rows, rules.n_rules))
        self.weights: FloatArray = self.theta
        """Weights that are updated. Agents decide by `theta`, which may be an average of them."""
        self.trace: FloatArray = np.zeros((len(rows), rules.n_rules))
        self._previous: FloatArray | None = None
        self._rewards: FloatArray = np.zeros(len(rows))

    def begin_episode(self) -> None:
        """Clear the traces."""
        if self._previous is not None:  # untouched memory is not allocated
            self.trace[:] = 0.0
        self._previous = None

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Update for the step from the previous states to these."""
        changed = 0
        entered = np.broadcast_to(np.asarray(reward, dtype=float), (len(states),)).copy()
        if self._previous is not None:
            changed += self._update(self._previous, self._reward_of(self._rewards, entered), states)
        self._previous = states.copy()
        self._rewards = entered
        if terminated:
            changed += self._update(states, entered / (1.0 - self.discount), None)
        return changed

    def _reward_of(self, left: FloatArray, entered: FloatArray) -> FloatArray:
        """Return the rewards in the TD errors of a step: those of the states left."""
        return left

    @abstractmethod
    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        """Learn from the rewards of `states` and the next states, None if they are terminal.

        Returns the number of weights changed.
        """

    def _kept(self) -> dict[str, FloatArray]:
        """Return the arrays that are saved: the trace has a row per agent, others one per row."""
        return {"theta": self.theta, "trace": self.trace}

    def state_dict(self) -> dict[str, FloatArray]:
        """Return weights, traces and the previous states with their rewards."""
        previous = self._previous if self._previous is not None else np.zeros((0, 0))
        return self._kept() | {"previous": previous, "rewards": self._rewards}

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        for name, array in self._kept().items():
            array[...] = state[name]
        self._previous = state["previous"].copy() if state["previous"].size else None
        self._rewards = state["rewards"].copy()

    def warm_start(self, former: Self, rows: IntArray) -> None:
        """Start from the weights of another team, with zero traces."""
        others = former._kept()
        for name, own in self._kept().items():
            if name != "trace":
                own[...] = others[name][rows] if others[name].ndim else others[name]


class FrozenSettings(LearnerSettings):
    """Learner whose weights stay zero, the control of learning curves."""

    kind: Literal["frozen"] = "frozen"
    factory: ClassVar[str] = f"{__name__}:Frozen"


class Frozen(Learner):
    """Never learns: the consequent weights stay zero."""

    def __init__(self, settings: LearnerSettings, rules: RuleBase, rows: IntArray) -> None:
        self.theta: FloatArray = np.zeros((int(rows.max()) + 1, rules.n_rules))

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Return 0, because no weight changes."""
        return 0

    def warm_start(self, former: Self, rows: IntArray) -> None:
        """Start from the weights of another team."""
        self.theta = former.theta[rows]


class TDLambdaSettings(LearnerSettings):
    """Online TD(lambda), Eq. 7-13."""

    kind: Literal["td-lambda"] = "td-lambda"
    factory: ClassVar[str] = f"{__name__}:TDLambda"
    step_size: Positive = 0.00012
    """Step size, alpha of Eq. 13."""
    trace_decay: Fraction = 0.4
    """Trace decay, lambda of Eq. 8."""
    normalized: bool = False
    """Divide the step size by the squared length of the feature vector."""
    averaging: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 1.0
    """Number of updates over which agents average the weights for decisions; 1: no averaging."""
    initial_weight: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    """Consequent weight of every rule before learning. With ``order = "full"`` it is the value of
    every state; above attainable values it favors states that were not visited."""
    reward_of: Literal["left", "entered"] = "left"
    """Reward R in Eq. 7: that of the state left, s_previous, as printed; or that of the state
    entered, as in Section V, where rewards are computed after the move."""


class TDLambda(Online):
    """The paper's learner: one update of all agents per step.

    On entering state s' after state s::

        delta = R(s) + gamma f(s') - f(s)          (Eq. 7)
        e     = gamma lambda e + phi(s)            (Eq. 8, 12)
        theta = theta + alpha delta e              (Eq. 13)

    With a normalized step size alpha is divided by the squared length of phi(s), so that
    ``step_size = 1`` would remove the TD error of s at once.

    With ``reward_of = "entered"``, R(s') replaces R(s), another reading of Section V: a value then
    excludes the reward of its own state, in which the after-states of a decision differ. Terminal
    states have the same value in both readings.

    With averaging over n steps, w learns instead of theta, and the agent decides by::

        theta = theta + (w - theta) / min(t, n)    after t updates

    the mean of all w so far, later an exponential one (Polyak and Juditsky 1992): a constant step
    size then keeps learning without its noise deciding.
    """

    def __init__(self, settings: TDLambdaSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.theta += settings.initial_weight
        self.updates: FloatArray = np.zeros(())
        self._entered: tuple[IntArray, FloatArray] | None = None
        if settings.averaging > 1:
            self.weights = self.theta.copy()

    def _reward_of(self, left: FloatArray, entered: FloatArray) -> FloatArray:
        return left if self.settings.reward_of == "left" else entered

    def _kept(self) -> dict[str, FloatArray]:
        averaged = {"weights": self.weights, "updates": self.updates}
        return super()._kept() | (averaged if self.settings.averaging > 1 else {})

    def begin_episode(self) -> None:
        """Clear the traces."""
        super().begin_episode()
        self._entered = None

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        super().load_state_dict(state)
        self._entered = None

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        lengths: FloatArray = np.ones(len(states))
        if self.settings.normalized:
            lengths = self.rules.squared_lengths(states)
        discount = 0.0 if entered is None else self.discount
        step_sizes = self.settings.step_size / lengths
        step_sizes[self.idle] = 0.0
        decay = self.discount * self.settings.trace_decay
        # The states left are those entered before: their features are computed once.
        active = self._entered or self.rules.active(states)
        active_next = active if entered is None else self.rules.active(entered)
        self._entered = active_next
        constants = discount, step_sizes, decay
        td_lambda_update(
            self.weights, self.rows, self.trace, active, active_next, rewards, constants
        )
        self.trace[self.idle] = 0.0
        if self.settings.averaging > 1:
            self.updates += 1.0
            rate = 1.0 / min(float(self.updates), self.settings.averaging)
            self.theta += rate * (self.weights - self.theta)
        return self.theta.size


class OneStepSettings(LearnerSettings):
    """Base class of the settings of `OneStep` learners."""

    step_size: Positive = 0.1
    """Step size alpha, divided by the squared length of the feature vector."""


class OneStep(Online):
    """TD(0) with step sizes divided by the squared lengths of feature vectors."""

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        errors = self._errors(states, rewards, entered)
        steps = self.settings.step_size * errors / self._lengths(states)
        steps[self.idle] = 0.0
        self.rules.add_features(self.weights, self.rows, states, steps)
        return self.theta.size

    def _errors(
        self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None
    ) -> FloatArray:
        """Return the TD errors ``(n,)`` of `states` (Eq. 7)."""
        if entered is None:
            return rewards - self._values(states[:, None])[:, 0]
        values = self._values(np.stack([states, entered], axis=1))
        return rewards + self.discount * values[:, 1] - values[:, 0]

    def _values(self, states: FloatArray) -> FloatArray:
        """Return values ``(n, s)`` of states ``(n, s, d)``."""
        return self.rules.values_of_agents(self.weights[self.rows], states)

    def _lengths(self, states: FloatArray) -> FloatArray:
        """Return the squared lengths ``(n,)`` of feature vectors, or one number for all."""
        return self.rules.squared_lengths(states)


class OptimisticTDSettings(OneStepSettings):
    """TD(0) whose values rise faster than they fall, for agents that do not observe others."""

    kind: Literal["optimistic-td"] = "optimistic-td"
    factory: ClassVar[str] = f"{__name__}:OptimisticTD"
    falling: Fraction = 0.0
    """Step size of negative TD errors over alpha: 0 never lowers a value (distributed Q-learning),
    in between is hysteretic, 1 is TD(0)."""


class OptimisticTD(OneStep):
    """TD(0) with a smaller step size for negative TD errors.

    On entering state s' after state s::

        delta = R(s) + gamma f(s') - f(s)                       (Eq. 7)
        theta = theta + alpha max(delta, b delta) phi(s) / |phi(s)|^2

    with b the setting `falling`.
    """

    def _errors(
        self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None
    ) -> FloatArray:
        errors = super()._errors(states, rewards, entered)
        return np.maximum(errors, self.settings.falling * errors)


class FMQSettings(OneStepSettings):
    """Frequency maximum Q-value, for agents that do not observe others."""

    kind: Literal["fmq"] = "fmq"
    factory: ClassVar[str] = f"{__name__}:FMQ"
    weight: NonNegative = 10.0
    """Weight c of the frequency of the maximum reward."""


class FMQ(OneStep):
    """TD(0) with a bonus for rules under which the greatest reward came often.

    ``weights`` learn as in TD(0). For the rule k that fires most in the state left, a table keeps
    the greatest reward R_max(k) and its frequency F(k) as a fraction of visits. Agents decide by::

        theta_k = weights_k + c F(k) R_max(k)

    With membership functions at the actions of a game this is the published heuristic; between
    membership functions it is an approximation.
    """

    def __init__(self, settings: FMQSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.weights = np.zeros_like(self.theta)
        shape = self.theta.shape
        self.greatest: FloatArray = np.full(shape, -np.inf)
        self.hits: FloatArray = np.zeros(shape)
        self.visits: FloatArray = np.zeros(shape)

    def _kept(self) -> dict[str, FloatArray]:
        table = {"greatest": self.greatest, "hits": self.hits, "visits": self.visits}
        return super()._kept() | {"weights": self.weights} | table

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        super()._update(states, rewards, entered)
        active, strengths = self.rules.active(states)
        fired = active[np.arange(len(states)), strengths.argmax(axis=1)]
        decided = [np.delete(array, self.idle) for array in (self.rows, fired, rewards)]
        for row, rule, reward in zip(*decided, strict=True):
            self.visits[row, rule] += 1.0
            if reward > self.greatest[row, rule]:
                self.greatest[row, rule], self.hits[row, rule] = reward, 0.0
            self.hits[row, rule] += reward == self.greatest[row, rule]
        self.theta[:] = self.weights
        seen = self.visits > 0.0
        bonus = self.settings.weight * self.hits[seen] / self.visits[seen] * self.greatest[seen]
        self.theta[seen] += bonus
        return 2 * self.theta.size


class QLearningSettings(OneStepSettings):
    """Q-learning, for state spaces that include the actions taken."""

    kind: Literal["q-learning"] = "q-learning"
    factory: ClassVar[str] = f"{__name__}:QLearning"
    step_size: Positive = 0.3
    """Step size alpha, divided by the squared length of the feature vector."""


class QLearning(OneStep):
    """TD(0) with the greatest value over the actions in the next state as its target.

    Let x be the situation of a state and u the actions in it. On entering (x', u') after (x, u)::

        delta = R(x, u) + gamma max_v f(x', v) - f(x, u)
        theta = theta + alpha delta phi(x, u) / |phi(x, u)|^2

    If u includes the actions of several agents, the maximum is over all their joint actions: this
    is team Q-learning with a common reward.

    Raises
    ------
    ValueError
        If the state space includes no actions.
    """

    def __init__(self, settings: QLearningSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        if not rules.actions:
            raise ValueError(
                "learner.kind = 'q-learning': the state space includes no actions to maximize "
                "over, use td-lambda"
            )
        self._columns = sorted(rules.actions)
        centers = [rules.partitions[column].centers for column in self._columns]
        self._choices = np.array(list(product(*centers)))

    def _errors(
        self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None
    ) -> FloatArray:
        errors = super()._errors(states, rewards, None)
        if entered is not None:
            met = np.repeat(entered[:, None], len(self._choices), axis=1)
            met[:, :, self._columns] = self._choices
            errors += self.discount * self._values(met).max(axis=1)
        return errors
