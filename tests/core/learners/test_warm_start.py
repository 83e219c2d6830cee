"""A learner goes on from what another one has learned, to the last bit, and with other agents."""

import numpy as np
import pytest

from nested_agents.core.learners.batch import REWARD_SCALE, BatchTD, BatchTDSettings
from nested_agents.core.learners.learner import Learner
from nested_agents.core.learners.td import Frozen, FrozenSettings

from .test_shared_weights import LEARNING, ROLES, experience, feed, learner_of, rules_of


@pytest.fixture(params=LEARNING)
def name(request: pytest.FixtureRequest) -> str:
    return request.param


def followed(former: Learner, name: str, rows: np.ndarray, goes_on: list[int]):
    """A learner for agents of these rows that takes over from `former`."""
    learner = learner_of(name, rows)
    learner.warm_start(former, np.array(goes_on))
    return learner


def test_a_successor_of_the_same_agents_goes_on_as_if_nothing_had_happened(name: str) -> None:
    states, rewards = experience()
    whole, former = (learner_of(name, ROLES) for _ in range(2))
    for learner in (whole, former):
        feed(learner, states, rewards)
    successor = followed(former, name, ROLES, [0, 1])
    before = former.theta.copy()
    for learner in (whole, successor):
        feed(learner, states[::-1], rewards)
    assert (successor.theta == whole.theta).all()
    assert (former.theta == before).all()


def test_rows_go_on_from_the_rows_that_they_are_told(name: str) -> None:
    states, rewards = experience()
    former = learner_of(name, ROLES)
    feed(former, states, rewards)
    turned = followed(former, name, np.array([0, 1]), [1, 0])
    assert (turned.theta == former.theta[[1, 0]]).all()
    straight = followed(former, name, np.array([0, 1]), [0, 1])
    feed(turned, states[:, [0, 1]], rewards[:, [0, 1]])
    feed(straight, states[:, [1, 0]], rewards[:, [1, 0]])
    assert (turned.theta == straight.theta[[1, 0]]).all()


def test_what_was_taken_over_is_restored_to_the_bit(name: str) -> None:
    states, rewards = experience()
    former = learner_of(name, ROLES)
    feed(former, states, rewards)
    learner = followed(former, name, np.array([0, 1]), [0, 1])
    feed(learner, states[:4, :2], rewards[:4, :2])
    restored = learner_of(name, np.array([0, 1]))
    restored.load_state_dict({key: array.copy() for key, array in learner.state_dict().items()})
    for each in (learner, restored):
        feed(each, states[4:, 1:], rewards[4:, 1:])
    assert (learner.theta == restored.theta).all()


def test_batch_td_regresses_on_all_experience_of_teams_of_any_size() -> None:
    # gamma = 0: the targets are the rewards. Weights (X'X + ridge 1)^-1 X'y over all agents.
    settings = BatchTDSettings(
        ridge=0.5, discount=0.0, regression_iterations=1, target_averaging_rate=1.0
    )
    rules = rules_of()
    states, rewards = experience()
    teams = [BatchTD(settings, rules, np.zeros(n, dtype=int)) for n in (1, 3, 2)]
    for before, after in zip([None, *teams], teams, strict=False):
        n = len(after.rows)
        if before is not None:
            after.warm_start(before, np.array([0]))
        feed(after, states[:, :n], rewards[:, :n])
    met = [i for n in (1, 3, 2) for i in range(n)]
    x = rules.features(np.concatenate([states[:, i] for i in met]))
    y = REWARD_SCALE * np.concatenate([rewards[:, i] for i in met])
    expected = np.linalg.solve(x.T @ x + 0.5 * np.eye(rules.n_rules), x.T @ y) / REWARD_SCALE
    assert teams[-1].theta[0] == pytest.approx(expected, rel=0, abs=1e-13)


def test_weights_that_never_learn_are_handed_on() -> None:
    former, successor = (
        Frozen(FrozenSettings(), rules_of(), rows) for rows in (ROLES, np.array([1, 0]))
    )
    former.theta[:] = [[1.0], [2.0]]
    successor.warm_start(former, np.array([1, 0]))
    assert successor.theta[:, 0].tolist() == [2.0, 1.0]
