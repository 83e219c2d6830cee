"""Batch learners against ridge regression written out in NumPy, and known solutions."""

import numpy as np
import pytest

from nested_agents.core.learners.batch import REWARD_SCALE, BatchTD, BatchTDSettings
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase

TABLE = RuleBase([Partition((0.0, 1.0, 2.0, 3.0, 4.0), "triangular")], [(0,)])


def fuzzy(membership: str) -> RuleBase:
    partitions = [Partition((0.0, 0.4, 1.0), membership), Partition((-1.0, 1.0), membership, 4.0)]
    return RuleBase(partitions, [(0,), (0, 1)], 1)


def episodes_of(rng: np.random.Generator, n_agents: int) -> list[tuple]:
    """Episodes (states (T, n, 2), rewards (T,), terminal)."""
    made = []
    for length, terminal in ((7, True), (1, False), (5, False), (1, True)):
        states = rng.uniform(-1, 1, (length, n_agents, 2))
        made.append((states, 0.01 * rng.normal(size=length), terminal))
    return made


def feed(learner: BatchTD, episode: tuple) -> int:
    states, rewards, terminal = episode
    learner.begin_episode()
    for t in range(len(states)):
        last = t == len(states) - 1
        learner.observe(states[t], float(rewards[t]), terminal and last)
    return learner.end_episode()


def lambda_return(
    t: int, values: np.ndarray, rewards: np.ndarray, terminal: bool, settings: BatchTDSettings
) -> float:
    """(1 - lambda) V(t) + lambda G(t), G(t) = R(t) + gamma times the same of t + 1."""
    gamma, decay = settings.discount, settings.trace_decay
    if t == len(values) - 1:
        ahead = rewards[t] / (1 - gamma) if terminal else values[t]
    else:
        ahead = rewards[t] + gamma * lambda_return(t + 1, values, rewards, terminal, settings)
    return float((1 - decay) * values[t] + decay * ahead)


def ridge_by_hand(rules: RuleBase, episodes: list[tuple], settings: BatchTDSettings) -> np.ndarray:
    """Consequent weights of all agents after `episodes`, regressing after each of them."""
    n_agents, gamma = episodes[0][0].shape[1], settings.discount
    theta = np.zeros((n_agents, rules.n_rules))
    for k in range(1, len(episodes) + 1):
        seen = REWARD_SCALE * np.concatenate([episode[1] for episode in episodes[:k]])
        low, high = seen.min() / (1 - gamma), seen.max() / (1 - gamma)
        for i in range(n_agents):
            w = REWARD_SCALE * theta[i]
            for _ in range(settings.regression_iterations):
                rows, targets = [], []
                for states, rewards, terminal in episodes[:k]:
                    phi = rules.features(states[:, i])
                    for t in range(len(states)):
                        reward = REWARD_SCALE * rewards[t]
                        if t == len(states) - 1:
                            if not terminal:
                                continue
                            target = reward / (1 - gamma)
                        else:
                            target = reward + gamma * lambda_return(
                                t + 1, phi @ w, REWARD_SCALE * rewards, terminal, settings
                            )
                        rows.append(phi[t])
                        targets.append(min(max(target, low), high))
                x = np.array(rows).reshape(-1, rules.n_rules)
                gram = x.T @ x + settings.ridge * np.eye(rules.n_rules)
                w = np.linalg.solve(gram, x.T @ np.array(targets))
            theta[i] += settings.target_averaging_rate * (w / REWARD_SCALE - theta[i])
    return theta


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
@pytest.mark.parametrize("ridge", [0.01, 10.0])
@pytest.mark.parametrize("decay", [0.0, 0.5, 1.0])
def test_batch_td_is_the_ridge_regression_written_out(
    membership: str, ridge: float, decay: float
) -> None:
    rules = fuzzy(membership)
    settings = BatchTDSettings(
        ridge=ridge, regression_iterations=4, discount=0.8, trace_decay=decay
    )
    episodes = episodes_of(np.random.default_rng(1), 2)
    learner = BatchTD(settings, rules, np.arange(2))
    for episode in episodes:
        assert feed(learner, episode) == 2 * rules.n_rules
    expected = ridge_by_hand(rules, episodes, settings)
    assert learner.theta == pytest.approx(expected, rel=0, abs=1e-12)


def test_a_single_after_state_is_regressed_on() -> None:
    """One agent whose first episode has one step, after which it was cut off or ended."""
    of_one_agent = episodes_of(np.random.default_rng(1), 1)
    for first in (1, 3):
        learner = BatchTD(BatchTDSettings(), fuzzy("triangular"), np.arange(1))
        episodes = of_one_agent[first:] + of_one_agent[:first]
        for episode in episodes:
            feed(learner, episode)
        expected = ridge_by_hand(fuzzy("triangular"), episodes, BatchTDSettings())
        assert learner.theta == pytest.approx(expected, rel=0, abs=1e-12)


def test_batch_td_solves_a_known_chain() -> None:
    # The chain of test_td: V(4) = 0.3 / 0.1 = 3, 2.7, -2 + 2.43 = 0.43, 0.387, 1 + 0.3483. The
    # targets stay within the range -2 / 0.1 to 1 / 0.1 of discounted sums.
    settings = BatchTDSettings(
        ridge=1e-13, regression_iterations=300, discount=0.9, target_averaging_rate=1.0
    )
    learner = BatchTD(settings, TABLE, np.arange(1))
    states = np.arange(5.0).reshape(5, 1, 1)
    feed(learner, (states, np.array([1.0, 0.0, -2.0, 0.0, 0.3]), True))
    assert learner.theta[0] == pytest.approx([1.3483, 0.387, 0.43, 2.7, 3.0], rel=0, abs=1e-10)


def test_targets_stay_within_what_rewards_can_sum_to() -> None:
    # theta far too large: the first target R + 0.9 * 1e6 is cut to 1 / (1 - 0.9) = 10.
    learner = BatchTD(
        BatchTDSettings(
            ridge=1e-13, regression_iterations=1, discount=0.9, target_averaging_rate=1.0
        ),
        TABLE,
        np.arange(1),
    )
    learner.theta[:] = 1e6
    feed(learner, (np.array([[[0.0]], [[1.0]]]), np.array([1.0, -1.0]), False))
    assert learner.theta[0, :2] == pytest.approx([10.0, 0.0], rel=0, abs=1e-10)


def test_an_episode_given_up_is_not_linked_to_the_next() -> None:
    episodes = episodes_of(np.random.default_rng(3), 1)
    given_up, next_one = episodes[2], episodes[0]
    rules = fuzzy("triangular")
    learner = BatchTD(BatchTDSettings(regression_iterations=3, ridge=0.1), rules, np.arange(1))
    learner.begin_episode()
    for state, reward in zip(given_up[0], given_up[1], strict=True):
        learner.observe(state, float(reward), False)
    feed(learner, next_one)
    expected = BatchTD(BatchTDSettings(regression_iterations=3, ridge=0.1), rules, np.arange(1))
    expected.theta[:] = 0.0
    feed(expected, given_up)
    expected.theta[:] = 0.0
    feed(expected, next_one)
    assert (learner.theta == expected.theta).all()


def test_a_long_episode_is_regressed_on_while_it_runs() -> None:
    rules = fuzzy("triangular")
    states, rewards, _ = episodes_of(np.random.default_rng(4), 1)[0]
    learner = BatchTD(
        BatchTDSettings(regression_iterations=3, ridge=0.1, interval=2), rules, np.arange(1)
    )
    feed(learner, (states, rewards, True))
    theta = np.zeros_like(learner.theta)
    for seen in [*range(2, len(states), 2), len(states)]:
        whole = BatchTD(BatchTDSettings(regression_iterations=3, ridge=0.1), rules, np.arange(1))
        whole.theta[:] = theta
        feed(whole, (states[:seen], rewards[:seen], seen == len(states)))
        theta = whole.theta
    assert len(states) > 3
    assert (learner.theta == theta).all()


def test_a_restored_learner_regresses_at_the_same_decisions() -> None:
    rules = fuzzy("triangular")
    settings = BatchTDSettings(regression_iterations=3, ridge=0.1, interval=3)
    first, _, second, _ = episodes_of(np.random.default_rng(5), 1)
    learner, restored = (
        BatchTD(settings, rules, np.arange(1)),
        BatchTD(settings, rules, np.arange(1)),
    )
    feed(learner, first)
    learner.begin_episode()
    learner.observe(second[0][0], float(second[1][0]), False)
    restored.load_state_dict(learner.state_dict())
    for state, reward in zip(second[0][1:], second[1][1:], strict=True):
        changed = [each.observe(state, float(reward), False) for each in (learner, restored)]
        assert changed[0] == changed[1]
    assert (learner.theta == restored.theta).all()


def test_no_experience_teaches_nothing() -> None:
    learner = BatchTD(BatchTDSettings(), TABLE, np.arange(2))
    learner.begin_episode()
    assert learner.end_episode() == 0
    assert not learner.theta.any()


def test_too_many_rules_are_refused() -> None:
    rules = RuleBase([Partition((0.0, 1.0), "triangular")] * 13, [tuple(range(13))])
    with pytest.raises(ValueError, match="8192 rules, allowed up to 4096") as caught:
        BatchTD(BatchTDSettings(), rules, np.arange(1))
    assert "\n" not in str(caught.value)
