"""Loss, gradients, advantages and rollouts of PPO."""

import numpy as np
import pytest

from nested_agents.core.networks.policy import Policy, linear_decay
from nested_agents.core.networks.rollout import (
    Batch,
    Choices,
    PolicyShape,
    Rollout,
    generalized_advantages,
)
from nested_agents.core.networks.settings import HierarchyPPOSettings

SHAPE = PolicyShape(n_told=2, n_own=4, n_joint=3, n_heads=1, n_actions=5)
TWO_HEADS = SHAPE._replace(n_heads=2)


def policy_of(shape=SHAPE, n_agents=2, **settings):
    table = {"rollout": 3, "batch_size": 4, "epochs": 2, "hidden": (5, 4), **settings}
    rng = np.random.default_rng(0)
    return Policy(HierarchyPPOSettings(**table), n_agents, shape, rng)


def double(policy):
    """Give a policy weights and gradients of double precision."""
    split = policy.actor.n_weights
    policy.weights = 0.5 * np.random.default_rng(1).normal(size=policy.weights.size)
    policy.gradient = np.zeros_like(policy.weights)
    policy.actor.bind_storage(policy.weights[:split], policy.gradient[:split])
    policy.critic.bind_storage(policy.weights[split:], policy.gradient[split:])


def decided_of(rng, m, n_heads):
    """Return which heads decided, at least one of each transition."""
    decided = rng.random((m, n_heads)) < 0.7
    decided[:, 0] |= ~decided.any(axis=1)
    return decided


def batch_of(shape, m=40):
    rng = np.random.default_rng(2)
    return Batch(
        actor_inputs=rng.normal(size=(m, shape.n_told + shape.n_own)),
        critic_inputs=rng.normal(size=(m, shape.n_own + shape.n_joint)),
        actions=rng.integers(0, shape.n_actions, (m, shape.n_heads)),
        decided=decided_of(rng, m, shape.n_heads),
        log_probs=np.log(rng.uniform(0.1, 0.4, (m, shape.n_heads))).sum(axis=1),
        advantages=rng.normal(size=m),
        returns=rng.normal(size=m),
    )


@pytest.mark.parametrize("shape", [SHAPE, TWO_HEADS])
def test_gradients_agree_with_finite_differences(shape):
    policy, batch = policy_of(shape), batch_of(shape)
    double(policy)
    policy.loss_and_grad(batch, 0.3)
    gradient = policy.gradient.copy()
    assert gradient.all()
    for k in np.random.default_rng(0).choice(gradient.size, 60, replace=False):
        ends = []
        for step in (1e-6, -1e-6):
            policy.weights[k] += step
            ends.append(policy.loss_and_grad(batch, 0.3))
            policy.weights[k] -= step
        assert gradient[k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=2e-6)


def test_the_loss_by_hand():
    """Zero weights: all actions have probability 1/2, values are 0, and the entropy is log 2."""
    policy = policy_of(SHAPE._replace(n_actions=2), clip=0.2)
    policy.weights[:] = 0.0
    m = 2
    batch = Batch(
        np.ones((m, 6)), np.ones((m, 7)), np.array([[0], [1]]), np.ones((m, 1), bool),
        np.log([0.5 / 1.5, 0.5 / 0.9]), np.array([1.0, -1.0]), np.array([2.0, 0.0]),
    )  # fmt: skip
    # Ratios of 1.5, which is clipped to 1.2, and of .9; squared errors of 4 and 0.
    expected = -(1.2 * 1.0 - 0.9 * 1.0) / 2 - 0.1 * np.log(2) + 0.5 * 2.0
    assert policy.loss_and_grad(batch, 0.1) == pytest.approx(expected, abs=1e-6)


def test_heads_are_independent_choices():
    """Log probabilities and entropies of two heads add up."""
    policy = policy_of(TWO_HEADS)
    logits = policy.logits(np.random.default_rng(0).normal(size=(3, 6)).astype(np.float32))
    assert logits.shape == (3, 2, 5)
    actions = np.array([[0, 1], [2, 2], [4, 0]])
    policy = policy_of(TWO_HEADS, n_agents=3)
    inputs = np.zeros((1, 3, 6)), np.zeros((1, 3))
    choices = Choices(logits[None], actions[None], np.ones((3, 2), bool))
    policy.append(inputs, choices, np.zeros((1, 3)), np.array([False]))
    probs = np.exp(logits) / np.exp(logits).sum(axis=2, keepdims=True)
    joint = [probs[k, 0, a] * probs[k, 1, b] for k, (a, b) in enumerate(actions)]
    assert policy.rollout.log_probs[0, 0] == pytest.approx(np.log(joint), abs=1e-5)


def test_the_loss_does_not_depend_on_the_order_of_transitions():
    policy, batch = policy_of(), batch_of(SHAPE, 150)
    loss = policy.loss_and_grad(batch, 0.01)
    gradient = policy.gradient.copy()
    mixed = batch.take(np.random.default_rng(0).permutation(150))
    assert policy.loss_and_grad(mixed, 0.01) == pytest.approx(loss, abs=1e-6)
    assert np.allclose(policy.gradient, gradient, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("decided", "last", "expected"),
    [
        # 4 + .5 8 - 2; an end: 2 - 1; 1 + .5 1 - 1 + .25 1
        ([True, True, True], [False, True, False], [0.75, 1.0, 6.0]),
        # An absence is a truncation: 1 + .5 1 - 1
        ([True, False, True], [False, False, False], [0.5, 0.0, 6.0]),
    ],
)
def test_advantages_by_hand(decided, last, expected):
    settings = HierarchyPPOSettings(discount=0.5, gae_lambda=0.5)
    rollout = Rollout(3, 1, 1, SHAPE)
    rollout.rewards[:] = np.array([1.0, 2.0, 4.0])[:, None, None]
    rollout.decided[:] = np.reshape(decided, (3, 1, 1, 1))
    rollout.last[:] = np.reshape(last, (3, 1))
    values = np.array([1.0, 1.0, 2.0])[:, None, None]
    advantages = generalized_advantages(rollout, values, np.array([[8.0]]), settings)
    assert advantages.ravel().tolist() == expected


def test_rewards_of_absent_agents_normalize_nothing():
    policies = [policy_of(rollout=20, discount=0.5) for _ in range(2)]
    for reward in np.random.default_rng(0).normal(size=20):
        for policy, unpaid in zip(policies, (0.0, 100.0), strict=True):
            append(policy, np.array([reward, unpaid]), False, (True, False))
    rewards = [policy.rollout.rewards[:, 0, 0] for policy in policies]
    assert np.array_equal(*rewards)


def append(policy, rewards, last, decided=(True, True)):
    k = len(rewards)
    inputs = np.zeros((1, k, 6)), np.zeros((1, 3))
    logits, actions = np.zeros((1, k, 1, 5)), np.zeros((1, k, 1), int)
    choices = Choices(logits, actions, np.array(decided)[:, None])
    policy.append(inputs, choices, np.array([rewards]), np.array([last]))


def test_rewards_are_divided_by_the_deviation_of_discounted_returns():
    policy = policy_of(rollout=100, discount=0.5)
    rng = np.random.default_rng(0)
    for _ in range(99):
        append(policy, rng.normal(size=2), False)
    append(policy, np.ones(2), False)
    assert policy.rollout.rewards[99, 0] == pytest.approx(np.sqrt(1 - 0.25), rel=0.2)
    assert np.allclose(policy.rollout.log_probs, np.log(0.2))


def test_a_truncated_episode_continues_by_its_value():
    policy = policy_of(discount=0.5)
    append(policy, np.array([1.0, 2.0]), True)
    rewards = policy.rollout.rewards[0, 0].copy()
    own, joint = np.ones((1, 2, 4), np.float32), np.ones((1, 3), np.float32)
    policy.bootstrap(np.array([True]), own, joint)
    value = policy.values(own, joint)[0]
    assert value.all()
    assert policy.rollout.rewards[0, 0] == pytest.approx(rewards + 0.5 * value)


def test_what_was_not_decided_is_not_learned():
    """The second agent did not decide, nor the second head of the third."""
    policy = policy_of(TWO_HEADS, n_agents=3, rollout=2)
    rng = np.random.default_rng(0)
    decided = np.array([[1, 1], [0, 0], [1, 0]], dtype=bool)
    gradients = []
    for action in (1, 4):
        actions = np.array([[[1, 1], [action, action], [1, action]]])
        choices = Choices(np.zeros((1, 3, 2, 5)), actions, decided)
        inputs = rng.normal(size=(1, 3, 6)), np.ones((1, 3))
        inputs[0][0, [0, 2]] = [[1.0], [-1.0]]
        for _ in range(2):
            policy.append(inputs, choices, np.zeros((1, 3)), np.array([False]))
        batch = policy._batch(np.zeros((1, 3)))
        assert len(batch.actions) == 4
        batch = batch._replace(advantages=np.array([1.0, -1.0, 0.5, 0.5]))
        policy.loss_and_grad(batch, 0.0)
        gradients.append(policy.gradient.copy())
        policy.rollout.steps = 0
    assert (gradients[0] == gradients[1]).all()
    assert gradients[0].any()


def test_decay():
    assert linear_decay(50, 100) == 0.5
    assert linear_decay(50, None) == 1.0


def test_a_saved_policy_continues_to_the_same_bits():
    policies = [policy_of(), policy_of()]
    for step in range(5):
        if step == 2:
            policies[1] = policy_of()
            state = policies[0].state_dict()
            policies[1].load_state_dict(state)
            policies[1]._rng.bit_generator.state = policies[0]._rng.bit_generator.state
        for policy in policies:
            append(policy, np.array([1.0, float(step)]), step == 1)
            if policy.rollout.is_full:
                policy.update(np.ones((1, 2, 4), np.float32), np.ones((1, 3), np.float32))
    assert policies[0].rollout.steps == policies[1].rollout.steps == 2
    assert np.array_equal(policies[0].weights, policies[1].weights)


@pytest.mark.parametrize(
    "other", [{"hidden": (5, 3)}, {"n_agents": 3}, {"environments": 2}, {"shape": TWO_HEADS}]
)
def test_states_of_other_policies_are_refused(other):
    with pytest.raises(ValueError, match=r"^team: saved ") as raised:
        policy_of().load_state_dict(policy_of(**other).state_dict())
    assert "\n" not in str(raised.value)


def test_another_number_of_environments_is_refused():
    policy = policy_of(environments=2)
    with pytest.raises(ValueError, match=r"learner.environments = 2: the step has 1 environments"):
        append(policy, np.zeros(2), False)
