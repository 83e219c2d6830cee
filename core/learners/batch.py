"""Learning by ridge regression on all experience (Ernst, Geurts and Wehenkel 2005).

After every episode, and during long ones, the following is repeated several times: give every
stored after-state s a target, and find the weights that minimize the squared errors of f plus
``ridge`` times the squared weights. The targets of batch TD(lambda) are lambda-returns. They are
clipped to the range of discounted sums of the observed rewards, so that extrapolation cannot
diverge. Agents that share weights share the regression and pool their experience.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from ..numerics import AnyArray, FloatArray, IntArray, njit
from ..plugins.settings import Fraction, Positive
from ..values.rule_base import RuleBase
from .learner import Learner, LearnerSettings

TERMINAL, CUT_OFF, ABSENT = -1, -2, -3
"""Indices of the next after-state: the same state forever, unknown, or unknown because the agent
did not decide. Rewards of the last kind neither are learned from nor widen the range of targets."""
REWARD_SCALE = 100.0
"""Scale of rewards, which are of the order of 0.01, in the regression."""
MOST_RULES = 4096
"""Maximum number of rules of an agent: normal equations are solved densely."""
Function = Callable[[FloatArray], FloatArray]


class BatchTDSettings(LearnerSettings):
    """Batch TD(lambda): regression on all experience, with lambda-returns as targets."""

    kind: Literal["batch-td"] = "batch-td"
    factory: ClassVar[str] = f"{__name__}:BatchTD"
    ridge: Positive = 10.0
    """Penalty on squared weights, relative to squared errors of rewards scaled by 100. Increase it
    if values are jagged, decrease it if they are flat."""
    regression_iterations: Annotated[int, Field(ge=1, le=10_000)] = 30
    """Number of regressions per update, each with new targets."""
    target_averaging_rate: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Step from the old weights to those of the last regression. Below 1, the policy changes
    smoothly from episode to episode."""
    interval: Annotated[int, Field(ge=1)] = 100
    """Number of decisions between updates within an episode."""
    mirrored: bool = False
    """Whether to learn from the mirror image of every step, too."""
    trace_decay: Fraction = 0.0
    """Trace decay lambda: 0 bootstraps from the next state, 1 sums the rewards of an episode."""

    @property
    def is_mirrored(self) -> bool:
        """Whether to learn from the mirror image of every step, too."""
        return self.mirrored


def solver(gram: FloatArray) -> Function:
    """Return a function that solves ``gram theta = moment`` for theta; factor the matrix once."""
    from scipy.linalg import cho_factor
    from scipy.linalg.lapack import dpotrs  # `cho_solve` without its checks

    factor, lower = cho_factor(gram, check_finite=False)
    return lambda moment: dpotrs(factor, moment, lower)[0]


class BatchTD(Learner):
    """Batch TD(lambda): a memory of after-states, and regressions on all of them.

    Raises
    ------
    ValueError
        If the rule base is too large for a dense solution.
    """

    values_decisions: ClassVar[bool] = False
    """Whether it stores decisions, and not the states in which they are made."""

    def __init__(self, settings: Any, rules: RuleBase, rows: IntArray) -> None:
        if rules.n_rules > MOST_RULES:
            raise ValueError(
                f"learner.kind: batch learners solve for all rules at once: {rules.n_rules} rules, "
                f"allowed up to {MOST_RULES}; lower learner.rule_base.order"
            )
        self.settings = settings
        self.rules = rules
        self.rows = rows
        n_rows = int(rows.max()) + 1
        self.theta: FloatArray = np.zeros((n_rows, rules.n_rules))
        self._counts = np.bincount(rows).tolist()
        """Number of agents of every row."""
        empty = np.zeros(0, dtype=np.int64)
        self._experience: dict[str, list[AnyArray]] = {
            "rows": [empty],
            "states": [np.zeros((0, len(rules.partitions)))],
            "rewards": [np.zeros(0)],
            "follower": [empty],
            "durations": [empty],
        }
        """All after-states so far, step by step, in agent order: row, state, reward, index of the
        next after-state, and duration of each."""
        self._n_states = 0
        self._episode_start = 0  # index of the first after-state of the episode
        # By row, active rules and strengths of the after-states in the last regression, which
        # were these many of the arrays above.
        self._active: list[tuple[IntArray, FloatArray]] = []
        self._n_regressed = 0
        # By row, the ridge plus the sum of phi phi', and the number of after-states in it.
        self._summed: dict[int, tuple[FloatArray, int]] = {}

    def begin_episode(self) -> None:
        """Begin an episode, even if the last one was interrupted."""
        self._cut_off()
        self._episode_start = self._n_states

    def observe(
        self,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
        duration: int = 1,
    ) -> int:
        """Store an after-state; regress after every `interval` decisions."""
        n = len(states)
        if self._is_running and not self.values_decisions:
            self._experience["follower"][-1][-n:][self.idle] = ABSENT
        self._n_states += n
        follower = np.full(n, TERMINAL) if terminated else self._n_states + np.arange(n)
        if terminated or self.values_decisions:
            follower[self.idle] = ABSENT
        step = {
            "rows": self.rows,
            "states": states.copy(),
            "rewards": np.broadcast_to(np.asarray(reward, dtype=float), (n,)).copy(),
            "follower": follower,
            "durations": np.full(n, duration),
        }
        for name, array in step.items():
            self._experience[name].append(array)
        lasted = (self._n_states - self._episode_start) // n
        return 0 if terminated or lasted % self.settings.interval else self._regress()

    def end_episode(self) -> int:
        """Regress on all experience."""
        self._cut_off()
        return self._regress() if self._n_states else 0

    @property
    def _is_running(self) -> bool:
        """Whether the last after-state has no successor yet."""
        return bool((self._experience["follower"][-1] >= self._n_states).any())

    def _cut_off(self) -> None:
        last = self._experience["follower"][-1][-len(self.rows) :]
        last[last >= self._n_states] = CUT_OFF

    def _all(self, name: str, first: int = 0) -> AnyArray:
        """Return one array of all after-states, from a step on."""
        return np.concatenate(self._experience[name][first:])

    def _regress(self) -> int:
        """Update all weights; return their number."""
        self._extend()
        s = self.settings
        rewards_of_all, follower_of_all, places = self._outcomes()
        durations = self._all("durations")
        for row, (own, (taken, strengths)) in enumerate(zip(places, self._active, strict=True)):
            follower = follower_of_all[own]
            rewards = REWARD_SCALE * rewards_of_all[own]
            weights, values_of, solve = self._equations(row, (follower >= TERMINAL).astype(float))
            discounts = s.discount ** durations[own]
            present = follower != ABSENT
            limits = range_of_returns(rewards[present], s.discount, discounts[present])
            theta = self.theta[row].astype(float) * REWARD_SCALE
            paid = rewards, follower, discounts, weights
            constants = s.discount, s.trace_decay, *limits
            for _ in range(s.regression_iterations):
                theta = solve(aim(values_of(theta), paid, constants, taken, strengths, theta.size))
            change = theta / REWARD_SCALE - self.theta[row]
            self.theta[row] += s.target_averaging_rate * change
        return self.theta.size

    def _equations(self, row: int, known: FloatArray) -> tuple[FloatArray, Function, Function]:
        """Return weights ``(N,)`` of after-states, and functions for their values and for theta.

        Parameters
        ----------
        row
            Row of weights.
        known
            ``(N,)`` 1 for after-states with a known successor, 0 for others.
        """
        active, strengths = self._active[row]
        k = self.rules.n_rules
        gram, begin = self._summed.get(row, (self.settings.ridge * np.eye(k), 0))
        # The last after-state is added once its successor is known.
        end = len(known) - self._is_running * self._counts[row]
        add_gram(gram, active[begin:end], strengths[begin:end], known[begin:end])
        self._summed[row] = gram, end
        return known, lambda theta: row_values(theta, active, strengths), solver(gram)

    def _extend(self) -> None:
        """Find the active rules of after-states that are new since the last regression."""
        n_steps = len(self._experience["states"])
        if self._n_regressed == n_steps:
            return
        states = self._all("states", self._n_regressed)
        places = self._places(self._all("rows", self._n_regressed))
        active = [self._active_of(states[own]) for own in places]
        if self._active:
            active = [
                (np.concatenate([old[0], new[0]]), np.concatenate([old[1], new[1]]))
                for old, new in zip(self._active, active, strict=True)
            ]
        self._active = active
        self._n_regressed = n_steps

    def _places(self, rows: IntArray) -> list[IntArray]:
        """Return the indices of every row among the rows of after-states."""
        counts = np.bincount(rows, minlength=len(self.theta))
        return np.split(np.argsort(rows, kind="stable"), np.cumsum(counts)[:-1])

    def _active_of(self, states: FloatArray) -> tuple[IntArray, FloatArray]:
        return self.rules.active(states)

    def _outcomes(self) -> tuple[FloatArray, IntArray, list[IntArray]]:
        """Return rewards and next after-states of all, and the indices of each row among them.

        Next after-states are counted within their row.
        """
        follower = self._all("follower")
        follower[follower >= self._n_states] = CUT_OFF  # the episode continues
        places = self._places(self._all("rows"))
        place = np.empty(self._n_states, dtype=np.int64)
        for own in places:
            place[own] = np.arange(len(own))
        is_known = follower >= 0
        follower[is_known] = place[follower[is_known]]
        return self._all("rewards"), follower, places

    def states_of(self, row: int) -> FloatArray:
        """Return the after-states ``(m, d)`` of a row."""
        return self._all("states")[self._all("rows") == row]

    def state_dict(self) -> dict[str, FloatArray]:
        """Return weights and all experience."""
        return {"theta": self.theta} | {name: self._all(name) for name in self._experience}

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        self.theta = state["theta"].copy()
        for name, steps in self._experience.items():
            self._experience[name] = [np.array(state[name], steps[0].dtype)]
        self._n_states = len(state["states"])
        self._episode_start = 1 + int(np.append(-1, np.flatnonzero(state["follower"] < 0)).max())
        self._active = []
        self._n_regressed = 0
        self._summed = {}

    def warm_start(self, former: Self, rows: IntArray) -> None:
        """Start from weights and experience of another team, between its episodes."""
        renamed = np.empty_like(rows)
        renamed[rows] = np.arange(len(rows))
        BatchTD.load_state_dict(self, former.state_dict())
        self.theta = former.theta[rows]
        self._experience["rows"] = [renamed[self._all("rows")]]


def range_of_returns(
    rewards: FloatArray, discount: float, discounts: FloatArray
) -> tuple[float, float]:
    """Return the range of sums of rewards that repeat forever: one a decision, or one an option."""
    sums = np.append(rewards / (1.0 - discount), rewards / (1.0 - discounts))
    return (float(sums.min()), float(sums.max())) if sums.size else (0.0, 0.0)


@njit(cache=True)
def add_gram(
    gram: FloatArray, active: IntArray, strengths: FloatArray, weights: FloatArray
) -> None:
    """Add the weighted phi phi' of every after-state to `gram`."""
    for s in range(len(active)):
        for a in range(active.shape[1]):
            weighted = weights[s] * strengths[s, a]
            if weighted > 0.0:
                for b in range(active.shape[1]):
                    gram[active[s, a], active[s, b]] += weighted * strengths[s, b]


# Unsigned numbers of rules are not looked at for being negative.


@njit(cache=True)
def row_values(theta: FloatArray, active: IntArray, strengths: FloatArray) -> FloatArray:
    """Return f ``(N,)`` of all rows."""
    values = np.empty(len(active))
    for s in range(len(active)):
        value = 0.0
        for a in range(active.shape[1]):
            value += strengths[s, a] * theta[np.uint64(active[s, a])]
        values[s] = value
    return values


@njit(cache=True)
def aim(
    values: FloatArray,
    outcomes: tuple[FloatArray, IntArray, FloatArray, FloatArray],
    constants: tuple[float, float, float, float],
    active: IntArray,
    strengths: FloatArray,
    n_rules: int,
) -> FloatArray:
    """Return the sum of phi times weighted target ``(n_rules,)`` over all rows.

    Parameters
    ----------
    values
        ``(N,)`` f of all rows.
    outcomes
        Rewards, next rows, discounts of what follows, and weights of all rows, ``(N,)`` each.
    constants
        Discount, trace decay, and the range that targets are clipped to.
    active, strengths
        ``(N, k)`` the active rules of all rows.
    n_rules
        Number of rules.
    """
    rewards, follower, discounts, weights = outcomes
    discount, decay, low, high = constants
    returns = lambda_returns(values, rewards, follower, discounts, discount, decay)
    moment = np.zeros(n_rules)
    for s in range(len(active)):
        target = returns[s]
        if target < low:
            target = low
        elif target > high:
            target = high
        target *= weights[s]
        for a in range(active.shape[1]):
            moment[np.uint64(active[s, a])] += strengths[s, a] * target
    return moment


@njit(cache=True)
def lambda_returns(
    values: FloatArray,
    rewards: FloatArray,
    follower: IntArray,
    discounts: FloatArray,
    discount: float,
    decay: float,
) -> FloatArray:
    """Return the lambda-return of every row, by recursion from the end of each episode.

    ``G(s) = R(s) + gamma^k ((1 - lambda) f(s') + lambda G(s'))``, where `discounts` are gamma^k.
    """
    returns = np.empty(len(values))
    for s in range(len(values) - 1, -1, -1):
        if follower[s] == TERMINAL:
            returns[s] = rewards[s] / (1.0 - discount)
        elif follower[s] < 0:
            returns[s] = values[s]
        else:
            after = follower[s]
            ahead = (1.0 - decay) * values[after] + decay * returns[after]
            returns[s] = rewards[s] + discounts[s] * ahead
    return returns
