"""Turns in hierarchy order: what PettingZoo checks, what is passed down, and the same world."""

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from pettingzoo import ParallelEnv
from pettingzoo.test import api_test, seed_test

from nested_agents import environments
from nested_agents.core.hierarchy.failures import AbsentAgents, LeftAgents
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.scenarios.adapters.turns import TurnBasedEnv


def boxes(steps: int, **options: Any) -> Any:
    return environments.parallel("box-pushing", steps, action_repeat=2, **options)


ADVICE = (
    "We recommend agents to be named", "Action space for each agent probably should",
    "Agent's m.* observation space value is",
)  # fmt: skip
"""What the check advises against: names with dots, MultiDiscrete actions, infinite bounds."""
TREE = Hierarchy(
    ["robot1.left", "robot1.right", "robot2.left", "robot2.right"],
    [("robot2.right", "robot1.left"), ("robot2.right", "robot2.left")],
)


class Leaving(ParallelEnv):
    """Agents are paid their number in every step, and leave after as many; the last ends it."""

    metadata = {"name": "leaving_v0"}  # noqa: RUF012

    def __init__(self) -> None:
        self.possible_agents = ["a", "b", "c"]
        self.agents: list[str] = []
        self.render_mode = None

        self.seen = gymnasium.spaces.Box(0, 9, (1,), dtype=np.float32)
        self.chosen = {name: gymnasium.spaces.Discrete(2) for name in self.possible_agents}

    def observation_space(self, agent: str) -> Any:
        return self.seen

    def action_space(self, agent: str) -> Any:
        return self.chosen[agent]

    def _told(self) -> Any:
        return {name: np.array([1 + self.time], dtype=np.float32) for name in self.agents}

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        self.agents, self.time = list(self.possible_agents), 0
        return self._told(), {name: {} for name in self.agents}

    def step(self, actions: Any) -> Any:
        assert set(actions) == set(self.agents)
        self.time += 1
        told, infos = self._told(), {name: {} for name in self.agents}
        paid = {name: 1.0 + self.possible_agents.index(name) for name in self.agents}
        ends = {name: paid[name] <= self.time for name in self.agents}
        breaks = dict.fromkeys(self.agents, False)
        self.agents = [name for name in self.agents if not ends[name]]
        return told, paid, ends, breaks, infos


class Climbing(Leaving):
    """Two agents are paid what the climbing game pays, in each of `plays` steps."""

    payoffs = np.array([[11, -30, 0], [-30, 7, 6], [0, 0, 5]])

    def __init__(self, plays: int) -> None:
        super().__init__()
        self.possible_agents, self.plays = ["a", "b"], plays
        self.chosen = {name: gymnasium.spaces.Discrete(3) for name in self.possible_agents}

    def _told(self) -> Any:
        return {name: np.zeros(1, dtype=np.float32) for name in self.possible_agents}

    def step(self, actions: Any) -> Any:
        self.time += 1
        names, infos = self.possible_agents, {name: {} for name in self.possible_agents}
        paid = dict.fromkeys(names, float(self.payoffs[actions["a"], actions["b"]]))
        breaks = dict.fromkeys(names, self.time == self.plays)
        self.agents = [] if self.time == self.plays else names
        return self._told(), paid, dict.fromkeys(names, False), breaks, infos


def of_joint_steps(env: TurnBasedEnv, act: Any) -> Any:
    """Yield an agent's observation and action with what `last` says that its next turn brought."""
    begun: dict[str, tuple[Any, int]] = {}
    for name in env.agent_iter():
        seen, reward, ended, broken, _ = env.last()
        if name in begun:
            yield (name, *begun.pop(name), reward)
        if ended or broken:
            env.step(None)
        else:
            begun[name] = seen, act(name, seen)
            env.step(begun[name][1])


@pytest.mark.parametrize(
    "make",
    [
        lambda: TurnBasedEnv(boxes(15)),
        lambda: TurnBasedEnv(boxes(15), TREE),
        lambda: TurnBasedEnv(boxes(15, players="bodies")),
        lambda: TurnBasedEnv(Leaving()),
    ],
)
def test_pettingzoo_finds_nothing(make: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for advice in ADVICE:
            warnings.filterwarnings("ignore", message=advice)
        api_test(make(), num_cycles=60)
        seed_test(make, num_cycles=20)


def test_it_is_the_world_of_the_parallel_environment() -> None:
    turns, parallel = TurnBasedEnv(boxes(6), TREE), boxes(6)
    turns.reset(seed=4)
    told = parallel.reset(seed=4)[0]
    rng = np.random.default_rng(0)
    while parallel.agents:
        actions = {name: int(rng.integers(4)) for name in parallel.agents}
        for place in TREE.order:
            name = TREE.agents[place]
            assert turns.agent_selection == name
            seen, _, ended, broken, _ = turns.last()
            own = len(told[name])
            assert (seen[:own] == told[name]).all()
            assert not ended
            assert not broken
            passed = np.zeros((4, 4))
            for superior in TREE.senders(place):
                passed[superior, actions[TREE.agents[superior]]] = 1
            assert (seen[own:] == passed.ravel()).all()
            turns.step(actions[name])
        told, rewards, _, breaks, _ = parallel.step(actions)
        assert {name: turns._cumulative_rewards[name] for name in rewards} == rewards
        assert turns.truncations == breaks
    assert turns.agents
    while turns.agents:
        turns.step(None)


def test_what_is_passed_is_of_this_step_alone() -> None:
    env = TurnBasedEnv(boxes(3, players="bodies"))
    env.reset(seed=0)
    env.step(np.array([1, 3]))
    assert env.observe("robot1")[-16:].tolist() == [0] * 16
    assert env.observe("robot2")[-16:].tolist() == [0, 1, 0, 0, 0, 0, 0, 1] + [0] * 8
    env.step(np.array([0, 0]))
    assert env.observe("robot2")[-16:].tolist() == [0] * 16


def test_who_has_left_passes_nothing_down() -> None:
    env = TurnBasedEnv(Leaving())
    env.reset()
    for _ in range(3):
        env.step(1)
    assert env.agent_selection == "a"
    env.step(None)
    assert (env.agents, env.agent_selection) == (["b", "c"], "b")
    assert env.observe("b").tolist() == [2] + [0] * 6
    env.step(1)
    assert env.last()[:2] == (pytest.approx([2, 0, 0, 0, 1, 0, 0]), 3.0)


@pytest.mark.parametrize("failure", [AbsentAgents(agents="a"), LeftAgents(agents="a")])
def test_absences_are_refused_where_every_agent_has_its_turn(failure) -> None:
    with pytest.raises(ValueError, match=r"failures\[0\]\.kind = .* allowed: lost, delayed, noisy"):
        TurnBasedEnv(Climbing(plays=5), failures=[failure])


def test_between_turns_of_a_step_nothing_is_to_be_learned() -> None:
    env = TurnBasedEnv(Climbing(plays=5))
    env.reset()
    for first in (0, 1, 2):
        before = env.observe("a")[:1]
        env.step(first)
        # The next turn has no reward, and the value of the same state: the TD error is 0.
        assert set(env.rewards.values()) == {0.0}
        assert (env.observe("b")[:1] == before).all()
        env.step(0)
        assert env.rewards == dict.fromkeys("ab", Climbing.payoffs[first, 0])


def test_one_reward_for_a_joint_step_is_learned_from() -> None:
    plays, rng = 800, np.random.default_rng(0)
    env = TurnBasedEnv(Climbing(plays))
    env.reset()
    values: dict[tuple[str, bytes], Any] = {}
    rewards: dict[str, list[float]] = {"a": [], "b": []}

    def act(name: str, seen: Any) -> int:
        row = values.setdefault((name, seen.tobytes()), np.zeros(3))
        is_random = name == "a" or rng.random() < 0.1
        return int(rng.integers(3)) if is_random else int(row.argmax())

    for name, seen, action, reward in of_joint_steps(env, act):
        rewards[name].append(reward)
        row = values[name, seen.tobytes()]
        row[action] += 0.1 * (reward - row[action])
    assert rewards["a"] == rewards["b"]
    assert len(rewards["a"]) == plays
    env.reset()
    best = values["a", env.observe("a").tobytes()].argmax()
    env.step(int(best))
    answer = values["b", env.observe("b").tobytes()].argmax()
    assert Climbing.payoffs[best, answer] == 11


@pytest.mark.parametrize(
    ("act", "complaint"),
    [
        (
            lambda: TurnBasedEnv(Leaving(), Hierarchy(["a", "x"], [])),
            "agents a, x, allowed: a, b, c",
        ),
        (lambda: _of(action_space=gymnasium.spaces.Box(0, 1)), "actions of 'a': Box"),
        (lambda: _of(action_space=gymnasium.spaces.Discrete(2, start=1)), "actions of 'a'"),
        (lambda: _of(observation_space=gymnasium.spaces.Discrete(3)), "observations of 'a'"),
        (lambda: _started().step(2), "action 2 of a, allowed: whole numbers from 0 to 1"),
        (lambda: _started().step(-1), "action -1 of a, "),
        (lambda: _started().step(0.7), "action 0.7 of a, "),
        (lambda: _started().step([0, 1]), r"action \[0, 1\] of a, "),
        (lambda: _started().step(None), "action None of a"),
    ],
)
def test_refusals(act: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as raised:
        act()
    assert "\n" not in str(raised.value)


def _of(**spaces: Any) -> TurnBasedEnv:
    env = Leaving()
    for name, space in spaces.items():
        setattr(env, name, lambda agent, space=space: space)
    return TurnBasedEnv(env)


def _started() -> TurnBasedEnv:
    env = TurnBasedEnv(Leaving())
    env.reset()
    return env
