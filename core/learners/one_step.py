"""TD(0) of normalised steps, and what agents that do not see one another learn by it.

An agent that does not see what the others do cannot tell a bad action from a good one that they
spoilt. Lauer and Riedmiller (2000) let values rise only; Matignon, Laurent and Le Fort-Piat (2007)
let them fall, more slowly than they rise. The frequency of the maximum reward tells an action that
pays well if the others do their part from one that was lucky (Kapetanakis and Kudenko 2002).

Q-learning learns values of states and actions from the best action that could follow. It is for
state spaces that hold what has been chosen beside the situation it was chosen in: there the value
of a state is the value of an action (Watkins and Dayan 1992).

Agents' values may add up to the team's. In sparse cooperative Q-learning each agent learns its part
of the sum, over its neighbours in a coordination graph; what all are paid together is shared out
equally, so that the parts add up to it (Kok and Vlassis 2006). In value decomposition the sum
learns from one error: what all are paid says nothing of who earned it, and the TD error of the sum
goes back to every agent alike (Sunehag et al. 2018).
"""

from itertools import product
from typing import ClassVar, Literal

import numpy as np

from ..numerics import FloatArray, IntArray
from ..plugins.settings import Fraction, NonNegative, Positive
from ..rules.kernels.updates import add_features
from ..rules.rule_base import RuleBase
from .learner import LearnerSettings
from .td import Online


class OneStepSettings(LearnerSettings):
    """What the settings of `OneStep` learners share."""

    step_size: Positive = 0.1
    """alpha, divided by the squared length of the feature vector."""


class OneStep(Online):
    """TD(0) whose steps are divided by the squared lengths of feature vectors."""

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        return self._step(states, self.errors(states, rewards, entered))

    def _step(
        self, states: FloatArray, delta: FloatArray, lengths: FloatArray | np.float64 | None = None
    ) -> int:
        """Add ``alpha delta phi / lengths`` to the weights; return how many there are.

        Parameters
        ----------
        states
            ``(n, d)`` of which phi are the feature vectors.
        delta
            ``(n,)`` errors.
        lengths
            ``(n,)`` or one for all: what steps are divided by; the squared lengths of phi if none
            is given.
        """
        if lengths is None:
            lengths = self.rules.squared_lengths(states)
        steps = self.settings.step_size * delta / lengths
        add_features(self.weights, self.rows, states, steps, self.rules.layout)
        return self.theta.size


class OptimisticTDSettings(OneStepSettings):
    """TD(0) whose values rise faster than they fall, for agents that do not see one another."""

    kind: Literal["optimistic-td"] = "optimistic-td"
    factory: ClassVar[str] = f"{__name__}:OptimisticTD"
    falling: Fraction = 0.0
    """Step size of negative TD errors over alpha: 0 never lowers a value (distributed Q-learning),
    in between is hysteretic, 1 is TD(0)."""


class OptimisticTD(OneStep):
    """TD(0) that believes good news more than bad.

    On entering state s' after state s::

        delta = R(s) + gamma f(s') - f(s)                       (Eq. 7)
        theta = theta + alpha max(delta, b delta) phi(s) / |phi(s)|^2

    with b the setting `falling`.
    """

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(states, rewards, entered)
        return self._step(states, np.maximum(delta, self.settings.falling * delta))


class FMQSettings(OneStepSettings):
    """Frequency maximum Q-value, for agents that do not see one another."""

    kind: Literal["fmq"] = "fmq"
    factory: ClassVar[str] = f"{__name__}:FMQ"
    weight: NonNegative = 10.0
    """c: how much the frequency of the maximum reward counts."""


class FMQ(OneStep):
    """TD(0) with a bonus for rules under which the greatest reward came often.

    ``weights`` learn as in TD(0). Of the rule k that fires most in the state left, a table keeps
    the greatest reward R_max(k), and how often it came, F(k), as a fraction of visits. Agents
    decide by::

        theta_k = weights_k + c F(k) R_max(k)

    With membership functions at the actions of a game this is the published heuristic; between
    membership functions it is an approximation.
    """

    kept = ("theta", "weights", "greatest", "hits", "visits", "trace", "reach")

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
    """Q-learning, for state spaces that hold the actions taken."""

    kind: Literal["q-learning"] = "q-learning"
    factory: ClassVar[str] = f"{__name__}:QLearning"
    step_size: Positive = 0.3
    """alpha, divided by the squared length of the feature vector."""


class QLearning(OneStep):
    """TD(0) whose target is the greatest value over the actions in the state that was entered.

    With x the situation of a state and u the actions that it holds, on entering (x', u') after
    (x, u)::

        delta = R(x, u) + gamma max_v f(x', v) - f(x, u)
        theta = theta + alpha delta phi(x, u) / |phi(x, u)|^2

    Where u holds the actions of several agents, the maximum is over all their joint actions: the
    team Q-learning of agents that are paid together. It takes as many values as there are.

    Raises
    ------
    ValueError
        If the state space holds no actions.
    """

    def __init__(self, settings: QLearningSettings, rules: RuleBase, rows: IntArray) -> None:
        super().__init__(settings, rules, rows)
        if not rules.actions:
            raise ValueError(
                "learner.kind = 'q-learning': the state space holds no actions to maximise over, "
                "use td-lambda"
            )
        self._columns = sorted(rules.actions)
        centres = [rules.partitions[column].centres for column in self._columns]
        self._choices = np.array(list(product(*centres)))

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(states, rewards, None)
        if entered is not None:
            met = np.repeat(entered[:, None], len(self._choices), axis=1)
            met[:, :, self._columns] = self._choices
            delta += self.discount * self.rules.each(self.of_agents, met).max(axis=1)
        return self._step(states, delta)


class SparseCooperativeSettings(OneStepSettings):
    """Agents learn the parts of a sum, each by its share of the reward."""

    kind: Literal["sparse-cooperative"] = "sparse-cooperative"
    factory: ClassVar[str] = f"{__name__}:SparseCooperative"


class SparseCooperative(OneStep):
    """TD(0) for each part of a sum (Kok and Vlassis 2006, Eq. 11, on after-states).

    On entering state s' after state s, agent i of n learns::

        delta_i = R_i(s) + gamma f_i(s') - f_i(s)
        theta_i = theta_i + alpha delta_i phi_i(s) / |phi_i(s)|^2

    where R_i is its own reward, or R / n if one is paid to all: then the deltas add up to the TD
    error of ``sum_i f_i``. The state entered stands for the best one, which is what the greedy
    joint action of the graph leads to.
    """

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Update for the step from the previous states to these, each agent by its share."""
        shared = reward / len(states) if np.ndim(reward) == 0 else reward
        return super().observe(states, shared, terminated)


class ValueDecompositionSettings(OneStepSettings):
    """The sum of all agents' values learns from the TD error of the team."""

    kind: Literal["vdn"] = "vdn"
    factory: ClassVar[str] = f"{__name__}:ValueDecomposition"
    step_size: Positive = 0.1
    """alpha, divided by the squared length of all agents' feature vectors together."""


class ValueDecomposition(SparseCooperative):
    """TD(0) on the sum of the agents' values, without the networks of the original.

    On entering state s' after state s, with R the reward of all (the sum, if each has its own)::

        delta   = R(s) + gamma sum_i f_i(s') - sum_i f_i(s)
        theta_i = theta_i + alpha delta phi_i(s) / sum_j |phi_j(s)|^2

    The state entered stands for what the agents' greatest values lead to, as in all learners here.
    """

    def _update(self, states: FloatArray, rewards: FloatArray, entered: FloatArray | None) -> int:
        delta = self.errors(states, rewards, entered).sum()
        lengths = self.rules.squared_lengths(states).sum()
        return self._step(states, np.full(len(states), delta), lengths)
