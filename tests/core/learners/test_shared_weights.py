"""Weights of a role, and rewards by agent: pooled experience, and each alone, to the last bit."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import values_oracle as oracle

from nested_agents.core.interface.scenario import rows_of
from nested_agents.core.learners import LEARNERS
from nested_agents.core.learners.batch import REWARD_SCALE, BatchTD, BatchTDSettings
from nested_agents.core.learners.learner import Learner
from nested_agents.core.learners.td import TDLambda, TDLambdaSettings
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase

LEARNING: dict[str, dict[str, Any]] = {
    "batch-td": {"kind": "batch-td", "ridge": 0.1, "interval": 4, "trace_decay": 0.5},
    "td-lambda": {"kind": "td-lambda", "step_size": 0.2},
    "td-lambda, averaged": {"kind": "td-lambda", "step_size": 0.2, "averaging": 5.0},
}
N = 3
ROLES = np.array([0, 1, 0])
STEPS = 9


def rules_of() -> RuleBase:
    partitions = [Partition((0.0, 0.4, 1.0), "sigmoid"), Partition((-1.0, 1.0), "sigmoid", 4.0)]
    return RuleBase(partitions, [(0,), (0, 1)], 1)


def learner_of(name: str, rows: np.ndarray, **more: object) -> Learner:
    table = LEARNING[name] | more
    return LEARNERS.model(table["kind"]).model_validate(table).build(rules_of(), rows)


def experience(n: int = N) -> tuple[np.ndarray, np.ndarray]:
    """States ``(STEPS, n, 2)`` and rewards ``(STEPS, n)``, different ones for every agent."""
    rng = np.random.default_rng(8)
    return rng.uniform(-1, 1, (STEPS, n, 2)), 0.01 * rng.normal(size=(STEPS, n))


def feed(learner: Learner, states: np.ndarray, rewards: Sequence[Any], begun: bool = False) -> None:
    """Run an episode whose last after-state is terminal, or the rest of one."""
    if not begun:
        learner.begin_episode()
    for t in range(len(states)):
        learner.observe(states[t], rewards[t], t == len(states) - 1)
    learner.end_episode()


@pytest.fixture(params=LEARNING)
def name(request: pytest.FixtureRequest) -> str:
    return request.param


def test_a_role_each_is_the_same_as_weights_of_ones_own(name: str, line_world) -> None:
    world = line_world(carts=N, wheels=1)
    world.roles = ("left", "right", "middle")
    states, rewards = experience()
    one, other = (
        learner_of(name, rows_of(world, np.arange(len(world.agents)), shared=shared))
        for shared in (False, True)
    )
    for learner in (one, other):
        feed(learner, states, rewards)
        feed(learner, states[::-1], rewards)
    assert one.theta.any()
    assert (one.theta == other.theta).all()


def test_equal_rewards_are_one_reward(name: str) -> None:
    states, rewards = experience()
    number, array = (learner_of(name, np.arange(N)) for _ in range(2))
    feed(number, states, [float(r) for r in rewards[:, 0]])
    feed(array, states, [np.full(N, r) for r in rewards[:, 0]])
    assert number.theta.any()
    assert (number.theta == array.theta).all()


def test_every_agent_learns_from_its_own_reward(name: str) -> None:
    states, rewards = experience()
    team = learner_of(name, np.arange(N))
    feed(team, states, rewards)
    for i in range(N):
        alone = learner_of(name, np.arange(1))
        feed(alone, states[:, i : i + 1], rewards[:, i : i + 1])
        assert team.theta[i] == pytest.approx(alone.theta[0], rel=0, abs=1e-13)
    assert abs(team.theta[0] - team.theta[1]).max() > 1e-6


def test_shared_weights_are_restored_to_the_bit(name: str) -> None:
    states, rewards = experience()
    learner, restored = (learner_of(name, ROLES) for _ in range(2))
    feed(learner, states, rewards)
    learner.begin_episode()
    for t in range(5):
        learner.observe(states[t], rewards[t], False)
    assert learner.theta.shape == (2, rules_of().n_rules)
    restored.load_state_dict({key: array.copy() for key, array in learner.state_dict().items()})
    for each in (learner, restored):
        feed(each, states[5:], rewards[5:], begun=True)
        feed(each, states[::-1], rewards)
    assert (learner.theta == restored.theta).all()


@pytest.mark.parametrize("name", ["batch-td"], indirect=True)
def test_two_agents_of_a_role_are_one_agent_with_two_episodes(name: str) -> None:
    # The first episode is cut off at its end, as is the last after-state of either agent.
    states, rewards = experience(2)
    pooled = learner_of(name, np.array([0, 0]), interval=1000)
    alone = learner_of(name, np.array([0]), interval=1000)
    pooled.begin_episode()
    for t in range(STEPS):
        pooled.observe(states[t], rewards[t], False)
    pooled.end_episode()
    for i in range(2):
        alone.begin_episode()
        for t in range(STEPS):
            alone.observe(states[t, i : i + 1], rewards[t, i : i + 1], False)
    alone.end_episode()
    assert pooled.theta == pytest.approx(alone.theta, rel=0, abs=1e-12)


def test_batch_td_of_a_role_is_the_ridge_regression_of_all_experience() -> None:
    # gamma = 0: the targets are the rewards. Weights (X'X + ridge 1)^-1 X'y over both agents.
    settings = BatchTDSettings(
        ridge=0.5, discount=0.0, regression_iterations=1, target_averaging_rate=1.0
    )
    rules = rules_of()
    states, rewards = experience(2)
    learner = BatchTD(settings, rules, np.array([0, 0]))
    feed(learner, states, rewards)
    x = rules.features(np.concatenate([states[:, 0], states[:, 1]]))
    y = REWARD_SCALE * np.concatenate([rewards[:, 0], rewards[:, 1]])
    expected = np.linalg.solve(x.T @ x + 0.5 * np.eye(rules.n_rules), x.T @ y) / REWARD_SCALE
    assert learner.theta[0] == pytest.approx(expected, rel=0, abs=1e-14)


@pytest.mark.parametrize("averaging", [1.0, 4.0])
def test_td_lambda_of_a_role_changes_its_weights_in_turn(averaging: float) -> None:
    rules = rules_of()
    settings = TDLambdaSettings(step_size=0.3, discount=0.9, trace_decay=0.5, averaging=averaging)
    learner = TDLambda(settings, rules, ROLES)
    states, rewards = experience()
    weights, trace = np.zeros((2, rules.n_rules)), np.zeros((N, rules.n_rules))
    mean = np.zeros_like(weights)
    learner.begin_episode()
    learner.observe(states[0], rewards[0], False)
    for t in range(1, STEPS):
        learner.observe(states[t], rewards[t], False)
        for i, row in enumerate(ROLES):
            before, after = states[t - 1, i : i + 1], states[t, i : i + 1]
            ahead = oracle.values(rules, weights[row], after)
            delta = rewards[t - 1, i] + 0.9 * ahead - oracle.values(rules, weights[row], before)
            own, shared = trace[i : i + 1], weights[row : row + 1]
            oracle.td_update(rules, shared, own, before, 0.3 * delta, 0.45)
        mean += (weights - mean) / min(t, averaging)
    assert learner.weights == pytest.approx(weights, rel=0, abs=1e-12)
    assert learner.theta == pytest.approx(mean, rel=0, abs=1e-12)
