"""Gradient TD against its equations written out, its fixed point, and where TD diverges."""

import numpy as np
import pytest

from nested_agents.core.learners.gradient import GradientTD, GradientTDSettings
from nested_agents.core.learners.td import TDLambda, TDLambdaSettings
from nested_agents.core.rules.kernels.fuzzy import Partition
from nested_agents.core.rules.rule_base import RuleBase

CORRECTIONS = ("tdc", "gtd2")
FUZZY = RuleBase(
    [Partition((0.0, 0.4, 1.0), "sigmoid"), Partition((-1.0, 1.0), "sigmoid", 4.0)], [(0,), (0, 1)]
)


def feed(
    learner: GradientTD | TDLambda, states: np.ndarray, rewards: np.ndarray, terminal: bool
) -> None:
    learner.begin_episode()
    for t, (state, reward) in enumerate(zip(states, rewards, strict=True)):
        learner.observe(state[None], float(reward), terminal and t == len(states) - 1)
    learner.end_episode()


@pytest.mark.parametrize("correction", CORRECTIONS)
@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 1.0])
def test_the_equations_written_out(correction: str, trace_decay: float) -> None:
    # w aims at E[phi phi'] w = E[delta e]. With A = E[e (phi - gamma phi')'], GTD2 moves theta
    # along A'w and TDC along E[delta e] less the part of A'w that bootstraps.
    rng = np.random.default_rng(1)
    states, rewards = rng.uniform(-1, 1, (25, 2)), rng.normal(size=25)
    alpha, beta, gamma = 0.1, 0.2, 0.9
    settings = GradientTDSettings(
        correction=correction, step_size=alpha, second_step_size=beta, discount=gamma,
        trace_decay=trace_decay,
    )  # fmt: skip
    learner = GradientTD(settings, FUZZY, np.arange(1))
    feed(learner, states, rewards, terminal=True)
    phi = np.vstack([FUZZY.features(states), np.zeros(FUZZY.n_rules)])
    rewards = rewards.copy()
    rewards[-1] /= 1.0 - gamma
    theta, w, e = np.zeros((3, FUZZY.n_rules))
    for t in range(25):
        delta = rewards[t] + gamma * phi[t + 1] @ theta - phi[t] @ theta
        e = gamma * trace_decay * e + phi[t]
        bootstrap = gamma * (1.0 - trace_decay) * (e @ w) * phi[t + 1]
        along = delta * e if correction == "tdc" else (phi[t] @ w) * phi[t]
        theta = theta + alpha * (along - bootstrap)
        w = w + beta * (delta * e - (phi[t] @ w) * phi[t])
    assert learner.theta[0] == pytest.approx(theta, rel=0, abs=1e-12)
    assert learner.second[0] == pytest.approx(w, rel=0, abs=1e-12)


@pytest.mark.parametrize("correction", CORRECTIONS)
@pytest.mark.parametrize("trace_decay", [0.0, 0.4, 1.0])
def test_a_known_chain_is_learned(correction: str, trace_decay: float) -> None:
    # As in test_td, with gamma = 0.5: V(4) = 0.3 / 0.5 = 0.6, 0.3, -2 + 0.15, -0.925, 0.5375.
    table = RuleBase([Partition((0.0, 1.0, 2.0, 3.0, 4.0), "triangular")], [(0,)])
    settings = GradientTDSettings(
        correction=correction, step_size=0.3, second_step_size=0.3, discount=0.5,
        trace_decay=trace_decay,
    )  # fmt: skip
    learner = GradientTD(settings, table, np.arange(1))
    for _ in range(1500):
        feed(learner, np.arange(5.0)[:, None], np.array([1.0, 0.0, -2.0, 0.0, 0.3]), True)
    assert learner.theta[0] == pytest.approx([0.5375, -0.925, -1.85, 0.3, 0.6], rel=0, abs=1e-10)
    assert learner.second[0] == pytest.approx(np.zeros(5), abs=1e-10)


@pytest.mark.parametrize("correction", CORRECTIONS)
def test_it_converges_where_td_diverges(correction: str) -> None:
    # One transition over and over, phi = (0.6, 0.4) to phi' = (1, 0), gamma = 0.95: TD(0) has
    # phi'(gamma phi' - phi) = 0.57 - 0.52 > 0 and runs away, since what it changes is never
    # visited. Gradient TD finds weights without a TD error.
    rules = RuleBase([Partition((0.0, 1.0), "triangular")], [(0,)])
    states, rewards, gamma = np.array([[0.4], [0.0]]), np.array([1.0, 0.0]), 0.95
    td = TDLambda(
        TDLambdaSettings(step_size=0.5, trace_decay=0.0, discount=gamma), rules, np.arange(1)
    )
    gradient = GradientTD(
        GradientTDSettings(
            correction=correction, step_size=0.1, second_step_size=1.0, trace_decay=0.0,
            discount=gamma,
        ),
        rules, np.arange(1),
    )  # fmt: skip
    for _ in range(4000):
        feed(td, states, rewards, False)
        feed(gradient, states, rewards, False)
    f = rules.values(gradient.theta[0], states)
    assert 1.0 + gamma * f[1] - f[0] == pytest.approx(0.0, abs=1e-8)
    assert np.abs(td.theta).max() > 1e6


def test_agents_learn_each_on_its_own() -> None:
    rng = np.random.default_rng(2)
    states, rewards = rng.uniform(-1, 1, (8, 3, 2)), rng.normal(size=8)
    team = GradientTD(GradientTDSettings(), FUZZY, np.arange(3))
    permuted, order = GradientTD(GradientTDSettings(), FUZZY, np.arange(3)), [2, 0, 1]
    for t in range(8):
        team.observe(states[t], rewards[t], t == 7)
        permuted.observe(states[t, order], rewards[t], t == 7)
    assert (permuted.theta == team.theta[order]).all()
    alone = GradientTD(GradientTDSettings(), FUZZY, np.arange(1))
    for t in range(8):
        alone.observe(states[t, 1:2], rewards[t], t == 7)
    assert alone.theta[0] == pytest.approx(team.theta[1], rel=0, abs=1e-14)
