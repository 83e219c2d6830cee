"""TD(lambda) against hand-worked numbers, the lambda-return, and solutions in closed form."""

from typing import Any

import numpy as np
import pytest
import values_oracle as oracle

from nested_agents.core.learners.td import TDLambda, TDLambdaSettings
from nested_agents.core.values.partitions import Partition
from nested_agents.core.values.rule_base import RuleBase

LOW_HIGH = Partition((0.0, 1.0), "triangular")
EIGHT_RULES = RuleBase([LOW_HIGH] * 3, [(0, 1, 2)])
# One-hot features in the states 0, 1, 2, 3, 4: a table.
TABLE = RuleBase([Partition((0.0, 1.0, 2.0, 3.0, 4.0), "triangular")], [(0,)])
FUZZY = RuleBase(
    [Partition((0.0, 0.4, 1.0), "sigmoid"), Partition((-1.0, 1.0), "sigmoid", 4.0)], [(0,), (0, 1)]
)


def learner_of(rules: RuleBase, n_agents: int = 1, **settings: object) -> TDLambda:
    return TDLambda(TDLambdaSettings(**settings), rules, np.arange(n_agents))


def feed(learner: TDLambda, states: np.ndarray, rewards: np.ndarray, terminal: bool) -> None:
    """Run an episode of one agent's after-states ``(T + 1, d)``."""
    learner.begin_episode()
    for t, (state, reward) in enumerate(zip(states, rewards, strict=True)):
        learner.observe(state[None], float(reward), terminal and t == len(states) - 1)
    learner.end_episode()


def frozen_increments(
    learner: TDLambda, states: np.ndarray, rewards: np.ndarray, terminal: bool
) -> np.ndarray:
    """Sum of an episode's increments of theta while theta is held: off-line TD(lambda)."""
    held, total = learner.theta.copy(), np.zeros(learner.theta.shape)
    learner.begin_episode()
    for state, reward in zip(states, rewards, strict=True):
        learner.observe(state[None], float(reward), False)
        total += learner.theta - held
        learner.theta[:] = held
    if terminal:  # on entering it `observe` would update twice without a chance to hold theta
        learner._update(states[-1:], rewards[-1:] / (1 - learner.settings.discount), None)
        total += learner.theta - held
        learner.theta[:] = held
    return total[0]


@pytest.mark.parametrize("averaging", [1.0, 10.0])
def test_every_state_has_the_initial_weight_as_its_value(averaging: float) -> None:
    learner = learner_of(EIGHT_RULES, 2, initial_weight=0.5, averaging=averaging)
    values = EIGHT_RULES.values_of_agents(learner.theta, np.full((2, 1, 3), 0.3))
    assert values == pytest.approx(np.full((2, 1), 0.5))
    assert np.array_equal(learner.weights, learner.theta)


def test_eight_rules_over_three_steps_by_hand() -> None:
    # alpha = 0.1, gamma = 0.9, lambda = 0.5, so gamma lambda = 0.45. Rules in the order LLL, LLH,
    # LHL, LHH, HLL, HLH, HHL, HHH; all theta are zero at first.
    learner = learner_of(EIGHT_RULES, step_size=0.1, discount=0.9, trace_decay=0.5)
    learner.begin_episode()
    # The first state is (0, 0, 0), all LOW, R = 1. There is no previous state, nothing changes.
    assert learner.observe(np.array([[0.0, 0.0, 0.0]]), 1.0, False) == 0
    assert not learner.theta.any()
    # (0, 0, 0.5), R = 2: delta = 1 + 0.9 * 0 - 0 = 1 with the reward of the previous state;
    # e = phi(0, 0, 0) = 1 for LLL; theta_LLL = 0.1 * 1 * 1 = 0.1.
    assert learner.observe(np.array([[0.0, 0.0, 0.5]]), 2.0, False) == 8
    assert learner.theta[0] == pytest.approx([0.1, 0, 0, 0, 0, 0, 0, 0], abs=1e-15)
    # (0, 1, 0.5), R = 4: f(previous) = 0.5 * 0.1 = 0.05, f(current) = 0, delta = 2 - 0.05 = 1.95;
    # e_LLL = 0.45 * 1 + 0.5 = 0.95, e_LLH = 0.5; alpha delta = 0.195;
    # theta_LLL = 0.1 + 0.195 * 0.95 = 0.28525, theta_LLH = 0.195 * 0.5 = 0.0975.
    learner.observe(np.array([[0.0, 1.0, 0.5]]), 4.0, False)
    assert learner.theta[0] == pytest.approx([0.28525, 0.0975, 0, 0, 0, 0, 0, 0], abs=1e-15)
    # (0, 0, 0), R = 0.5: f(current) = 0.28525, f(previous) = 0,
    # delta = 4 + 0.9 * 0.28525 = 4.256725; e_LLL = 0.45 * 0.95 = 0.4275, e_LLH = 0.225,
    # e_LHL = e_LHH = 0.5; alpha delta = 0.4256725;
    # theta_LLL = 0.28525 + 0.4256725 * 0.4275 = 0.46722499375,
    # theta_LLH = 0.0975 + 0.4256725 * 0.225 = 0.1932763125, theta_LHL = 0.21283625.
    learner.observe(np.array([[0.0, 0.0, 0.0]]), 0.5, False)
    expected = [0.46722499375, 0.1932763125, 0.21283625, 0.21283625, 0, 0, 0, 0]
    assert learner.theta[0] == pytest.approx(expected, abs=1e-15)


def test_the_reward_of_the_state_entered_by_hand() -> None:
    # Section V's reading of Eq. 7. alpha = 0.5, gamma = 0.9, lambda = 0; states 0, 1, 2 of a table.
    learner = learner_of(TABLE, step_size=0.5, discount=0.9, trace_decay=0.0, reward_of="entered")
    learner.begin_episode()
    learner.observe(np.array([[0.0]]), 7.0, False)  # nothing comes before it: its R is not learned
    learner.observe(np.array([[1.0]]), 2.0, False)  # delta = 2 + 0 - 0, theta_0 = 1
    assert learner.theta[0] == pytest.approx([1.0, 0, 0, 0, 0])
    # Terminal, R = 3: theta_1 = 0.5 * 3; then entered for ever, theta_2 = 0.5 * 3 / 0.1 = 15.
    learner.observe(np.array([[2.0]]), 3.0, True)
    assert learner.theta[0] == pytest.approx([1.0, 1.5, 15.0, 0, 0])


def test_in_the_limit_the_readings_differ_by_the_reward_of_the_state() -> None:
    # States 0, 1, 2 with R = 1, 2, 4, the last for ever, gamma = 0.5. R of the state left:
    # f = 4 / 0.5 = 8, 2 + 4 = 6, 1 + 3 = 4; of the state entered: 8, 4 + 4 = 8, 2 + 4 = 6.
    expected = {"left": [4.0, 6.0, 8.0], "entered": [6.0, 8.0, 8.0]}
    states = np.array([[0.0], [1.0], [2.0]])
    for reading, values in expected.items():
        learner = learner_of(TABLE, step_size=0.5, discount=0.5, trace_decay=0.0, reward_of=reading)
        for _ in range(60):
            feed(learner, states, np.array([1.0, 2.0, 4.0]), True)
        assert learner.theta[0, :3] == pytest.approx(values)


def test_a_terminal_state_by_hand() -> None:
    # The same episode, but the last state is terminal: it is followed by itself for ever, worth
    # 0.5 / (1 - 0.9) = 5. delta = 5 - 0.46722499375 = 4.53277500625; e_LLL = 0.45 * 0.4275 + 1
    # = 1.192375, e_LLH = 0.10125, e_LHL = e_LHH = 0.225.
    learner = learner_of(EIGHT_RULES, step_size=0.1, discount=0.9, trace_decay=0.5)
    states = np.array([[0, 0, 0], [0, 0, 0.5], [0, 1, 0.5], [0, 0, 0]], dtype=float)
    feed(learner, states, np.array([1.0, 2.0, 4.0, 0.5]), terminal=True)
    step = 0.453277500625
    expected = [
        0.46722499375 + step * 1.192375,
        0.1932763125 + step * 0.10125,
        0.21283625 + step * 0.225,
        0.21283625 + step * 0.225,
    ]
    assert learner.theta[0, :4] == pytest.approx(expected, abs=1e-15)
    assert not learner.theta[0, 4:].any()


def test_an_episode_starts_without_traces() -> None:
    learner = learner_of(TABLE, step_size=0.5, discount=0.9, trace_decay=1.0)
    feed(learner, np.array([[0.0], [1.0]]), np.array([1.0, 0.0]), False)
    before = learner.theta.copy()
    feed(learner, np.array([[2.0], [3.0]]), np.array([1.0, 0.0]), False)
    assert (learner.theta[0] - before[0]).tolist() == [0, 0, 0.5, 0, 0]


def test_a_normalized_step_removes_the_error_at_once() -> None:
    # alpha = 1 without discount and trace: f(s) becomes R(s), whatever the features.
    learner = learner_of(FUZZY, step_size=1.0, discount=0.0, trace_decay=0.0, normalized=True)
    states = np.random.default_rng(1).uniform(-1, 1, (6, 2))
    for state in states:
        feed(learner, np.stack([state, np.zeros(2)]), np.array([0.7, 0.0]), False)
        assert FUZZY.values(learner.theta[0], state[None]) == pytest.approx([0.7], abs=1e-12)
    assert FUZZY.squared_lengths(states) == pytest.approx(
        (FUZZY.features(states) ** 2).sum(axis=1), abs=1e-14
    )


def test_agents_learn_each_on_its_own() -> None:
    rng = np.random.default_rng(2)
    states, rewards = rng.uniform(-1, 1, (8, 3, 2)), rng.normal(size=8)
    team = learner_of(FUZZY, 3, step_size=0.2)
    alone = [learner_of(FUZZY, 1, step_size=0.2) for _ in range(3)]
    for s, r in zip(states, rewards, strict=True):
        assert team.observe(s, r, False) in (0, 3 * FUZZY.n_rules)
        for i in range(3):
            alone[i].observe(s[i : i + 1], r, False)
    assert (team.theta == np.concatenate([one.theta for one in alone])).all()
    order = [2, 0, 1]
    permuted = learner_of(FUZZY, 3, step_size=0.2)
    for s, r in zip(states, rewards, strict=True):
        permuted.observe(s[order], r, False)
    assert (permuted.theta == team.theta[order]).all()


@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("terminal", [False, True])
def test_the_equations_written_out(trace_decay: float, terminal: bool) -> None:
    rng = np.random.default_rng(3)
    states, rewards = rng.uniform(-1, 1, (30, 2)), rng.normal(size=30)
    alpha, gamma = 0.1, 0.9
    learner = learner_of(FUZZY, step_size=alpha, discount=gamma, trace_decay=trace_decay)
    feed(learner, states, rewards, terminal)
    theta, trace = np.zeros((1, FUZZY.n_rules)), np.zeros((1, FUZZY.n_rules))
    for t in range(30 if terminal else 29):
        here = oracle.values(FUZZY, theta[0], states[t : t + 1])
        if t < 29:
            target = rewards[t] + gamma * oracle.values(FUZZY, theta[0], states[t + 1 : t + 2])
        else:
            target = rewards[t] / (1.0 - gamma)
        steps = alpha * (target - here)
        oracle.td_update(FUZZY, theta, trace, states[t : t + 1], steps, gamma * trace_decay)
    assert learner.theta == pytest.approx(theta, rel=0, abs=1e-12)


@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 0.9, 1.0])
@pytest.mark.parametrize("terminal", [False, True])
def test_offline_td_lambda_is_the_lambda_return(trace_decay: float, terminal: bool) -> None:
    # The sum of an episode's increments equals alpha sum_t (G_t - f(s_t)) phi(s_t), where G_t is
    # the lambda-return: (1 - lambda) sum_n lambda^(n-1) G_t^(n), the last n-step return taking
    # what remains of the weight (Sutton and Barto 2018, ch. 12.1).
    rng = np.random.default_rng(4)
    last, gamma, alpha, lam = 12, 0.9, 0.3, trace_decay
    states, rewards = rng.uniform(-1, 1, (last + 1, 2)), rng.normal(size=last + 1)
    learner = learner_of(FUZZY, step_size=alpha, discount=gamma, trace_decay=lam)
    learner.theta[:] = rng.normal(size=learner.theta.shape)
    f = oracle.values(FUZZY, learner.theta[0], states)
    end = last + 1 if terminal else last

    def n_step(t: int, n: int) -> float:
        rewarded = sum(gamma**k * rewards[t + k] for k in range(n))
        if t + n <= last:
            return rewarded + gamma**n * f[t + n]
        # Beyond a terminal state its reward is received for ever.
        return rewarded + gamma**n * rewards[last] / (1.0 - gamma)

    expected = np.zeros(FUZZY.n_rules)
    for t in range(end):
        longest = end - t
        returns = [n_step(t, n) for n in range(1, longest + 1)]
        weights = [(1 - lam) * lam ** (n - 1) for n in range(1, longest)] + [lam ** (longest - 1)]
        mixed = float(np.dot(weights, returns))
        expected += alpha * (mixed - f[t]) * FUZZY.features(states[t : t + 1])[0]
    found = frozen_increments(learner, states, rewards, terminal)
    assert found == pytest.approx(expected, rel=0, abs=1e-10)


@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 1.0])
def test_a_known_chain_is_learned(trace_decay: float) -> None:
    # 0 -> 1 -> 2 -> 3 -> 4, rewards 1, 0, -2, 0, 0.3 on entering, 4 terminal, gamma = 0.9:
    # V(4) = 0.3 / 0.1 = 3, V(3) = 0.9 * 3 = 2.7, V(2) = -2 + 2.43 = 0.43, V(1) = 0.387,
    # V(0) = 1 + 0.3483. On-line TD(lambda) on a table has these as its fixed point.
    learner = learner_of(TABLE, step_size=0.5, discount=0.9, trace_decay=trace_decay)
    states, rewards = np.arange(5.0)[:, None], np.array([1.0, 0.0, -2.0, 0.0, 0.3])
    for _ in range(120):
        feed(learner, states, rewards, terminal=True)
    assert learner.theta[0] == pytest.approx([1.3483, 0.387, 0.43, 2.7, 3.0], rel=0, abs=1e-10)


@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 1.0])
def test_a_cycle_without_end_is_learned(trace_decay: float) -> None:
    # 0 -> 1 -> 2 -> 0 -> ... with rewards 1, 2, 4: V(0) = 1 + g V(1) and so on around, so
    # V(0) = (1 + 2 g + 4 g^2) / (1 - g^3).
    g = 0.5
    learner = learner_of(TABLE, step_size=0.2, discount=g, trace_decay=trace_decay)
    turns = 300
    feed(learner, np.tile([[0.0], [1.0], [2.0]], (turns, 1)), np.tile([1.0, 2, 4], turns), False)
    values = [
        (1 + 2 * g + 4 * g * g) / (1 - g**3),
        (2 + 4 * g + g * g) / (1 - g**3),
        (4 + g + 2 * g * g) / (1 - g**3),
    ]
    assert learner.theta[0, :3] == pytest.approx(values, rel=0, abs=1e-10)


@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 1.0])
def test_a_stochastic_chain_under_replay(trace_decay: float) -> None:
    # From 0 equally often to 1 and to 2, both terminal, with rewards 0.1 and -0.3: the batch of
    # the two episodes, replayed with theta held during a sweep, has the fixed point V(1) = 1,
    # V(2) = -3 and V(0) = 0.2 + 0.9 * (1 - 3) / 2 = -0.7 for every lambda.
    learner = learner_of(TABLE, step_size=0.5, discount=0.9, trace_decay=trace_decay)
    for _ in range(100):
        one = frozen_increments(learner, np.array([[0.0], [1.0]]), np.array([0.2, 0.1]), True)
        two = frozen_increments(learner, np.array([[0.0], [2.0]]), np.array([0.2, -0.3]), True)
        learner.theta += one + two
    assert learner.theta[0, :3] == pytest.approx([-0.7, 1.0, -3.0], rel=0, abs=1e-10)


@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 1.0])
def test_the_linear_fixed_point_in_closed_form(trace_decay: float) -> None:
    # With fewer features than states TD(lambda) aims at theta = A^-1 b, A = sum e (phi - gamma
    # phi')', b = sum e R (LSTD(lambda), Boyan 2002). There the increments of all episodes cancel.
    rules = RuleBase([Partition((0.0, 0.5, 1.0), "triangular")], [(0,)])
    rng = np.random.default_rng(5)
    gamma, n = 0.9, rules.n_rules
    episodes = [(rng.uniform(0, 1, (20, 1)), rng.normal(size=20)) for _ in range(4)]
    a, b = np.zeros((n, n)), np.zeros(n)
    for states, rewards in episodes:
        phi, e = rules.features(states), np.zeros(n)
        for t in range(19):
            e = gamma * trace_decay * e + phi[t]
            a += np.outer(e, phi[t] - gamma * phi[t + 1])
            b += rewards[t] * e
        # The last state is terminal: R / (1 - gamma) and nothing after it.
        e = gamma * trace_decay * e + phi[19]
        a += np.outer(e, phi[19])
        b += rewards[19] / (1 - gamma) * e
    learner = learner_of(rules, step_size=0.01, discount=gamma, trace_decay=trace_decay)
    learner.theta[0] = np.linalg.solve(a, b)
    total = sum(frozen_increments(learner, *episode, terminal=True) for episode in episodes)
    assert total == pytest.approx(np.zeros(n), abs=1e-10)
    # Any other theta is moved by alpha (b - A theta), nothing else.
    learner.theta[0] = other = rng.normal(size=n)
    total = sum(frozen_increments(learner, *episode, terminal=True) for episode in episodes)
    assert total == pytest.approx(0.01 * (b - a @ other), rel=0, abs=1e-10)


def test_observing_leaves_its_arguments_alone() -> None:
    learner = learner_of(FUZZY)
    states = np.full((1, 2), 0.3)
    learner.observe(states, 1.0, False)
    states[:] = 9.0
    learner.observe(np.zeros((1, 2)), 0.0, False)
    expected = FUZZY.features(np.full((1, 2), 0.3))
    assert learner.trace == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("rules", [TABLE, FUZZY])
def test_averaged_weights_decide_and_others_learn(rules: RuleBase) -> None:
    common: dict[str, Any] = {
        "step_size": 0.3,
        "discount": 0.9,
        "trace_decay": 0.7,
        "normalized": True,
    }
    plain, averaged = learner_of(rules, **common), learner_of(rules, averaging=4.0, **common)
    rng = np.random.default_rng(6)
    d = len(rules.partitions)
    plain.begin_episode()
    averaged.begin_episode()
    mean = np.zeros_like(plain.theta)
    for t in range(12):
        state, reward = rng.uniform(0, 1, (1, d)), float(rng.normal())
        plain.observe(state, reward, False)
        averaged.observe(state, reward, False)
        assert (averaged.weights == plain.theta).all()
        if t > 0:
            mean += (plain.theta - mean) / min(t, 4)
        assert averaged.theta == pytest.approx(mean, rel=0, abs=1e-14)
    assert (plain.theta == plain.weights).all()
    assert abs(averaged.theta - plain.theta).max() > 1e-3


@pytest.mark.parametrize("averaging", [1.0, 5.0])
def test_a_restored_learner_goes_on_with_the_same_bits(averaging: float) -> None:
    rng = np.random.default_rng(7)
    states, rewards = rng.uniform(-1, 1, (20, 2)), rng.normal(size=20)
    learner, restored = (
        learner_of(FUZZY, step_size=0.3, trace_decay=0.7, averaging=averaging) for _ in range(2)
    )
    feed(learner, states[:8], rewards[:8], False)
    restored.load_state_dict({name: array.copy() for name, array in learner.state_dict().items()})
    for each in (learner, restored):
        for state, reward in zip(states[8:], rewards[8:], strict=True):
            each.observe(state[None], float(reward), False)
    assert (restored.theta == learner.theta).all()
    assert (restored.weights == learner.weights).all()
