"""The control loop: numbering, ends of episodes, paired worlds, determinism, learning.

One agent per robot, one agent for the team: the same world, told in other words.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.agents.joint import Granularity, JointPrediction, join_agents
from nested_agents.core.agents.loop import StepRecord, control_loop, policy_seed, world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.abilities import Embodiment
from nested_agents.core.interface.scenario import Scenario
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.learners.td import FrozenSettings, TDLambdaSettings
from nested_agents.core.models.self_model import SelfModelSettings
from nested_agents.core.search.exploration import BurstExploration
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.core.values.rule_base import RuleBaseSettings
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.checking.checker import check_scenario
from nested_agents.topologies import build

LEARNING = TDLambdaSettings(step_size=0.1)


@pytest.fixture
def world(line_world):
    return line_world(carts=2, wheels=1)


def team_of(world, settings=LEARNING, seed: int = 5) -> Team:
    hierarchy = Hierarchy(world.agents, [world.agents])
    return Team(settings, world, hierarchy, policy_seed(seed))


def run(world, team: Team, **changes: object) -> list[StepRecord]:
    arguments = {"episodes": 3, "steps": 10, "seed": 5, **changes}
    return list(control_loop(world, team, **arguments))  # type: ignore[arg-type]


def bits(records: list[StepRecord]) -> list[tuple]:
    return [
        (r.episode, r.step, r.last, r.states.tobytes(), r.joint_action.tobytes(),
         r.transition.states.tobytes(), r.transition.reward)
        for r in records
    ]  # fmt: skip


def by_episode(records: list[StepRecord]) -> Iterator[list[StepRecord]]:
    for episode in sorted({r.episode for r in records}):
        yield [r for r in records if r.episode == episode]


def test_records_are_numbered_and_linked(world) -> None:
    records = run(world, team_of(world), first_episode=7)
    assert [(r.episode, r.step) for r in records] == [(e, s) for e in (7, 8, 9) for s in range(10)]
    assert [r.last for r in records] == ([False] * 9 + [True]) * 3
    for episode in by_episode(records):
        first = world.reset(world_seed(5, episode[0].episode))
        assert (episode[0].states == first).all()
        for before, after in pairwise(episode):
            assert (before.transition.states == after.states).all()
    for record in records:
        assert record.states.shape == (2, 3)
        assert record.joint_action.shape == (2,)
        assert record.deciding > 0 <= record.learning


def test_a_terminal_state_ends_the_episode(line_world) -> None:
    records = run(line_world(2, 1, closed=0.7), team_of(line_world(2, 1)), episodes=12)
    ends = [episode[-1] for episode in by_episode(records)]
    assert len(ends) == 12
    assert any(end.transition.terminated and end.step < 9 for end in ends)
    assert any(not end.transition.terminated and end.step == 9 for end in ends)
    for record in records:
        assert record.last == (record.transition.terminated or record.step == 9)


def test_a_truncated_episode_ends(line_world) -> None:
    class Hasty(line_world):
        def reset(self, seed, episode=0):
            self.left = 4
            return super().reset(seed, episode)

        def step(self, joint_action):
            self.left -= 1
            return replace(super().step(joint_action), truncated=self.left == 0)

    records = run(Hasty(2, 1), team_of(Hasty(2, 1)))
    assert [r.step for r in records if r.last] == [3, 3, 3]


def test_nothing_happens_before_it_is_asked_for(world) -> None:
    records = control_loop(world, team_of(world), episodes=1, steps=3, seed=0)
    assert not hasattr(world, "gap")
    next(records)
    assert hasattr(world, "gap")


@pytest.mark.parametrize("settings", [LEARNING, BatchTDSettings(), FrozenSettings()])
def test_same_seed_same_bits(settings, line_world) -> None:
    runs = []
    for _ in range(2):
        world = line_world(2, 1)
        runs.append(bits(run(world, team_of(world, settings))))
    assert runs[0] == runs[1]


def test_worlds_depend_on_seed_and_episode_only(world) -> None:
    def starts(settings, team_seed: int, **changes: object) -> list[bytes]:
        records = run(world, team_of(world, settings, team_seed), **changes)
        return [r.states.tobytes() for r in records if r.step == 0]

    here = starts(LEARNING, 5)
    assert here == starts(FrozenSettings(), 8, steps=3)
    assert here[1:] == starts(LEARNING, 5, first_episode=1, episodes=2)
    assert len({*here, *starts(LEARNING, 5, seed=6)}) == 6


def test_seeds_of_worlds_and_policies_are_distinct() -> None:
    seeds = [world_seed(s, e) for s in range(3) for e in range(50)]
    seeds += [policy_seed(s) for s in range(3)]
    assert len({tuple(seed.generate_state(4)) for seed in seeds}) == 153


@pytest.mark.parametrize("settings", [LEARNING, BatchTDSettings(ridge=0.1)])
def test_a_run_in_two_parts_is_the_run_in_one(settings, world, tmp_path: Path) -> None:
    whole = bits(run(world, team_of(world, settings), episodes=4))
    team = team_of(world, settings)
    parts = bits(run(world, team, episodes=2))
    team.save(tmp_path / "team.npz")
    team = team_of(world, settings, seed=77)
    team.load(tmp_path / "team.npz")
    parts += bits(run(world, team, episodes=2, first_episode=2))
    assert parts == whole


def test_worlds_may_be_numbered_apart_from_episodes(world) -> None:
    begun = []
    reset = world.reset
    world.reset = lambda seed, episode: (begun.append((seed.spawn_key, episode)), reset(seed))[1]
    run(world, team_of(world, LEARNING), episodes=2, first_episode=3, first_world=70)
    assert begun == [((0, 70), 3), ((0, 71), 4)]


@pytest.mark.parametrize("settings", [LEARNING, BatchTDSettings(ridge=0.1)])
def test_evaluation_leaves_what_was_learned_alone(settings, world) -> None:
    team = team_of(world, settings)
    run(world, team)
    before = {k: v.copy() for k, v in team.state_dict().items() if k != "generator"}
    updates = fuzzy(team).evaluator.counts.weight_updates
    assert updates > 0
    run(world, team, learn=False)
    after = team.state_dict()
    assert all((after[k] == v).all() for k, v in before.items())
    assert fuzzy(team).evaluator.counts.weight_updates == updates


def test_a_team_learns_to_push(line_world) -> None:
    # The load starts up to 1.5 m from the goal and moves at most 0.1 m a step.
    settings = BatchTDSettings(
        rule_base=RuleBaseSettings(order=2),
        ridge=0.1,
        target_averaging_rate=1.0,
        discount=0.9,
        exploration=BurstExploration(rate=0.5, decay=0.7, floor=0.0),
        decision=DecisionSettings(rule="value"),
    )
    world = line_world(2, 2)
    hierarchy = Hierarchy(world.agents, list(pairwise(world.agents)))

    def solved(settings, episodes: int) -> float:
        team = Team(settings, world, hierarchy, policy_seed(3))
        for _ in control_loop(world, team, episodes=episodes, steps=40, seed=3):
            pass
        test = control_loop(world, team, episodes=20, steps=40, seed=4, learn=False)
        return float(np.mean([r.transition.info["distance_m"] < 0.1 for r in test if r.last]))

    assert solved(settings, 10) >= 0.9
    assert solved(FrozenSettings(decision=DecisionSettings(rule="random")), 0) <= 0.3


@pytest.fixture
def pair(line_world):
    """A world of two agents and the same one seen as one agent's, in the same state."""
    world, single = line_world(2, 1), join_agents(line_world(2, 1), "team")
    assert (single.reset(1) == world.reset(1).reshape(1, -1)).all()
    return world, single


def test_one_agent_with_all_joint_actions_and_variables(pair) -> None:
    _, single = pair
    assert (single.agents, single.groups) == (("single",), ((0,),))
    assert len(single.action_set) == 16
    assert single.action_set.names[:3] == (
        "increase+increase", "increase+decrease", "increase+maintain",
    )  # fmt: skip
    assert single.action_set.names[single.action_set.neutral] == "maintain+maintain"
    names = [v.name for v in single.state_space.variables]
    assert names[:4] == ["cart0.wheel0.speed", "cart0.wheel0.phase", "cart0.wheel0.gap",
                         "cart1.wheel0.speed"]  # fmt: skip
    assert single.state_space.n_variables == 6


@pytest.mark.parametrize("each", ["body", "team"])
def test_actions_in_states_are_those_of_all_its_actuators(each, line_world) -> None:
    world = line_world(1, 2)
    assert not join_agents(world, each).state_space.actions
    world.state_space = replace(world.state_space, actions=("speed",))
    names = join_agents(world, each).state_space.actions
    assert [name.endswith("wheel0.speed") for name in names] == [True, False]


def test_an_agent_for_every_actuator_is_the_scenario_itself(line_world) -> None:
    world = line_world(2, 2)
    assert join_agents(world, "actuator") is world


def test_any_hierarchy_is_built_over_bodies(line_world) -> None:
    bodies = join_agents(line_world(3, 2), "body")
    assert build("star:cart1", bodies.agents).edges == ((1, 0), (1, 2))
    assert build("tree:2", bodies.agents).edges == ((0, 1), (0, 2))


def test_steps_are_those_of_the_world(pair) -> None:
    world, single = pair
    for code, joint in enumerate(product(range(4), repeat=2)):
        expected, found = world.step(np.array(joint)), single.step(np.array([code]))
        assert (found.states == expected.states.reshape(1, -1)).all()
        assert (found.reward, found.info) == (expected.reward, expected.info)
    assert single.scenario.measure() == world.measure()


def test_predictions_are_those_of_the_world(pair) -> None:
    world, single = pair
    prediction, expected = single.predict(), world.predict()
    joint = np.array(list(product(range(4), repeat=2)))
    codes = np.arange(16)[:, None]
    both = np.concatenate([expected.states(i, joint) for i in range(2)], axis=1)
    assert (prediction.states(0, codes) == both).all()
    assert (prediction.rewards(codes) == expected.rewards(joint)).all()


def test_a_team_of_one_acts_and_learns(pair) -> None:
    _, single = pair
    settings = TDLambdaSettings(rule_base=RuleBaseSettings(memberships=2, order=6), step_size=0.1)
    team = Team(settings, single, Hierarchy(["single"], []), np.random.SeedSequence(1))
    records = list(control_loop(single, team, episodes=2, steps=5, seed=1))
    assert len(records) == 10
    assert fuzzy(team).learner.theta.shape == (1, 2**6)
    assert np.abs(fuzzy(team).learner.theta).max() > 0
    assert fuzzy(team).evaluator.counts.joint_actions == 10 * 16


@pytest.mark.parametrize("agents", ["body", "team"])
def test_rewards_are_predicted_where_the_scenario_predicts_them(agents: str, line_world) -> None:
    scenario = join_agents(line_world(2, 1), agents)
    scenario.reset(0)
    complete = scenario.scenario.predict()
    joint = np.zeros((1, len(scenario.agents)), dtype=int)
    assert JointPrediction(complete, scenario).rewards(joint) is not None
    complete.rewards = lambda joint_actions: None
    assert JointPrediction(complete, scenario).rewards(joint) is None


def test_a_robot_has_the_states_and_actions_of_its_wheels(line_world) -> None:
    world, robots = line_world(2, 2), join_agents(line_world(2, 2), "body")
    assert not isinstance(robots, Embodiment)
    assert robots.agents == ("cart0", "cart1")
    assert len(robots.action_set) == 16
    assert robots.action_set.names[robots.action_set.neutral] == "maintain+maintain"
    names = [v.name for v in robots.state_space.variables]
    assert names == ["wheel0.speed", "wheel0.phase", "wheel1.speed", "wheel1.phase", "gap"]
    before, joined = world.reset(3), robots.reset(3)
    assert (joined[1] == [*before[2, :2], *before[3, :2], before[2, 2]]).all()
    one, other = world.step(np.array([0, 1, 2, 3])), robots.step(np.array([1, 11]))
    assert (other.states[0] == [*one.states[0, :2], *one.states[1]]).all()
    assert other.reward == one.reward


def test_robots_whose_wheels_have_the_same_roles_are_of_one_role(line_world) -> None:
    world = line_world(2, 2)
    assert join_agents(world, "body").roles == (
        "cart0.wheel0+cart0.wheel1",
        "cart1.wheel0+cart1.wheel1",
    )
    world.roles = ("front", "rear") * 2
    assert join_agents(world, "body").roles == ("front+rear", "front+rear")


@pytest.mark.parametrize(("agents", "n"), [("body", 2), ("team", 1)])
def test_rewards_of_wheels_are_joined(agents: Granularity, n: int) -> None:
    settings = BoxPushingSettings.model_validate({"reward": {"of": "robot"}})
    world = BoxPushing(settings)
    scenario = join_agents(BoxPushing(settings), agents)
    world.reset(0)
    scenario.reset(0)
    of_wheels = np.asarray(world.step(np.full(4, world.action_set.neutral)).reward)
    joined = scenario.step(np.full(n, scenario.action_set.neutral)).reward
    assert joined == pytest.approx(of_wheels.reshape(n, -1).mean(axis=1))


def test_the_scenario_keeps_its_promises() -> None:
    def make() -> Scenario:
        return join_agents(BoxPushing(BoxPushingSettings()), "body")

    assert "predictions" in check_scenario(make, steps=10).passed


def test_both_evaluators_and_a_self_model_work_on_it() -> None:
    settings = BoxPushingSettings()
    weights = []
    for evaluator in ("exact", "sampling"):
        learner = BatchTDSettings(
            decision=DecisionSettings(evaluator=evaluator),  # type: ignore[arg-type]
            self_model=SelfModelSettings(enabled=True),
        )
        scenario = join_agents(BoxPushing(settings), "body")
        hierarchy = build("chain", scenario.agents)
        assert hierarchy.edges == ((0, 1),)
        team = Team(learner, scenario, hierarchy, policy_seed(0))
        nominal = fuzzy(team).model.self_model.effects[0].copy()
        for record in control_loop(scenario, team, episodes=2, steps=8, seed=0):
            assert record.joint_action.shape == (2,)
        assert (fuzzy(team).model.self_model.effects[0] != nominal).any()
        weights.append(fuzzy(team).learner.theta)
    assert all(np.abs(theta).sum() > 0.0 for theta in weights)


def test_what_cannot_be_is_refused(line_world) -> None:
    with pytest.raises(ValueError, match=r"agents = 'body': 4 \*\* 5 actions each, allowed: 256"):
        join_agents(line_world(1, 5), "body")
    world = line_world(1, 3)
    world.groups = ((0, 1), (2,))
    with pytest.raises(ValueError, match=r"agents = 'body': bodies of \[1, 2\] actuators"):
        join_agents(world, "body")
    with pytest.raises(ValueError, match=r"agents = 'team': 4 \*\* 7 actions each, allowed: 4096"):
        join_agents(line_world(7, 1), "team")
