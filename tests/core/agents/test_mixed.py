"""Teams of several kinds of agents, and what a team hands on of what it experiences."""

from itertools import pairwise

import numpy as np
import pytest
from acting import fuzzy, look

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import LostMessages
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.hierarchy.stages import communication_levels, decision_stages
from nested_agents.core.interface.experience import Experience
from nested_agents.core.interface.scenario import Transition
from nested_agents.core.learners import LEARNERS
from nested_agents.core.learners.fitted_q import FittedQSettings
from nested_agents.core.learners.td import TDLambdaSettings
from nested_agents.core.search.enumeration import ExactEnumeration, Sampling
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings

TD = {"kind": "td-lambda", "step_size": 0.1}


def mixed(*parts: tuple[str | list[str], dict]):
    table = {"kind": "mixed", "parts": [{"agents": a, "learner": table} for a, table in parts]}
    return LEARNERS.model("mixed").model_validate(table)


def chain_of(agents) -> Hierarchy:
    return Hierarchy(agents, list(pairwise(agents)))


@pytest.fixture
def world(line_world):
    return line_world(carts=2, wheels=2)


@pytest.mark.parametrize(
    ("names", "members"),
    [
        (["cart0.*", "cart1.*"], [[0, 1], [2, 3]]),
        ([["cart0", "cart1.wheel1"], "*"], [[0, 1, 3], [2]]),
        (["level1", "level3", "level*"], [[0], [2], [1, 3]]),
    ],
)
def test_agents_are_of_the_first_part_that_names_them(names, members, world) -> None:
    settings = mixed(*((name, TD) for name in names))
    team = Team(settings, world, chain_of(world.agents), policy_seed(0))
    assert [part.members.tolist() for part in team.parts] == members


def test_parts_by_role(world) -> None:
    world.roles = ("front", "rear") * 2
    team = Team(mixed(("rear", TD), ("front", TD)), world, chain_of(world.agents), policy_seed(0))
    assert [part.members.tolist() for part in team.parts] == [[1, 3], [0, 2]]


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ((("cart0", TD),), r"learner\.parts: agent 'cart1\.wheel0' belongs to no part"),
        ((("*", TD), ("cart1", TD)), r"learner\.parts\[1\]\.agents = \['cart1'\]: lists no agent"),
        (
            (("cart0", TD), (["cart1", "cart0.wheel1"], TD)),
            r"learner\.parts\[1\].* agent 'cart0\.wheel1' belongs to learner\.parts\[0\] already",
        ),
        (
            (("cart0", {**TD, "decision": {"value_of": "below"}}), ("*", TD)),
            r"value_of = 'below': values of 'cart1\.wheel0' are unknown to 'cart0\.wheel0'",
        ),
    ],
)
def test_parts_that_cannot_be_are_refused(parts, said: str, world) -> None:
    with pytest.raises(ValueError, match=said) as caught:
        Team(mixed(*parts), world, chain_of(world.agents), policy_seed(0))
    assert "\n" not in str(caught.value)


def test_every_part_draws_by_itself(world) -> None:
    team = Team(mixed(("cart0", TD), ("*", TD)), world, chain_of(world.agents), policy_seed(0))
    first, second = (part.rng.integers(2**60, size=4).tolist() for part in team.parts)
    assert first != second


def test_frozen_leaders_and_followers_that_learn(world, tmp_path) -> None:
    settings = mixed(("cart0", {"kind": "frozen"}), ("cart1", TD))
    team = Team(settings, world, chain_of(world.agents), policy_seed(0))
    list(control_loop(world, team, episodes=2, steps=10, seed=0))
    leaders, followers = team.parts
    assert not leaders.learner.theta.any()
    assert followers.learner.theta.shape[0] == 2
    assert (np.abs(followers.learner.theta).sum(axis=1) > 0).all()
    team.save(tmp_path / "team.npz")
    other = Team(settings, world, chain_of(world.agents), policy_seed(1))
    other.load(tmp_path / "team.npz")
    assert (other.parts[1].learner.theta == followers.learner.theta).all()
    successor = Team(settings, world, chain_of(world.agents), policy_seed(2))
    successor.warm_start(team)
    assert (successor.parts[1].learner.theta == followers.learner.theta).all()


@pytest.fixture
def taken_in(monkeypatch):
    """Return a function that lets agents learn nothing, and lists what they would learn from."""

    def watch(part) -> list:
        calls: list = []
        monkeypatch.setattr(part.learner, "observe_decision", lambda *own: calls.append(own) or 0)
        return calls

    return watch


def test_every_part_is_paid_its_own_rewards(world, taken_in) -> None:
    team = Team(mixed(("cart1", TD), ("*", TD)), world, chain_of(world.agents), policy_seed(0))
    states = world.reset(0)
    decision = team.act(look(world, states))
    calls = [taken_in(part) for part in team.parts]
    paid = Transition(states, np.array([1.0, 2.0, 3.0, 4.0]), False, False, {})
    team.learn(Experience(look(world, states), decision, paid, last=False))
    for (call,), members in zip(calls, ([2, 3], [0, 1]), strict=True):
        left, taken, entered, rewards, _, duration = call
        assert duration == 1
        assert rewards.tolist() == [1.0 + member for member in members]
        assert taken.tolist() == decision.joint_action[members].tolist()
        assert (left[:, : states.shape[1]] == states[members]).all()
        assert (entered == states[members]).all()


def test_mirror_images_of_agents_do_what_these_do(taken_in) -> None:
    world = BoxPushingSettings(robots=2).build()
    silent = Hierarchy(world.agents, [])
    team = Team(FittedQSettings(mirrored=True), world, silent, policy_seed(0))
    seen = look(world, world.reset(0))
    (calls,) = [taken_in(part) for part in team.parts]
    decision = team.act(seen)
    joint = decision.joint_action
    team.learn(Experience(seen, decision, world.step(joint), last=False))
    ((_, taken, *_),) = calls
    assert taken.tolist() == [*joint.tolist(), *joint.tolist()]


def test_a_team_of_equal_parts_decides_as_one_of_one_kind(world) -> None:
    """What is told passes from part to part: with own values it is the same decision."""
    joints = []
    for settings in (mixed(("cart0", TD), ("cart1", TD)), LEARNERS.model("td-lambda")(**TD)):
        team = Team(settings, world, chain_of(world.agents), policy_seed(0))
        rng = np.random.default_rng(3)
        theta = rng.normal(size=(4, 15))
        for part in team.parts:
            part.learner.theta[:] = theta[part.members]
        world.reset(1)
        joints.append([])
        world.step(np.zeros(4, dtype=int))
        for _ in range(2):  # at 0.6 and 0.9 of the greatest speed no two actions come to the same
            states = world.step(np.zeros(4, dtype=int)).states
            joints[-1].append(team.act(look(world, states), explore=False).joint_action.tolist())
    assert joints[0] == joints[1]


def test_slots_follow_who_is_told() -> None:
    tree = Hierarchy("abcd", [("a", "b"), ("a", "c"), ("c", "d")])
    assert communication_levels(tree) == [0, 1, 1, 2]
    parts = [0, 1, 0, 1]
    together = [slot.agents.tolist() for slot in decision_stages(tree, parts, [True, True])]
    assert together == [[0], [2], [1], [3]]
    one_by_one = decision_stages(tree, [0] * 4, [False])
    assert [slot.agents.tolist() for slot in one_by_one] == [[0], [1], [2], [3]]
    assert one_by_one[3].senders.tolist() == [0, 2]
    assert one_by_one[3].receivers.tolist() == [3, 3]
    silent = Hierarchy("abc", [("a", "b"), ("b", "c")], communication="none")
    assert [slot.agents.tolist() for slot in decision_stages(silent, [0] * 3, [True])] == [
        [0, 1, 2]
    ]


@pytest.mark.parametrize(
    "keys",
    [
        {"decision": {"teammates": "empirical"}},
        {"exploration": {"kind": "boltzmann", "max_temperature": 0.5}},
        {"exploration": {"kind": "burst", "rate": 1.0, "decay": 1.0}},
    ],
)
def test_in_an_evaluation_by_sampled_actions_only_stochastic_policies_draw(keys, world) -> None:
    policy = {"kind": "hierarchy-ppo", "rollout": 8, "batch_size": 4}
    settings = mixed(("cart1", policy), ("*", {**TD, **keys}))
    team = Team(settings, world, chain_of(world.agents), policy_seed(0))
    list(control_loop(world, team, episodes=2, steps=5, seed=0))
    before = {name: array.copy() for name, array in team.state_dict().items()}
    drawing, other = team.parts
    other.explorer.choose = None  # nobody calls it
    list(control_loop(world, team, episodes=4, steps=5, seed=0, learn=False, explore=True))
    after = team.state_dict()
    for name in before:
        if not name.endswith("generator"):
            np.testing.assert_array_equal(after[name], before[name], name)
    drawn = f"part{team.parts.index(drawing)}.generator"
    assert (after[drawn] != before[drawn]).any()


def test_a_reward_of_a_terminal_state_that_does_not_absorb_is_received_once(world) -> None:
    """Its value is the reward itself, not that of receiving it for ever."""
    gamma = 0.9
    settings = TDLambdaSettings(step_size=1.0, normalized=True, discount=gamma, trace_decay=0.0)
    for absorbing, value in ((False, 2.0), (True, 2.0 / (1.0 - gamma))):
        team = Team(settings, world, chain_of(world.agents), policy_seed(0))
        states = world.reset(0)
        team.reset(0, 0, learn=True)
        seen = look(world, states)
        ended = Transition(states, 2.0, True, False, {}, absorbing=absorbing)
        team.learn(Experience(seen, team.act(seen), ended, last=True))
        values = fuzzy(team).rules.values_of_agents(fuzzy(team).learner.theta, states[:, None])[
            :, 0
        ]
        assert values == pytest.approx(value)


@pytest.mark.parametrize(("exact_up_to", "kind"), [(4, ExactEnumeration), (3, Sampling)])
def test_as_many_free_agents_as_allowed_are_enumerated(exact_up_to, kind, world) -> None:
    """The first of four agents is free with three below it."""
    evaluator = {"kind": "auto", "exact_up_to": exact_up_to, "sampling_up_to": 12}
    decision = DecisionSettings.model_validate({"evaluator": evaluator})
    settings = TDLambdaSettings(decision=decision)
    team = Team(settings, world, chain_of(world.agents), policy_seed(0))
    assert type(fuzzy(team).evaluator) is kind


def test_frequencies_of_a_role_are_the_mean_of_its_agents(line_world) -> None:
    small, large = line_world(2, 1), line_world(3, 1)
    for world in (small, large):
        world.roles = ("cart",) * len(world.agents)
    settings = TDLambdaSettings(weights="role")
    former = Team(settings, small, chain_of(small.agents), policy_seed(0))
    former.only(FuzzyAgents).action_counts.totals = np.array(
        [[4.0, 0.0, 2.0, 2.0], [0.0, 8.0, 0.0, 0.0]]
    )
    successor = Team(settings, large, chain_of(large.agents), policy_seed(1))
    successor.warm_start(former)
    assert fuzzy(successor).action_counts.totals.tolist() == [[2.0, 4.0, 1.0, 1.0]] * 3


def test_messages_between_parts_fail_too(world) -> None:
    lost = LostMessages(agents="cart0.*")
    settings = mixed(("cart0", TD), ("cart1", {"kind": "fitted-q"}))
    team = Team(settings, world, chain_of(world.agents), policy_seed(0), [lost])
    team.reset(0, 0)
    decision = team.act(look(world, world.reset(0)))
    neutral = world.action_set.neutral
    told = decision.inputs[1].left[2, world.state_space.n_variables :]
    assert told[:2].tolist() == [neutral, neutral]
