"""Learning by ridge regression on all experience (Ernst, Geurts and Wehenkel 2005).

After every episode, and during long ones, several times over: give every after-state s in memory a
target, and find the weights that minimise the squared errors of f plus ``ridge`` times the squared
weights. Batch TD(lambda) aims at the lambda-return of what followed. Targets are clipped to the
range that discounted sums of the rewards seen so far can reach: no extrapolation can run away.
Agents that share weights share the regression: the experience of all of them is pooled.
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
"""In place of the index of the next after-state: it is entered for ever; it is not known."""
REWARD_SCALE = 100.0
"""Rewards are of the order of 0.01; the ridge weighs against rewards times this."""
MOST_RULES = 4096
"""Of one agent: more make normal equations that take too long to be solved densely."""
Function = Callable[[FloatArray], FloatArray]


class BatchTDSettings(LearnerSettings):
    """Batch TD(lambda): towards what followed, regressing on all experience."""

    kind: Literal["batch-td"] = "batch-td"
    factory: ClassVar[str] = f"{__name__}:BatchTD"
    ridge: Positive = 10.0
    """Weight of the squared consequents against squared errors of rewards scaled by 100: larger, if
    values are jagged; smaller, if they are flat."""
    regression_iterations: Annotated[int, Field(ge=1, le=10_000)] = 30
    """Regressions on freshly discounted targets each time."""
    target_averaging_rate: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Share of the way that the weights go towards the last regression's: below 1 the policy does
    not jump from episode to episode."""
    interval: Annotated[int, Field(ge=1)] = 100
    """Decisions of an episode after which is regressed without waiting for its end."""
    mirrored: bool = False
    """Whether what the mirror image of the team would have met is experience as well."""
    trace_decay: Fraction = 0.0
    """Trace decay lambda: 0 bootstraps from the next state, 1 sums the rewards of an episode."""

    @property
    def is_mirrored(self) -> bool:
        """Whether what the mirror image of the team would have met is experience as well."""
        return self.mirrored


def solver(gram: FloatArray) -> Function:
    """Return what solves ``gram theta = moment`` for theta, the matrix being factored once."""
    from scipy.linalg import cho_factor
    from scipy.linalg.lapack import dpotrs  # `cho_solve` without what that does around it

    factor, lower = cho_factor(gram, check_finite=False)
    return lambda moment: dpotrs(factor, moment, lower)[0]


class Earlier(NamedTuple):
    """After-states of a row that agents of another team met."""

    states: FloatArray
    """``(m, d)``."""
    rewards: FloatArray
    """``(m,)``, as they were received."""
    follower: IntArray
    """``(m,)`` index of the next after-state among them, `TERMINAL` or `CUT_OFF`."""


class BatchTD(Learner):
    """Batch TD(lambda): a memory of after-states, and regressions on all of them.

    Raises
    ------
    ValueError
        If the rule base is too large for its normal equations to be solved densely.
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
        nothing = Earlier(np.zeros((0, d)), np.zeros(0), np.zeros(0, dtype=np.int64))
        self._earlier = [nothing] * len(self.members)
        self._states: list[FloatArray] = []
        self._rewards: list[FloatArray] = []
        self._follower: list[int] = []
        self._begun = 0  # the first after-state of the running episode
        # By row, active rules and strengths of the after-states so far regressed on.
        self._active: list[tuple[IntArray, FloatArray]] = []
        self._regressed = 0
        # By row, the ridge and the sum of phi phi' over so many of these.
        self._summed: dict[int, tuple[FloatArray, int]] = {}

    def begin_episode(self) -> None:
        """Note that the first after-state follows none, even if the last episode was given up."""
        self._cut_off()
        self._begun = len(self._states)

    def observe(self, states: FloatArray, reward: float | FloatArray, terminated: bool) -> int:
        """Remember an after-state; regress if the episode has gone on for long enough."""
        self._states.append(states.copy())
        self._rewards.append(np.broadcast_to(np.asarray(reward, dtype=float), (len(states),)))
        self._follower.append(TERMINAL if terminated else len(self._states))
        lasted = len(self._states) - self._begun
        return 0 if terminated or lasted % self.settings.interval else self._regress()

    def end_episode(self) -> int:
        """Regress on all experience."""
        self._cut_off()
        return self._regress() if self._states else 0

    def _cut_off(self) -> None:
        if self._follower and self._follower[-1] == len(self._states):
            self._follower[-1] = CUT_OFF

    def _regress(self) -> int:
        """Return how many weights have changed: all of them."""
        self._extend()
        s = self.settings
        outcomes = self._outcomes()
        for row, (taken, strengths) in enumerate(self._active):
            rewards, follower = outcomes[row]
            rewards = REWARD_SCALE * rewards
            weights, values_of, solve = self._equations(row, (follower != CUT_OFF).astype(float))
            low, high = np.array([rewards.min(), rewards.max()]) / (1.0 - s.discount)
            theta = self.theta[row].astype(float) * REWARD_SCALE
            paid = rewards, follower, weights
            constants = s.discount, s.trace_decay, low, high
            for _ in range(s.regression_iterations):
                theta = solve(aim(values_of(theta), paid, constants, taken, strengths, theta.size))
            change = theta / REWARD_SCALE - self.theta[row]
            self.theta[row] += s.target_averaging_rate * change
        return self.theta.size

    def _equations(self, row: int, known: FloatArray) -> tuple[FloatArray, Function, Function]:
        """Return the weights ``(N,)`` of after-states, and how their values and theta follow.

        Parameters
        ----------
        row
            Whose.
        known
            ``(N,)`` 1 for after-states of which it is known what followed, 0 for others.
        """
        active, strengths = self._active[row]
        k = self.rules.n_rules
        gram, begin = self._summed.get(row, (self.settings.ridge * np.eye(k), 0))
        # The last is added once it is known what followed.
        end = len(known) if known[-1] else len(known) - len(self.members[row])
        add_gram(gram, active[begin:end], strengths[begin:end], known[begin:end])
        self._summed[row] = gram, end
        return known, lambda theta: row_values(theta, active, strengths), solver(gram)

    def _extend(self) -> None:
        """Find the active rules of the after-states that are new since the last regression."""
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

    def _outcomes(self) -> list[tuple[FloatArray, IntArray]]:
        """Return rewards and followers of all after-states by row, the earlier ones first.

        Of k agents and N steps, after-state ``s * k + j`` is that of agent j after step s.
        """
        steps = np.array(self._follower, dtype=np.int64)[:, None]
        steps[steps == len(steps)] = CUT_OFF  # of a running episode: not known yet
        paid = np.array(self._rewards).reshape(-1, self._n_agents)
        outcomes = []
        for earlier, members in zip(self._earlier, self.members, strict=True):
            k, before = len(members), len(earlier.states)
            follower = np.where(steps < 0, steps, before + steps * k + np.arange(k)).ravel()
            rewards = np.append(earlier.rewards, paid[:, members].ravel())
            outcomes.append((rewards, np.append(earlier.follower, follower)))
        return outcomes

    def states_of(self, row: int, since: int = 0) -> FloatArray:
        """Return the after-states ``(m, d)`` of a row, those since a step of this team alone."""
        d = len(self.rules.partitions)
        new = np.array(self._states[since:]).reshape(-1, self._n_agents, d)
        own = new[:, self.members[row]].reshape(-1, d)
        return own if since else np.concatenate([self._earlier[row].states, own])

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights and all experience."""
        n, d = self._n_agents, len(self.rules.partitions)
        held = [len(earlier.states) for earlier in self._earlier]
        return {
            "theta": self.theta,
            "states": np.array(self._states).reshape(-1, n, d),
            "rewards": np.array(self._rewards).reshape(-1, n),
            "follower": np.array(self._follower, dtype=np.int64),
            "earlier_rows": np.repeat(np.arange(len(held)), held),
            "earlier_states": np.concatenate([e.states for e in self._earlier]),
            "earlier_rewards": np.concatenate([e.rewards for e in self._earlier]),
            "earlier_follower": np.concatenate([e.follower for e in self._earlier]),
        }

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.theta = arrays["theta"].copy()
        self._states = list(arrays["states"])
        self._rewards = list(arrays["rewards"])
        self._follower = [int(f) for f in arrays["follower"]]
        ended = [s for s, f in enumerate(self._follower) if f in (TERMINAL, CUT_OFF)]
        self._begun = ended[-1] + 1 if ended else 0
        rows = arrays["earlier_rows"]
        self._earlier = [
            Earlier(*(arrays[f"earlier_{name}"][rows == row] for name in Earlier._fields))
            for row in range(len(self.theta))
        ]
        self._active, self._regressed, self._summed = [], 0, {}

    def continue_from(self, former: Self, rows: IntArray) -> None:
        """Begin with weights and experience of another team, of which no episode is under way."""
        self.theta = former.theta[rows]
        outcomes = former._outcomes()
        self._earlier = [Earlier(former.states_of(row), *outcomes[row]) for row in rows]


@njit(cache=True)
def add_gram(
    gram: FloatArray, active: IntArray, strengths: FloatArray, weights: FloatArray
) -> None:
    """Add the weighted phi phi' of every row to `gram`."""
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
    paid: tuple[FloatArray, IntArray, FloatArray],
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
    paid
        Rewards, followers and weights of all rows, ``(N,)`` each.
    constants
        Discount, trace decay, and the range that targets are clipped to.
    active, strengths
        ``(N, k)`` the active rules of all rows.
    n_rules
        How many rules there are.
    """
    rewards, follower, weights = paid
    discount, decay, low, high = constants
    returns = lambda_returns(values, rewards, follower, discount, decay)
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
    values: FloatArray, rewards: FloatArray, follower: IntArray, discount: float, decay: float
) -> FloatArray:
    """Return the lambda-return of every row, by recursion from the end of each episode.

    ``G(s) = R(s) + gamma ((1 - lambda) f(s') + lambda G(s'))``
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
            returns[s] = rewards[s] + discount * ahead
    return returns
