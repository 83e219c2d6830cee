"""Optimistic TD and FMQ against their definitions, on tables."""

import numpy as np
import pytest

from nested_agents.core.learners.td import (
    FMQ,
    FMQSettings,
    OptimisticTD,
    OptimisticTDSettings,
    TDLambda,
    TDLambdaSettings,
)
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase

TABLE = RuleBase([Partition((0.0, 1.0, 2.0), "triangular")], [(0,)])


def feed(learner, actions, rewards):
    learner.begin_episode()
    for action, reward in zip(actions, rewards, strict=True):
        learner.observe(np.array([[float(action)]]), float(reward), False)


def plays(seed, n=60):
    rng = np.random.default_rng(seed)
    return rng.integers(3, size=n), rng.choice([-4.0, 1.0, 3.0], size=n)


@pytest.mark.parametrize("falling", [0.0, 0.3])
def test_optimism_written_out(falling):
    actions, rewards = plays(1)
    settings = OptimisticTDSettings(step_size=0.2, falling=falling, discount=0.0)
    learner = OptimisticTD(settings, TABLE, np.arange(1))
    feed(learner, actions, rewards)
    q = np.zeros(3)
    for action, reward in zip(actions[:-1], rewards[:-1], strict=True):
        delta = reward - q[action]
        q[action] += 0.2 * max(delta, falling * delta)
    np.testing.assert_allclose(learner.theta[0], q, atol=1e-12)


def test_without_optimism_it_is_td():
    actions, rewards = plays(2)
    common = {"step_size": 0.1, "discount": 0.7}
    even = OptimisticTD(OptimisticTDSettings(falling=1.0, **common), TABLE, np.arange(1))
    td = TDLambda(TDLambdaSettings(normalized=True, trace_decay=0.0, **common), TABLE, np.arange(1))
    for learner in (even, td):
        feed(learner, actions, rewards)
    np.testing.assert_allclose(even.theta, td.theta, atol=1e-12)


def test_fmq_written_out_and_restored():
    actions, rewards = plays(3)
    settings = FMQSettings(step_size=0.2, weight=5.0, discount=0.0)
    learner = FMQ(settings, TABLE, np.arange(1))
    feed(learner, actions, rewards)
    for action in range(3):
        paid = rewards[:-1][actions[:-1] == action]
        q = 0.0
        for reward in paid:
            q += 0.2 * (reward - q)
        bonus = 5.0 * (paid == paid.max()).mean() * paid.max()
        assert learner.theta[0, action] == pytest.approx(q + bonus)
    other = FMQ(settings, TABLE, np.arange(1))
    other.load_state_dict(learner.state_dict())
    for each in (learner, other):
        each.observe(np.array([[1.0]]), 3.0, False)
        each.observe(np.array([[1.0]]), 3.0, False)
    assert (learner.theta == other.theta).all()
