"""Learning by ridge regression on all experience (Ernst, Geurts and Wehenkel 2005).

After every episode, and during long ones, several times over: give every after-state s in memory a
target, and find the weights that minimise the squared errors of f plus ``ridge`` times the squared
weights. Batch TD(lambda) aims at the lambda-return of what followed; fitted value iteration (the
value iteration of Section VII) at ``R(s) + gamma max_a f(s_a)`` over predicted next states s_a, so
that experience under exploration teaches the value of acting well. Targets are clipped to the range
that discounted sums of the rewards seen so far can reach: no extrapolation can run away.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg import cho_factor, cho_solve

from ..arrays import FloatArray, IntArray
from ..rules.rule_base import RuleBase
from ..settings import BatchTDSettings, FittedValueSettings, ReplaySettings

REWARD_SCALE = 100.0
"""Rewards are of the order of 0.01; the ridge weighs against rewards times this."""

TERMINAL, CUT_OFF = -1, -2
"""In place of the index of the next after-state: it is entered for ever; it is not known."""


class Experience(NamedTuple):
    """All after-states in memory, as a regression needs them; rewards are scaled."""

    rewards: FloatArray
    follower: IntArray
    """Index of the next after-state, `TERMINAL` or `CUT_OFF`."""
    known: FloatArray
    """1 where what follows is known, else 0."""
    low: float
    """Least discounted sum of rewards that could be."""
    high: float
    """Greatest one."""


class Replay(ABC):
    """What the batch learners share: a memory of after-states, and the regression.

    Raises
    ------
    ValueError
        If the rule base is too large for its normal equations to be solved densely.
    """

    candidates = 0
    largest = 4096
    remedy = "lower learner.rule_base.order"

    def __init__(self, settings: ReplaySettings, rules: RuleBase, n_agents: int) -> None:
        if rules.n_rules > self.largest:
            raise ValueError(
                f"learner.kind: batch learners solve for all rules at once: {rules.n_rules} rules, "
                f"allowed up to {self.largest}; {self.remedy}"
            )
        self.settings, self.rules = settings, rules
        self.theta: FloatArray = np.zeros((n_agents, rules.n_rules), rules.dtype)
        self._states: list[FloatArray] = []
        self._rewards: list[float] = []
        self._follower: list[int] = []
        self._begun = 0  # the first after-state of the running episode
        # Active rules and strengths of the after-states so far regressed on, per agent.
        self._rows: list[tuple[IntArray, FloatArray]] = []

    def begin_episode(self) -> None:
        """Note that the first after-state follows none, even if the last episode was given up."""
        self._cut_off()
        self._begun = len(self._states)

    def observe(
        self,
        states: FloatArray,
        reward: float,
        terminated: bool,
        candidates: FloatArray | None = None,
    ) -> int:
        """Remember an after-state; regress if the episode has gone on for long enough."""
        self._states.append(states.copy())
        self._rewards.append(reward)
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
        self._extend()
        rewards, follower, known, low, high = self._experience()
        for i, (active, strengths) in enumerate(self._rows):
            gram = self.settings.ridge * np.eye(self.rules.n_rules)
            _add_gram(gram, active, strengths, known)
            factor = cho_factor(gram, check_finite=False)
            theta = self.theta[i].astype(float) * REWARD_SCALE
            for _ in range(self.settings.sweeps):
                targets = known * np.clip(self._targets(i, theta, rewards, follower), low, high)
                moment = _moment(active, strengths, targets, self.rules.n_rules)
                theta = cho_solve(factor, moment, check_finite=False)
            self.theta[i] += self.settings.mixing * (theta / REWARD_SCALE - self.theta[i])
        return self.theta.size

    def _experience(self) -> Experience:
        rewards = REWARD_SCALE * np.array(self._rewards)
        follower = np.array(self._follower)
        follower[follower == len(follower)] = CUT_OFF  # of a running episode: not known yet
        known = (follower != CUT_OFF).astype(float)
        gamma = self.settings.discount
        low, high = rewards.min() / (1.0 - gamma), rewards.max() / (1.0 - gamma)
        return Experience(rewards, follower, known, low, high)

    @abstractmethod
    def _targets(
        self, agent: int, theta: FloatArray, rewards: FloatArray, follower: IntArray
    ) -> FloatArray:
        """Return the targets ``(N,)`` of all after-states; arbitrary where cut off."""

    def _extend(self) -> None:
        """Find the active rules of the after-states that are new since the last regression."""
        done = len(self._rows[0][0]) if self._rows else 0
        new = np.array(self._states[done:])
        if not len(new):
            return
        rows = [self.rules.active(new[:, i]) for i in range(len(self.theta))]
        if self._rows:
            rows = [
                (np.concatenate([old[0], row[0]]), np.concatenate([old[1], row[1]]))
                for old, row in zip(self._rows, rows, strict=True)
            ]
        self._rows = rows

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights and all experience."""
        n, d = len(self.theta), len(self.rules.partitions)
        return {
            "theta": self.theta,
            "states": np.array(self._states).reshape(-1, n, d),
            "rewards": np.array(self._rewards),
            "follower": np.array(self._follower, dtype=np.int64),
        }

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.theta = arrays["theta"].copy()
        self._states = list(arrays["states"])
        self._rewards = [float(r) for r in arrays["rewards"]]
        self._follower = [int(f) for f in arrays["follower"]]
        ended = [s for s, f in enumerate(self._follower) if f in (TERMINAL, CUT_OFF)]
        self._begun = ended[-1] + 1 if ended else 0
        self._rows = []


class BatchTD(Replay):
    """Batch TD(lambda)."""

    def __init__(self, settings: BatchTDSettings, rules: RuleBase, n_agents: int) -> None:
        super().__init__(settings, rules, n_agents)
        self._decay = settings.trace_decay

    def _targets(
        self, agent: int, theta: FloatArray, rewards: FloatArray, follower: IntArray
    ) -> FloatArray:
        """Return the lambda-returns ``(N,)`` of all after-states; arbitrary where cut off."""
        values = _row_values(theta, *self._rows[agent])
        return _lambda_returns(values, rewards, follower, self.settings.discount, self._decay)


class FittedValue(Replay):
    """Fitted value iteration over predicted next states."""

    def __init__(self, settings: FittedValueSettings, rules: RuleBase, n_agents: int) -> None:
        super().__init__(settings, rules, n_agents)
        self.candidates = settings.candidates
        self._candidates: list[FloatArray] = []
        self._nexts: FloatArray = np.zeros((n_agents, 0, self.candidates, 0))

    def _regress(self) -> int:
        self._nexts = np.stack(self._candidates, axis=1).astype(float)
        return super()._regress()

    def observe(
        self,
        states: FloatArray,
        reward: float,
        terminated: bool,
        candidates: FloatArray | None = None,
    ) -> int:
        """Remember an after-state and the predicted next states ``(n, m, d)``."""
        if candidates is None:
            raise ValueError("fitted value iteration needs predicted next states")
        self._candidates.append(candidates.astype(np.float32))
        return super().observe(states, reward, terminated)

    def _targets(
        self, agent: int, theta: FloatArray, rewards: FloatArray, follower: IntArray
    ) -> FloatArray:
        """Return R plus the discounted best predicted value ``(N,)``."""
        nexts = self._nexts[agent]
        values = self.rules.values(theta, nexts.reshape(-1, nexts.shape[2]))
        best = values.reshape(nexts.shape[:2]).max(axis=1)
        gamma = self.settings.discount
        return np.where(follower == TERMINAL, rewards / (1.0 - gamma), rewards + gamma * best)

    def arrays(self) -> dict[str, FloatArray]:
        """Return what batch TD returns, and the predicted next states."""
        return {**super().arrays(), "candidates": np.array(self._candidates)}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        super().restore(arrays)
        self._candidates = list(arrays["candidates"])


@njit(cache=True)
def _add_gram(
    gram: FloatArray, active: IntArray, strengths: FloatArray, weights: FloatArray
) -> None:
    """Add the weighted phi phi' of every row to `gram`."""
    for s in range(len(active)):
        for a in range(active.shape[1]):
            weighted = weights[s] * strengths[s, a]
            if weighted > 0.0:
                for b in range(active.shape[1]):
                    gram[active[s, a], active[s, b]] += weighted * strengths[s, b]


@njit(cache=True)
def _row_values(theta: FloatArray, active: IntArray, strengths: FloatArray) -> FloatArray:
    """Return f ``(N,)`` of all rows."""
    values = np.zeros(len(active))
    for s in range(len(active)):
        for a in range(active.shape[1]):
            values[s] += strengths[s, a] * theta[active[s, a]]
    return values


@njit(cache=True)
def _moment(
    active: IntArray, strengths: FloatArray, targets: FloatArray, n_rules: int
) -> FloatArray:
    """Return the sum of phi times target over all rows."""
    moment = np.zeros(n_rules)
    for s in range(len(active)):
        for a in range(active.shape[1]):
            moment[active[s, a]] += strengths[s, a] * targets[s]
    return moment


@njit(cache=True)
def _lambda_returns(
    values: FloatArray, rewards: FloatArray, follower: IntArray, discount: float, decay: float
) -> FloatArray:
    """Return the lambda-return of every row, by recursion from the end of each episode.

    ``G(s) = R(s) + gamma ((1 - lambda) f(s') + lambda G(s'))``
    """
    returns = np.empty(len(values))
    for s in range(len(values) - 1, -1, -1):
        if follower[s] == -1:  # TERMINAL
            returns[s] = rewards[s] / (1.0 - discount)
        elif follower[s] == -2:  # CUT_OFF
            returns[s] = values[s]
        else:
            after = follower[s]
            ahead = (1.0 - decay) * values[after] + decay * returns[after]
            returns[s] = rewards[s] + discount * ahead
    return returns
