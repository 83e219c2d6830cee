"""Learning by ridge regression on all experience (Ernst, Geurts and Wehenkel 2005).

After every episode, and during long ones, the following is repeated several times: give every
stored after-state s a target, and find the weights that minimize the squared errors of f plus
``ridge`` times the squared weights. The targets of batch TD(lambda) are lambda-returns. They are
clipped to the range of discounted sums of the observed rewards, so that extrapolation cannot
diverge. Agents that share weights share the regression and pool their experience.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field

from ..numerics import FloatArray, IntArray, njit
from ..plugins.settings import Fraction, Positive
from ..values.rule_base import RuleBase
from .learner import Learner, LearnerSettings

TERMINAL, CUT_OFF = -1, -2
"""Indices of the next after-state: the same state forever, or unknown."""
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


class Earlier(NamedTuple):
    """After-states of a row from another team."""

    states: FloatArray
    """``(m, d)``."""
    rewards: FloatArray
    """``(m,)`` rewards."""
    follower: IntArray
    """``(m,)`` index of the next after-state among them, `TERMINAL` or `CUT_OFF`."""
    durations: IntArray
    """``(m,)`` number of decision periods between an after-state and the next."""


class BatchTD(Learner):
    """Batch TD(lambda): a memory of after-states, and regressions on all of them.

    Raises
    ------
    ValueError
        If the rule base is too large for a dense solution.
    """

    def __init__(self, settings: Any, rules: RuleBase, rows: IntArray) -> None:
        if rules.n_rules > MOST_RULES:
            raise ValueError(
                f"learner.kind: batch learners solve for all rules at once: {rules.n_rules} rules, "
                f"allowed up to {MOST_RULES}; lower learner.rule_base.order"
            )
        self.settings, self.rules, self._n_agents = settings, rules, len(rows)
        self.members = [np.flatnonzero(rows == row) for row in range(int(rows.max()) + 1)]
        """The agents ``(k,)`` of every row."""
        self.theta: FloatArray = np.zeros((len(self.members), rules.n_rules), rules.dtype)
        d = len(rules.partitions)
        nothing = Earlier(np.zeros((0, d)), np.zeros(0), *np.zeros((2, 0), dtype=np.int64))
        self._earlier = [nothing] * len(self.members)
        self._states: list[FloatArray] = []
        self._rewards: list[FloatArray] = []
        self._follower: list[int] = []
        self._durations: list[int] = []
        self._episode_start = 0  # index of the first after-state of the episode
        # By row, active rules and strengths of the after-states in the last regression.
        self._active: list[tuple[IntArray, FloatArray]] = []
        self._regressed = 0
        # By row, the ridge plus the sum of phi phi', and the number of after-states in it.
        self._summed: dict[int, tuple[FloatArray, int]] = {}

    def begin_episode(self) -> None:
        """Begin an episode, even if the last one was interrupted."""
        self._cut_off()
        self._episode_start = len(self._states)

    def observe(
        self,
        states: FloatArray,
        reward: float | FloatArray,
        terminated: bool,
        duration: int = 1,
    ) -> int:
        """Store an after-state; regress after every `interval` decisions."""
        self._durations.append(duration)
        self._states.append(states.copy())
        self._rewards.append(np.broadcast_to(np.asarray(reward, dtype=float), (len(states),)))
        self._follower.append(TERMINAL if terminated else len(self._states))
        lasted = len(self._states) - self._episode_start
        return 0 if terminated or lasted % self.settings.interval else self._regress()

    def end_episode(self) -> int:
        """Regress on all experience."""
        self._cut_off()
        return self._regress() if self._states else 0

    def _cut_off(self) -> None:
        if self._follower and self._follower[-1] == len(self._states):
            self._follower[-1] = CUT_OFF

    def _regress(self) -> int:
        """Update all weights; return their number."""
        self._extend()
        s = self.settings
        outcomes = self._outcomes()
        for row, (taken, strengths) in enumerate(self._active):
            rewards, follower, durations = outcomes[row]
            rewards = REWARD_SCALE * rewards
            weights, values_of, solve = self._equations(row, (follower != CUT_OFF).astype(float))
            low, high = np.array([rewards.min(), rewards.max()]) / (1.0 - s.discount)
            theta = self.theta[row].astype(float) * REWARD_SCALE
            paid = rewards, follower, s.discount**durations, weights
            constants = s.discount, s.trace_decay, low, high
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
        end = len(known) if known[-1] else len(known) - len(self.members[row])
        add_gram(gram, active[begin:end], strengths[begin:end], known[begin:end])
        self._summed[row] = gram, end
        return known, lambda theta: row_values(theta, active, strengths), solver(gram)

    def _extend(self) -> None:
        """Find the active rules of after-states that are new since the last regression."""
        if self._regressed == len(self._states):
            return
        rows = range(len(self.theta))
        active = [self._active_of(self.states_of(row, self._regressed)) for row in rows]
        if self._active:
            active = [
                (np.concatenate([old[0], new[0]]), np.concatenate([old[1], new[1]]))
                for old, new in zip(self._active, active, strict=True)
            ]
        self._active, self._regressed = active, len(self._states)

    def _active_of(self, states: FloatArray) -> tuple[IntArray, FloatArray]:
        return self.rules.active(states)

    def _outcomes(self) -> list[tuple[FloatArray, IntArray, IntArray]]:
        """Return rewards, successors and durations of all after-states by row, earlier ones first.

        With k agents, after-state ``s * k + j`` is that of agent j after step s.
        """
        steps = np.array(self._follower, dtype=np.int64)[:, None]
        steps[steps == len(steps)] = CUT_OFF  # the episode continues
        paid = np.array(self._rewards).reshape(-1, self._n_agents)
        outcomes = []
        for earlier, members in zip(self._earlier, self.members, strict=True):
            k, before = len(members), len(earlier.states)
            follower = np.where(steps < 0, steps, before + steps * k + np.arange(k)).ravel()
            rewards = np.append(earlier.rewards, paid[:, members].ravel())
            durations = np.append(earlier.durations, np.repeat(self._durations, k))
            outcomes.append((rewards, np.append(earlier.follower, follower), durations))
        return outcomes

    def states_of(self, row: int, since: int = 0) -> FloatArray:
        """Return the after-states ``(m, d)`` of a row, or those of this team since a step."""
        d = len(self.rules.partitions)
        new = np.array(self._states[since:]).reshape(-1, self._n_agents, d)
        own = new[:, self.members[row]].reshape(-1, d)
        return own if since else np.concatenate([self._earlier[row].states, own])

    def state_dict(self) -> dict[str, FloatArray]:
        """Return weights and all experience."""
        n, d = self._n_agents, len(self.rules.partitions)
        held = [len(earlier.states) for earlier in self._earlier]
        return {
            "theta": self.theta,
            "states": np.array(self._states).reshape(-1, n, d),
            "rewards": np.array(self._rewards).reshape(-1, n),
            "follower": np.array(self._follower, dtype=np.int64),
            "durations": np.array(self._durations, dtype=np.int64),
            "earlier_rows": np.repeat(np.arange(len(held)), held),
            "earlier_states": np.concatenate([e.states for e in self._earlier]),
            "earlier_rewards": np.concatenate([e.rewards for e in self._earlier]),
            "earlier_follower": np.concatenate([e.follower for e in self._earlier]),
            "earlier_durations": np.concatenate([e.durations for e in self._earlier]),
        }

    def load_state_dict(self, state: Mapping[str, FloatArray]) -> None:
        """Continue from a `state_dict`."""
        self.theta = state["theta"].copy()
        self._states = list(state["states"])
        self._rewards = list(state["rewards"])
        self._follower = [int(f) for f in state["follower"]]
        self._durations = [int(k) for k in state["durations"]]
        ended = [s for s, f in enumerate(self._follower) if f in (TERMINAL, CUT_OFF)]
        self._episode_start = ended[-1] + 1 if ended else 0
        rows = state["earlier_rows"]
        self._earlier = [
            Earlier(*(state[f"earlier_{name}"][rows == row] for name in Earlier._fields))
            for row in range(len(self.theta))
        ]
        self._active, self._regressed, self._summed = [], 0, {}

    def warm_start(self, former: Self, rows: IntArray) -> None:
        """Start from weights and experience of another team, between its episodes."""
        self.theta = former.theta[rows]
        outcomes = former._outcomes()
        self._earlier = [Earlier(former.states_of(row), *outcomes[row]) for row in rows]


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
        elif follower[s] == CUT_OFF:
            returns[s] = values[s]
        else:
            after = follower[s]
            ahead = (1.0 - decay) * values[after] + decay * returns[after]
            returns[s] = rewards[s] + discounts[s] * ahead
    return returns
