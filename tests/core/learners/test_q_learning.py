"""Q-learning against numbers worked by hand, and against the optimum of a small problem."""

import numpy as np
import pytest

from nested_agents.core.interface.spaces import StateSpace, Variable
from nested_agents.core.learners.td import QLearningSettings
from nested_agents.core.values.rule_base import RuleBase, RuleBaseSettings

PLACE = Variable("place", "1", 0, 2, centers=(0.0, 1.0, 2.0))
MOVE = Variable("move", "1", 0, 1, centers=(0.0, 1.0))
SPACE = StateSpace("walk", (MOVE, PLACE), 1, actions=("move",))
FULL = RuleBaseSettings(order="full")


def learner(**settings):
    rules = RuleBase.build(SPACE, FULL)
    return QLearningSettings(rule_base=FULL, **settings).build(rules, np.array([0]))


def test_one_update_by_hand() -> None:
    q = learner(step_size=0.5, discount=0.9)
    table = q.theta.reshape(2, 3)  # move, place
    table[:, 1] = 2.0, 4.0
    q.begin_episode()
    q.observe(np.array([[0.0, 0.0]]), 1.0, False)
    q.observe(np.array([[0.0, 1.0]]), 0.0, False)  # takes the worse move: the better one counts
    assert table[0, 0] == pytest.approx(0.5 * (1.0 + 0.9 * 4.0))


def test_it_finds_the_action_values_whatever_is_done() -> None:
    """A walk on three places, right pays 1 at the end, by random moves: off-policy."""
    q = learner(step_size=0.5, discount=0.5)
    rng = np.random.default_rng(0)
    q.begin_episode()
    place = 0
    for _ in range(3000):
        move = int(rng.integers(2))
        after = min(place + 1, 2) if move else max(place - 1, 0)
        q.observe(np.array([[move, place]], dtype=float), float(move and place == 2), False)
        place = after
    # Staying at the right end pays 1 for ever, which is worth 2.
    np.testing.assert_allclose(q.theta.reshape(2, 3)[1], [0.5, 1.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(q.theta.reshape(2, 3)[0], [0.25, 0.25, 0.5], atol=1e-6)


def test_a_state_space_without_actions_is_refused() -> None:
    bare = StateSpace("walk", (MOVE, PLACE), 1)
    with pytest.raises(ValueError, match="includes no actions to maximize over, use td-lambda"):
        QLearningSettings().build(RuleBase.build(bare, FULL), np.array([0]))
