"""The recovery table: its numbers by hand, and policies of several kinds."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from nested_agents import faults
from nested_agents.analysis import format_estimate
from nested_agents.environments import parallel
from nested_agents.scenarios.environments import AgentsEnv
from nested_agents.studies.api.recovery import BLOCK, FaultCourse, returns


def test_numbers_by_hand() -> None:
    healthy = np.full((2, 16), 10.0)
    faulty = healthy.copy()
    faulty[0, 5:8] = 0.0  # recovers: a block in a row is as good as without the fault from 8 on
    faulty[1, 5:] = 4.0  # never does
    course = FaultCourse("policy: fault", 5, healthy, faulty, last_onset=5)
    recovered, episodes = course.recovery()
    assert recovered.tolist() == [1, 0]
    assert episodes.tolist() == [3, 11]
    estimates = {name: float(e.value) for name, e in course.summary().estimates.items()}
    assert estimates == {
        "return before": 10.0,
        "return just after": pytest.approx((4 + 4) / 2),
        "return at the end": 7.0,
        "return at the end, no fault": 10.0,
        "cumulative loss": pytest.approx((30 + 66) / 2),
        "recovered": 0.5,
        "recovery time": 7.0,
    }
    e = course.summary().estimates["recovery time"]
    assert format_estimate(e) == ">= 7", "one seed never recovers"


class Pushing:
    """Pushes where the pole falls, as a model of stable-baselines3 would be asked."""

    def predict(self, seen: Any, deterministic: bool) -> tuple[Any, None]:
        return np.array(int(seen[2] + seen[3] > 0)), None


def make() -> Any:
    return gymnasium.make("CartPole-v1")


def test_a_fault_that_ends() -> None:
    policies = {"push": Pushing(), "random": faults.RandomPolicy(make().action_space)}
    schedules = {"reversed": [faults.Reversed(actuators=0, episode=5, end_episode=8)]}
    table = faults.recovery_table(make, policies, schedules, seeds=2, episodes=13, steps=60)
    again = faults.recovery_table(make, policies, schedules, seeds=2, episodes=13, steps=60)
    pushing, random = table.courses
    assert (pushing.healthy == 60).all()
    assert (pushing.faulty[:, 5:8] < 20).all()
    assert (pushing.faulty[:, 8:] == 60).all()
    assert pushing.recovery()[1].tolist() == [3, 3]
    assert (random.healthy[:, :5] == random.faulty[:, :5]).all()
    assert (random.faulty == again.courses[1].faulty).all()
    lines = str(table).splitlines()
    assert max(map(len, lines)) <= 80
    assert any(line.startswith(f"Returns are means of {BLOCK} ") for line in lines)


def test_a_team_recovers_only_after_the_last_fault_and_faults_end_with_their_last_step() -> None:
    faulty = [
        faults.Reversed(actuators=0, episode=5, end_episode=6),
        faults.Reversed(actuators=0, episode=8, end_episode=10, end_step=5),
    ]
    table = faults.recovery_table(make, {"push": Pushing()}, {"two": faulty}, seeds=1, episodes=16)
    (course,) = table.courses
    assert (course.last_onset, course.end) == (8, 11)
    recovered, episodes = course.recovery()
    assert (recovered.item(), episodes.item() >= 5) == (1, True)


def test_a_policy_may_be_told_that_a_run_begins() -> None:
    class Told(Pushing):
        def __init__(self) -> None:
            self.seeds: list[int] = []

        def begin(self, seed: int) -> None:
            self.seeds.append(seed)

    told = Told()
    schedules = {"reversed": [faults.Reversed(actuators=0, episode=BLOCK)]}
    faults.recovery_table(make, {"told": told}, schedules, seeds=2, episodes=2 * BLOCK, steps=5)
    assert set(told.seeds) == {0, 1}


def test_agents_of_a_parallel_environment() -> None:
    def wheels() -> AgentsEnv:
        return parallel("box-pushing", 4, robots=1, action_repeat=2)

    env = wheels()
    policy = faults.RandomPolicy({name: env.action_space(name) for name in env.possible_agents})
    fault = faults.Reversed(actuators="robot1.left.*")
    found = [returns(wheels, policy, f, 1, 2, 4) for f in ((), (), [fault])]
    assert (found[0] == found[1]).all()
    assert (found[0] != found[2]).any()


def test_what_cannot_be_is_refused() -> None:
    late = {"late": [faults.Free(actuators=0, episode=12)]}
    with pytest.raises(ValueError, match=r"'late': .* episode 12, allowed 5 to 10"):
        faults.recovery_table(make, {}, late, episodes=15)
    with pytest.raises(ValueError, match="seeds = 0"):
        faults.recovery_table(make, {}, {}, seeds=0)
    never = {"never": [faults.Free(actuators=0, episode=5)]}
    with pytest.raises(ValueError, match="policy = 7: must be a function, or have a method"):
        faults.recovery_table(make, {"seven": 7}, never, episodes=15)
