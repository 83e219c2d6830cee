"""Learners of sums: sparse cooperative Q and value decomposition, by their equations."""

import numpy as np
import pytest

from nested_agents.core.learners.sums import (
    SparseCooperative,
    SparseCooperativeSettings,
    ValueDecomposition,
    ValueDecompositionSettings,
)
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase

FUZZY = RuleBase([Partition((-1.0, 0.0, 1.0), "triangular")], [(0,)])
LEARNERS = {
    "sparse": (SparseCooperative, SparseCooperativeSettings),
    "vdn": (ValueDecomposition, ValueDecompositionSettings),
}


def fed(kind, states, rewards, terminal=False, rows=None):
    learner, settings = LEARNERS[kind]
    made = learner(
        settings(step_size=0.2, discount=0.6), FUZZY, np.arange(3) if rows is None else rows
    )
    made.begin_episode()
    for t, (entered, reward) in enumerate(zip(states, rewards, strict=True)):
        made.observe(entered, reward, terminal and t == len(states) - 1)
    return made.theta


@pytest.mark.parametrize("kind", LEARNERS)
@pytest.mark.parametrize("own", [False, True])
def test_the_equations_written_out(kind, own):
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (12, 3, 1))
    rewards = rng.normal(size=(12, 3) if own else 12)
    shares = rewards.copy() if own else np.repeat(rewards[:, None], 3, axis=1) / 3
    phi = np.stack([FUZZY.features(s) for s in states])
    phi = np.concatenate([phi, np.zeros((1, 3, 3))])  # after the end
    shares[-1] /= 1.0 - 0.6
    theta = np.zeros((3, 3))
    for t in range(12):
        f, ahead = ((phi[k] * theta).sum(axis=1) for k in (t, t + 1))
        delta, lengths = shares[t] + 0.6 * ahead - f, (phi[t] ** 2).sum(axis=1)
        if kind == "vdn":
            delta, lengths = np.full(3, delta.sum()), np.full(3, lengths.sum())
        theta = theta + (0.2 * delta / lengths)[:, None] * phi[t]
    given = list(rewards) if own else [float(r) for r in rewards]
    np.testing.assert_allclose(fed(kind, states, given, terminal=True), theta, atol=1e-12)


@pytest.mark.parametrize("kind", LEARNERS)
def test_the_sum_learns_what_the_team_is_paid(kind):
    # A payment that is a sum over the agents: any learner of sums can represent it.
    rng = np.random.default_rng(1)
    learner, settings = LEARNERS[kind]
    made = learner(settings(step_size=0.2, discount=0.0), FUZZY, np.arange(3))
    made.begin_episode()
    for _ in range(6000):
        places = rng.uniform(-1, 1, (3, 1))
        paid = np.abs(places[:, 0])
        made.observe(places, paid if kind == "sparse" else float(paid.sum()), False)
    places = rng.uniform(-1, 1, (3, 1))
    found = made.rules.values_of_agents(made.theta, places[:, None])[:, 0].sum()
    assert found == pytest.approx(np.abs(places).sum(), abs=0.02)


def test_agents_of_one_role_share_what_they_learn():
    states = np.random.default_rng(2).uniform(-1, 1, (5, 3, 1))
    for kind in LEARNERS:
        assert fed(kind, states, [1.0] * 5, rows=np.array([0, 1, 0])).shape == (2, 3)
