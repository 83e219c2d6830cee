"""Agents that perceive for themselves: what each takes for its state, and predicts from there."""

import numpy as np
import pytest

from nested_agents.core.interface.abilities import PartiallyObserved
from nested_agents.core.plugins.settings import PerceptionSettings
from nested_agents.scenarios.faults.perception import distances_of, perceived
from nested_agents.scenarios.line_up import LineUpSettings

NOTHING = np.zeros(3, dtype=int)


def carts(*settings: PerceptionSettings):
    return perceived(LineUpSettings(carts=3).build(), settings)


def every(scenario) -> np.ndarray:
    return np.random.default_rng(0).integers(len(scenario.action_set), size=(20, 3))


def test_who_perceives_all_as_it_is_predicts_what_is_predicted() -> None:
    plain, scenario = carts(), carts(PerceptionSettings(agents="*"))
    assert not isinstance(plain, PartiallyObserved)
    assert isinstance(scenario, PartiallyObserved)
    np.testing.assert_array_equal(scenario.reset(4), plain.reset(4))
    joint = every(plain)
    for agent in range(3):
        mine = scenario.predict().of(agent)
        for other in range(3):
            expected = plain.predict().states(other, joint)
            np.testing.assert_array_equal(mine.states(other, joint), expected)


def test_noise_is_that_of_the_agents_named_and_stays_paired() -> None:
    plain = carts()
    one = carts(PerceptionSettings(agents=plain.agents[1], noise=0.1))
    all_ = carts(PerceptionSettings(agents="*", noise=0.1))
    truth, own, every_one = (scenario.reset(4) for scenario in (plain, one, all_))
    np.testing.assert_array_equal(own[[0, 2]], truth[[0, 2]])
    assert (own[1] != truth[1]).all()
    np.testing.assert_array_equal(own[1], every_one[1])
    np.testing.assert_array_equal(one.reset(4), own)
    joint = every(plain)
    shift = own[1] - truth[1]
    predicted = plain.predict().states(1, joint) + shift
    np.testing.assert_allclose(one.predict().of(1).states(1, joint), predicted)


def test_the_noise_has_the_deviation_that_is_said() -> None:
    plain, noisy = carts(), carts(PerceptionSettings(agents="*", noise=0.1))
    width = plain.state_space.ranges[1]
    off = np.array([(noisy.reset(i) - plain.reset(i)) / width for i in range(400)])
    assert np.std(off) == pytest.approx(0.1, rel=0.06)


def test_who_is_late_predicts_from_where_it_was() -> None:
    plain, late = carts(), carts(PerceptionSettings(agents="*", delay=2))
    states = [plain.reset(1)]
    seen = [late.reset(1)]
    for _ in range(4):
        states.append(plain.step(NOTHING).states)
        seen.append(late.step(NOTHING).states)
    for step, was in enumerate((0, 0, 0, 1, 2)):
        np.testing.assert_allclose(seen[step], states[was])
    joint = every(plain)
    change = plain.predict().states(0, joint) - states[4][0]
    np.testing.assert_allclose(late.predict().of(0).states(0, joint), states[2][0] + change)


def test_bodies_out_of_reach_or_lost_are_taken_to_do_nothing() -> None:
    near = carts(PerceptionSettings(agents="*", reach=1))
    np.testing.assert_array_equal(near.perceived, [[0, 1, 0], [1, 0, 1], [0, 1, 0]])
    assert [near.unperceived(agent).tolist() for agent in range(3)] == [[2], [], [0]]
    names = near.agents
    lost = carts(PerceptionSettings(agents=names[0], lost=(names[1], names[2])))
    assert lost.unperceived(0).tolist() == [1, 2]
    plain = carts()
    plain.reset(0)
    lost.reset(0)
    joint = every(plain)
    alone = joint.copy()
    alone[:, 1:] = plain.action_set.neutral
    expected = plain.predict().states(0, alone)
    np.testing.assert_array_equal(lost.predict().of(0).states(0, joint), expected)


def test_distances_follow_interactions() -> None:
    scenario = LineUpSettings(carts=3).build()
    scenario.interactions = [(0, 2)]
    np.testing.assert_array_equal(distances_of(scenario)[0], [0, np.inf, 1])


@pytest.mark.parametrize("key", ["agents", "lost"])
def test_who_is_not_there_is_named(key: str) -> None:
    settings = PerceptionSettings(**{"agents": "*", key: "nobody"})
    with pytest.raises(ValueError, match=rf"scenario\.perception\[0\]\.{key} = 'nobody': no such"):
        carts(settings)
