"""Batch TD(0) by ridge regression on all experience (fitted policy evaluation, Ernst et al. 2005).

After every episode, several times over: give every after-state s in memory the target
``R(s) + gamma f(s')``, and find the weights that minimise the squared errors of f plus ``ridge``
times the squared weights. Targets are clipped to the range that discounted sums of the rewards
seen so far can reach, so that no extrapolation can run away.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit
from scipy.linalg import cho_factor, cho_solve

from ..arrays import FloatArray, IntArray
from ..config import BatchTDSettings
from ..rules import RuleBase

REWARD_SCALE = 100.0
"""Rewards are of the order of 0.01; the ridge weighs against rewards times this."""


class BatchTD:
    """Replays all experience after every episode.

    Raises
    ------
    ValueError
        If the rule base is too large for its normal equations to be solved densely.
    """

    largest = 4096

    def __init__(self, settings: BatchTDSettings, rules: RuleBase, n_agents: int) -> None:
        if rules.n_rules > self.largest:
            raise ValueError(
                f"learner.kind = 'batch-td' solves for all rules at once: {rules.n_rules} rules, "
                f"allowed up to {self.largest}; lower learner.rule_base.order"
            )
        self.settings, self.rules = settings, rules
        self.theta: FloatArray = np.zeros((n_agents, rules.n_rules))
        self._gram: FloatArray = np.zeros((n_agents, rules.n_rules, rules.n_rules))
        # Experience of finished episodes; `follower` is the index of the next after-state, -1
        # behind a terminal one, -2 where the episode was cut off.
        self._states: list[FloatArray] = []
        self._rewards: list[float] = []
        self._follower: list[int] = []
        self._regressed = 0
        self._rows: list[tuple[IntArray, FloatArray]] = []

    def begin_episode(self) -> None:
        """Remember nothing more: the first after-state of an episode follows none."""

    def observe(self, states: FloatArray, reward: float, terminated: bool) -> int:
        """Remember an after-state."""
        self._states.append(states.copy())
        self._rewards.append(reward)
        self._follower.append(-1 if terminated else len(self._states))
        return 0

    def end_episode(self) -> int:
        """Regress on all experience."""
        if not self._states:
            return 0
        if self._follower[-1] == len(self._states):
            self._follower[-1] = -2
        self._extend()
        rewards = REWARD_SCALE * np.array(self._rewards)
        follower = np.array(self._follower)
        gamma, n_rules = self.settings.discount, self.rules.n_rules
        low, high = rewards.min() / (1.0 - gamma), rewards.max() / (1.0 - gamma)
        for i, (active, strengths) in enumerate(self._rows):
            factor = cho_factor(self._gram[i] + self.settings.ridge * np.eye(n_rules))
            theta = self.theta[i] * REWARD_SCALE
            for _ in range(self.settings.sweeps):
                moment = _moment(theta, active, strengths, rewards, follower, gamma, low, high)
                theta = cho_solve(factor, moment, check_finite=False)
            self.theta[i] = theta / REWARD_SCALE
        return self.theta.size

    def _extend(self) -> None:
        """Take the newest episode into active rules and Gram matrices."""
        new = np.array(self._states[self._regressed :])
        usable = np.array(self._follower[self._regressed :]) != -2
        for i in range(len(self.theta)):
            active, strengths = self.rules.active(new[:, i])
            _add_gram(self._gram[i], active[usable], strengths[usable])
            if i < len(self._rows):
                active = np.concatenate([self._rows[i][0], active])
                strengths = np.concatenate([self._rows[i][1], strengths])
                self._rows[i] = (active, strengths)
            else:
                self._rows.append((active, strengths))
        self._regressed = len(self._states)

    def arrays(self) -> dict[str, FloatArray]:
        """Return weights, Gram matrices and all experience."""
        n, d = len(self.theta), len(self.rules.partitions)
        return {
            "theta": self.theta,
            "gram": self._gram,
            "states": np.array(self._states).reshape(-1, n, d),
            "rewards": np.array(self._rewards),
            "follower": np.array(self._follower, dtype=np.int64),
            "regressed": np.array(self._regressed),
        }

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        """Continue from `arrays`."""
        self.theta, self._gram = arrays["theta"].copy(), arrays["gram"].copy()
        self._states = list(arrays["states"])
        self._rewards = [float(r) for r in arrays["rewards"]]
        self._follower = [int(f) for f in arrays["follower"]]
        self._regressed = int(arrays["regressed"])
        past = arrays["states"][: self._regressed]
        agents = range(len(self.theta)) if len(past) else ()
        self._rows = [self.rules.active(past[:, i]) for i in agents]


@njit(cache=True)
def _add_gram(gram: FloatArray, active: IntArray, strengths: FloatArray) -> None:
    """Add phi phi' of every row to `gram`."""
    for s in range(len(active)):
        for a in range(active.shape[1]):
            for b in range(active.shape[1]):
                gram[active[s, a], active[s, b]] += strengths[s, a] * strengths[s, b]


@njit(cache=True)
def _moment(  # type: ignore[no-untyped-def]
    theta, active, strengths, rewards, follower, gamma: float, low: float, high: float
) -> FloatArray:
    """Return the sum of phi times target over all rows that have one."""
    n, k = active.shape
    values = np.zeros(n)
    for s in range(n):
        for a in range(k):
            values[s] += strengths[s, a] * theta[active[s, a]]
    moment = np.zeros(len(theta))
    for s in range(n):
        if follower[s] == -2:
            continue
        if follower[s] == -1:
            target = rewards[s] / (1.0 - gamma)
        else:
            target = rewards[s] + gamma * values[follower[s]]
        target = min(max(target, low), high)
        for a in range(k):
            moment[active[s, a]] += strengths[s, a] * target
    return moment
