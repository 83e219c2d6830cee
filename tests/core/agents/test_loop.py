"""The control loop: numbering, ends of episodes, paired worlds, determinism, learning."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from nested_agents.core.agents.loop import StepRecord, control_loop, policy_seed, world_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.decision.exploration import BurstExploration
from nested_agents.core.decision.settings import Decision
from nested_agents.core.interface.hierarchy import Hierarchy
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.learners.td import FrozenSettings, TDLambdaSettings
from nested_agents.core.rules.rule_base import RuleBaseSettings

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
    before = {k: v.copy() for k, v in team.arrays().items() if k != "generator"}
    updates = team.evaluator.counts.weight_updates
    assert updates > 0
    run(world, team, learn=False)
    after = team.arrays()
    assert all((after[k] == v).all() for k, v in before.items())
    assert team.evaluator.counts.weight_updates == updates


def test_a_team_learns_to_push(line_world) -> None:
    # The load starts up to 1.5 m from the goal and moves at most 0.1 m a step.
    settings = BatchTDSettings(
        rule_base=RuleBaseSettings(products=(("speed", "gap"),)),
        ridge=0.1,
        target_averaging_rate=1.0,
        discount=0.9,
        exploration=BurstExploration(rate=0.5, decay=0.7, floor=0.0),
        decision=Decision(rule="value"),
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
    assert solved(FrozenSettings(decision=Decision(rule="random")), 0) <= 0.3
