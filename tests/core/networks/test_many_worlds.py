"""PPO in many worlds: its gradients, its advantages, that it goes on to the same bits."""

import numpy as np
import pytest
from nested_agents_spread import SpreadSettings

from nested_agents.core.agents.loop import policy_seed
from nested_agents.core.agents.many_environments import ManyEnvironmentsLoop
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import LeftAgents
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.experience import Observation
from nested_agents.core.networks.many_worlds import Batch, NetworkPolicy, estimate, share_left
from nested_agents.core.networks.perceptron import RunningMoments, orthogonal
from nested_agents.core.networks.settings import (
    HierarchyPPOSettings,
    IPPOSettings,
    MAPPOSettings,
)

SMALL = {"environments": 4, "rollout": 10, "batch_size": 30, "epochs": 2, "hidden": (8,)}
AGENTS = ("agent1", "agent2", "agent3")
CHAIN = Hierarchy(AGENTS, [("agent1", "agent2"), ("agent2", "agent3")])


def team_of(settings, seed=0):
    world = SpreadSettings().build()
    return Team(settings, world, CHAIN, policy_seed(seed))


def loop_of(team, settings, seed=0):
    world = SpreadSettings(most_decisions=7).build()
    return ManyEnvironmentsLoop(world.environments(settings.environments), world, team, 1000, seed)


def weights(team):
    return np.concatenate([policy.weights for policy in team.parts[0].policies.values()])


def test_gradients_agree_with_finite_differences():
    settings = HierarchyPPOSettings(**SMALL | {"hidden": (5, 4)})
    rng = np.random.default_rng(0)
    policy = NetworkPolicy(settings, np.arange(2), (6, 4, 3, 5), rng)
    own = policy.actor.n_weights
    wide = rng.normal(size=policy.weights.size) * 0.5
    gradient = np.zeros_like(wide)
    policy.actor.lie_in(wide[:own], gradient[:own])
    policy.critic.lie_in(wide[own:], gradient[own:])
    m = 40
    batch = Batch(
        rng.normal(size=(m, 6)), rng.normal(size=(m, 7)), rng.integers(0, 5, m),
        np.log(rng.uniform(0.1, 0.4, m)), rng.normal(size=m), rng.normal(size=m),
    )  # fmt: skip
    policy.slope(batch, 0.3)
    by_hand = gradient.copy()
    for k in rng.choice(wide.size, 60, replace=False):
        ends = []
        for step in (1e-6, -1e-6):
            wide[k] += step
            ends.append(policy.slope(batch, 0.3))
            wide[k] -= step
        assert by_hand[k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=2e-6)


def test_advantages_by_hand():
    settings = HierarchyPPOSettings(discount=0.5, gae_lambda=0.5)
    rewards = np.array([1.0, 2.0, 4.0])[:, None, None]
    values = np.array([1.0, 1.0, 2.0])[:, None, None]
    last = np.array([False, True, False])[:, None]
    got = estimate(rewards, values, np.array([[8.0]]), last, settings).ravel()
    # 4 + 0.5 8 - 2; an end: 2 - 1; 1 + 0.5 1 - 1 + 0.25 1
    assert got.tolist() == [0.75, 1.0, 6.0]


def test_moments_are_those_of_all_numbers():
    parts = [np.arange(5.0), np.array([[10.0, -3.0]]), np.full(3, 2.0)]
    moments = RunningMoments()
    for part in parts:
        moments.add(part)
    every = np.concatenate([part.ravel() for part in parts])
    assert moments.mean == pytest.approx(every.mean(), abs=1e-3)
    assert moments.deviation == pytest.approx(every.std(), abs=1e-2)


@pytest.mark.parametrize("shape", [(3, 7), (7, 3), (4, 4)])
def test_orthogonal(shape):
    drawn = orthogonal(np.random.default_rng(0), *shape)
    short = drawn @ drawn.T if shape[0] <= shape[1] else drawn.T @ drawn
    assert np.allclose(short, np.eye(min(shape)))


@pytest.mark.parametrize("extra", [{}, {"normalised": "values", "learning_rate_decisions": 200}])
@pytest.mark.parametrize("kind", [HierarchyPPOSettings, MAPPOSettings, IPPOSettings])
def test_same_seed_same_bits_also_where_a_kept_team_goes_on(kind, extra):
    settings = kind(**SMALL, **extra)
    straight, broken = team_of(settings), team_of(settings)
    loop = loop_of(straight, settings)
    other = loop_of(broken, settings)
    for _ in range(13):
        loop.step()
        other.step()
    resumed = team_of(settings, seed=5)
    resumed.restore({name: array.copy() for name, array in broken.arrays().items()})
    other._team = resumed
    for _ in range(13):
        loop.step()
        other.step()
    assert np.array_equal(weights(straight), weights(resumed))
    assert np.array_equal(loop._states, other._states)


def test_many_worlds_decide_as_each_by_itself_and_in_any_order():
    settings = HierarchyPPOSettings(**SMALL)
    team = team_of(settings)
    world = SpreadSettings().build()
    states = np.stack([world.reset(seed) for seed in range(9)])
    together = team.act(Observation(states, world), explore=False).joint_action
    alone = [team.act(Observation(own, world), explore=False).joint_action for own in states]
    assert np.array_equal(together, np.stack(alone))
    order = np.random.default_rng(0).permutation(9)
    mixed = team.act(Observation(states[order], world), explore=False).joint_action
    assert np.array_equal(mixed, together[order])


def test_permuting_agents_permutes_what_they_do():
    team = team_of(IPPOSettings(**SMALL, numbered=False))
    world = SpreadSettings().build()
    states = np.stack([world.reset(seed) for seed in range(9)])
    plain = team.act(Observation(states, world), explore=False).joint_action
    order = np.array([2, 0, 1])
    mixed = team.act(Observation(states[:, order], world), explore=False).joint_action
    assert np.array_equal(mixed, plain[:, order])


def test_what_is_learned_does_not_depend_on_the_order_of_worlds_and_agents():
    policy = team_of(HierarchyPPOSettings(**SMALL)).parts[0].policies["all"]
    rng = np.random.default_rng(0)
    m = 3 * 50
    width = policy.actor.sizes[0], policy.critic.sizes[0]
    batch = Batch(
        rng.normal(size=(m, width[0])), rng.normal(size=(m, width[1])), rng.integers(0, 5, m),
        np.log(rng.uniform(0.1, 0.4, m)), rng.normal(size=m), rng.normal(size=m),
    )  # fmt: skip
    loss = policy.slope(batch, 0.01)
    gradient = policy.gradient.copy()
    assert policy.slope(batch.rows(rng.permutation(m)), 0.01) == pytest.approx(loss, abs=1e-6)
    assert np.allclose(policy.gradient, gradient, rtol=0.0, atol=1e-6)


def test_what_is_told_is_seen():
    team = team_of(HierarchyPPOSettings(**SMALL))
    world = SpreadSettings().build()
    states = np.stack([world.reset(seed) for seed in range(4)])
    decision = team.act(Observation(states, world))
    told = decision.inputs[0].seen[:, :, : team.parts[0].width]
    assert not told[:, 0].any()
    assert (told[:, 1, :5].argmax(axis=1) == decision.joint_action[:, 0]).all()
    assert (told.sum(axis=2) == [0, 1, 2]).all()


def test_bad_input():
    with pytest.raises(ValueError, match="needs environments, 2 or more"):
        HierarchyPPOSettings(normalised="values")
    with pytest.raises(ValueError, match="messages may fail in one environment only"):
        Team(
            HierarchyPPOSettings(**SMALL), SpreadSettings().build(), CHAIN, policy_seed(0),
            (LeftAgents(agents=("agent1",), episode=1),),
        )  # fmt: skip


def test_what_falls():
    assert share_left(50, 100) == 0.5
    assert share_left(50, None) == 1.0
