"""Online learners: TD(lambda) with accumulating traces (Eq. 7-13), and variants of TD(0).

An agent that does not observe the actions of others cannot distinguish a bad action from a good one
that they spoiled. Lauer and Riedmiller (2000) let values only rise; Matignon, Laurent and Le
Fort-Piat (2007) let them fall more slowly than they rise. The frequency of the maximum reward
distinguishes an action that pays well in coordination from a lucky one (Kapetanakis and Kudenko
2002).

Q-learning learns from the best next action. It requires a state space that includes the actions
taken, so that the value of a state is the value of an action (Watkins and Dayan 1992).

The values of agents may add up to that of the team. In sparse cooperative Q-learning each agent
learns its part of the sum over its neighbors in a coordination graph; a common reward is divided
equally (Kok and Vlassis 2006). In value decomposition the sum learns from one error: the TD error
of the sum updates every agent (Sunehag et al. 2018).
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

    kept: tuple[str, ...] = ("theta", "trace")
    """Names of saved arrays. Those in `traces` have one row per agent, the others one per row."""
    traces = ("trace",)
    fixed_arrays: ClassVar[tuple[str, ...]] = ("theta", "trace")
    reward_of: Literal["left", "entered"] = "left"
    """Reward in the TD error of a step: that of the state left or of the state entered."""

    def __init__(self, settings: Any, rules: RuleBase, rows: IntArray) -> None:
        self.settings, self.discount = settings, settings.discount
        self.rules, self.rows = rules, rows
        n_rows = int(rows.max()) + 1
        self.theta: FloatArray = np.zeros((n_rows, rules.n_rules), rules.dtype)
        self.weights = self.theta
        """Weights that are updated. Agents decide by `theta`, which may be an average of them."""
        self.trace: FloatArray = np.zeros((len(rows), rules.n_rules), rules.dtype)
        self._previous: FloatArray | None = None
        self._rewards: FloatArray = np.zeros(len(rows))

    @property
    def of_agents(self) -> FloatArray:
        """Weights ``(n, n_rules)`` of every agent; not a copy if each has its own row."""
        return self.weights if len(self.weights) == len(self.rows) else self.weights[self.rows]

    def errors(
        self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None
    ) -> FloatArray:
        """Return the TD errors ``(n,)`` of `states` (Eq. 7)."""
        met = states[:, None]
        if entered is not None:
            met = np.empty((len(states), 2, states.shape[1]))
            met[:, 0], met[:, 1] = states, entered
        values = self.rules.values_of_agents(self.of_agents, met)
        ahead = 0.0 if entered is None else self.discount * values[:, 1]
        return rewards + ahead - values[:, 0]

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
            rewards = self._rewards if self.reward_of == "left" else entered
            changed += self._update(self._previous, rewards, states)
        self._previous = states.copy()
        self._rewards = entered
        if terminated:
            changed += self._update(states, self._rewards / (1.0 - self.discount), None)
        return changed

    def end_episode(self) -> int:
        """Return 0, because every step has been learned already."""
        return 0

    @abstractmethod
    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        """Learn from the rewards of `states` and the next states, None if they are terminal.

        Returns the number of weights changed.
        """

    def _kept(self) -> dict[str, FloatArray]:
        """Return the arrays that are saved, by name."""
        own = vars(self)
        return {name: own[name] for name in self.kept}

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
            if name not in self.traces:
                own[...] = others[name][rows] if others[name].ndim else others[name]


class FrozenSettings(LearnerSettings):
    """Learner whose weights stay zero, the control of learning curves."""

    kind: Literal["frozen"] = "frozen"
    factory: ClassVar[str] = f"{__name__}:Frozen"


class Frozen(Online):
    """Never learns: the consequent weights stay zero."""

    kept = fixed_arrays = ("theta",)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        return 0

    def state_dict(self) -> dict[str, FloatArray]:
        """Return the weights."""
        return {"theta": self.theta}

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        super().load_state_dict({"previous": self.theta[:0], "rewards": self._rewards, **state})


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
    """Number of updates over which the agents average the learned weights to decide; 1: none."""
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
        self.reward_of = settings.reward_of
        self.theta += settings.initial_weight
        self.updates: FloatArray = np.zeros(())
        self._entered: tuple[IntArray, FloatArray] | None = None
        if settings.averaging > 1:
            self.weights = self.theta.copy()
            self.kept = (*self.kept, "weights", "updates")

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
        decay = self.discount * self.settings.trace_decay
        # The states left are those entered before: their features are computed once.
        active = self._entered or self.rules.active(states)
        active_next = active if entered is None else self.rules.active(entered)
        self._entered = active_next
        constants = discount, step_sizes, decay
        td_lambda_update(
            self.weights, self.rows, self.trace, active, active_next, rewards, constants
        )
        if self.settings.averaging > 1:
            self.updates += 1.0
            rate = 1.0 / min(float(self.updates), self.settings.averaging)
            self.theta += rate * (self.weights - self.theta)
        return self.theta.size


class OneStepSettings(LearnerSettings):
    """Base class of the settings of `OneStep` learners."""

    step_size: Positive = 0.1
    """alpha, divided by the squared length of the feature vector."""


class OneStep(Online):
    """TD(0) with step sizes divided by the squared lengths of feature vectors."""

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        return self._step(states, self.errors(states, rewards, entered))

    def _step(
        self, states: FloatArray, delta: FloatArray, lengths: FloatArray | np.float64 | None = None
    ) -> int:
        """Add ``alpha delta phi / lengths`` to the weights; return their number.

        Parameters
        ----------
        states
            ``(n, d)`` states with feature vectors phi.
        delta
            ``(n,)`` errors.
        lengths
            ``(n,)`` or a scalar; by default the squared lengths of phi.
        """
        if lengths is None:
            lengths = self.rules.squared_lengths(states)
        steps = self.settings.step_size * delta / lengths
        self.rules.add_features(self.weights, self.rows, states, steps)
        return self.theta.size


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

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(states, rewards, entered)
        return self._step(states, np.maximum(delta, self.settings.falling * delta))


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

    kept = ("theta", "weights", "greatest", "hits", "visits", "trace")

    def __init__(self, settings: FMQSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        self.weights = np.zeros_like(self.theta)
        shape = self.theta.shape
        self.greatest: FloatArray = np.full(shape, -np.inf)
        self.hits: FloatArray = np.zeros(shape)
        self.visits: FloatArray = np.zeros(shape)

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        super()._update(states, rewards, entered)
        active, strengths = self.rules.active(states)
        fired = active[np.arange(len(states)), strengths.argmax(axis=1)]
        for row, rule, reward in zip(self.rows, fired, rewards, strict=True):
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
    """alpha, divided by the squared length of the feature vector."""


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

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(states, rewards, None)
        if entered is not None:
            met = np.repeat(entered[:, None], len(self._choices), axis=1)
            met[:, :, self._columns] = self._choices
            delta += self.discount * self.rules.values_of_agents(self.of_agents, met).max(axis=1)
        return self._step(states, delta)


class SparseCooperativeSettings(OneStepSettings):
    """Sparse cooperative Q-learning: agents learn the parts of a sum."""

    kind: Literal["sparse-cooperative"] = "sparse-cooperative"
    factory: ClassVar[str] = f"{__name__}:SparseCooperative"


class SparseCooperative(OneStep):
    """TD(0) for each part of a sum (Kok and Vlassis 2006, Eq. 11, on after-states).

    On entering state s' after state s, agent i of n learns::

        delta_i = R_i(s) + gamma f_i(s') - f_i(s)
        theta_i = theta_i + alpha delta_i phi_i(s) / |phi_i(s)|^2

    where R_i is its own reward, or R / n for a common reward: the deltas then add up to the TD
    error of ``sum_i f_i``. The state entered replaces the best next state, which the greedy joint
    action of the graph leads to.
    """

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Update for the step from the previous states to these, each agent by its share."""
        shared = reward / len(states) if np.ndim(reward) == 0 else reward
        return super().observe(states, shared, terminated)


class ValueDecompositionSettings(OneStepSettings):
    """Value decomposition: the sum of all values learns from the TD error of the team."""

    kind: Literal["vdn"] = "vdn"
    factory: ClassVar[str] = f"{__name__}:ValueDecomposition"
    step_size: Positive = 0.1
    """alpha, divided by the squared length of all agents' feature vectors together."""


class ValueDecomposition(SparseCooperative):
    """TD(0) on the sum of the agents' values, without the networks of the original.

    On entering state s' after state s, with R the reward of all (the sum, if each has its own)::

        delta   = R(s) + gamma sum_i f_i(s') - sum_i f_i(s)
        theta_i = theta_i + alpha delta phi_i(s) / sum_j |phi_j(s)|^2

    The state entered replaces the best next state, as in all learners here.
    """

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(states, rewards, entered).sum()
        lengths = self.rules.squared_lengths(states).sum()
        return self._step(states, np.full(len(states), delta), lengths)
