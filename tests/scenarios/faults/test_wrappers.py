"""Faults in other people's environments: their checkers, pairs of runs, and what faults do."""

import re
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from gymnasium.utils.env_checker import check_env
from pettingzoo import ParallelEnv
from pettingzoo.test import parallel_api_test, parallel_seed_test

from nested_agents import faults
from nested_agents.scenarios.faults.wrappers import KINDS

BOX = Box(np.array([-2.0, 0.0]), np.array([2.0, 1.0]), dtype=np.float64)


class Told(gymnasium.Env):
    """Shows the action that it is told, and where it has drifted to by its own random numbers."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(self, space: gymnasium.Space) -> None:
        self.action_space = space
        self.observation_space = Box(-1e6, 1e6, (1,), dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.options, self.told = options, None
        self.place = self.np_random.standard_normal(1)
        return self.place, {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.told = action
        assert self.action_space.contains(action)
        self.place = self.place + self.np_random.standard_normal(1)
        return self.place, 0.0, False, False, {}


def test_the_order_in_memory_of_an_action_does_not_matter() -> None:
    env = faults.FaultyEnv(Told(Box(-1.0, 1.0, (2, 3))), [faults.Weak(actuators="*", gain=0.25)])
    env.reset(seed=0)
    for action in (np.ones((2, 3), np.float32), np.ones((3, 2), np.float32).T):
        env.step(action)
        assert (env.unwrapped.told == 0.25).all()


class Pair(ParallelEnv):
    """Two agents who add their actions up."""

    metadata: dict[str, Any] = {"name": "pair", "render_modes": []}  # noqa: RUF012
    possible_agents = ["arm", "leg"]  # noqa: RUF012

    def observation_space(self, agent: str) -> Box:
        return self.box[agent]

    def action_space(self, agent: str) -> Any:
        return self.spaces[agent]

    def __init__(self) -> None:
        self.box = {name: Box(-100, 100, (1,), dtype=np.float64) for name in self.possible_agents}
        self.spaces = {"arm": Box(-1.0, 1.0, (2,), dtype=np.float32), "leg": Discrete(3)}
        self.render_mode = None

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        self.agents, self.time = list(self.possible_agents), 0
        self.rng = np.random.default_rng(seed)
        return self._seen(), {name: {} for name in self.agents}

    def _seen(self) -> dict[str, Any]:
        return {name: self.rng.standard_normal(1) for name in self.agents}

    def step(self, actions: dict[str, Any]) -> Any:
        self.told = actions
        self.time += 1
        over = self.time >= 20
        agents = list(self.agents)
        given = (
            self._seen(),
            dict.fromkeys(agents, float(np.sum(actions["arm"]))),
            dict.fromkeys(agents, False),
            dict.fromkeys(agents, over),
            {name: {} for name in agents},
        )
        self.agents = [] if over else self.agents
        return given


def carried(space: gymnasium.Space, fault: Any, actions: list[Any], **wrapping: Any) -> list[Any]:
    """Return what the environment is told when a policy takes these actions."""
    env = faults.FaultyEnv(Told(space), [fault], **wrapping)
    env.reset(seed=0)
    found = []
    for action in actions:
        env.step(action)
        found.append(np.asarray(env.unwrapped.told).tolist())
    return found


ACTIONS = [np.array([1.0, 0.5]), np.array([-2.0, 1.0]), np.array([0.5, 0.0])]


@pytest.mark.parametrize(
    ("fault", "wrapping", "expected"),
    [
        (faults.Free(actuators=0), {}, [[0, 0.5], [0, 1], [0, 0]]),
        (faults.Seized(actuators=0), {"commands": "velocity"}, [[0, 0.5], [0, 1], [0, 0]]),
        (
            faults.Seized(actuators=0, step=1),
            {"commands": "position"},
            [[1, 0.5], [1, 1], [1, 0]],
        ),
        (faults.Weak(actuators="*", gain=0.5), {}, [[0.5, 0.25], [-1, 0.5], [0.25, 0]]),
        (faults.Reversed(actuators="*"), {}, [[-1, 0], [2, 0], [-0.5, 0]]),  # 0 to 1: cut at rest
        (faults.Stuck(actuators="0", speed=-0.5), {}, [[-1, 0.5], [-1, 1], [-1, 0]]),
        (faults.Delayed(actuators=[0], periods=1), {}, [[0, 0.5], [1, 1], [-2, 0]]),
        (faults.Weak(actuators=1, gain=0.5, step=1, end_episode=0, end_step=2), {},
         [[1, 0.5], [-2, 0.5], [0.5, 0]]),
    ],
)  # fmt: skip
def test_what_is_done_of_an_action(fault: Any, wrapping: Any, expected: Any) -> None:
    assert carried(BOX, fault, ACTIONS, **wrapping) == expected


def test_noise_has_its_deviation_and_stays_in_bounds() -> None:
    found = np.array(carried(BOX, faults.Noisy(actuators=0, deviation=0.1), [ACTIONS[2]] * 2000))
    assert found[:, 0].std() == pytest.approx(0.2, rel=0.1)
    assert found[:, 0].mean() == pytest.approx(0.5, abs=0.02)
    assert (found[:, 1] == 0).all()
    assert abs(found).max() <= 2


def test_discrete_actions_lie_along_a_scale() -> None:
    three = Discrete(3, start=5)
    assert carried(three, faults.Reversed(actuators=0), [5, 6, 7]) == [7, 6, 5]
    assert carried(three, faults.Free(actuators=0), [5, 7]) == [6, 6]
    weak = carried(three, faults.Weak(actuators=0, gain=0.3), [7] * 3000)
    assert set(weak) == {6, 7}
    assert np.mean(weak) == pytest.approx(6.3, abs=0.03)
    two = MultiDiscrete([2, 4])
    assert carried(two, faults.Reversed(actuators=1), [np.array([1, 3])]) == [[1, 0]]


@pytest.mark.parametrize("space", [BOX, Discrete(2), MultiDiscrete([3, 2])])
@pytest.mark.parametrize("kind", KINDS)
def test_gymnasium_finds_nothing(space: gymnasium.Space, kind: str) -> None:
    schedule = [KINDS[kind](actuators="*", step=2)]
    env = faults.FaultyEnv(Told(space), schedule, mechanism=lambda env, now: None, inform=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*different from the unwrapped version.*")
        warnings.filterwarnings("ignore", message=".*symmetric and normalized space.*")
        check_env(env, skip_render_check=True)


def test_pettingzoo_finds_nothing() -> None:
    def make() -> Any:
        schedule = [faults.Noisy(actuators="arm.*"), faults.Weak(actuators="leg.0", step=3)]
        return faults.FaultyParallelEnv(Pair(), schedule, inform=True)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(make(), num_cycles=50)
        parallel_seed_test(make)
    assert make().actuators == ("arm.0", "arm.1", "leg.0")


def test_an_agent_is_informed_of_its_own_faults() -> None:
    env = faults.FaultyParallelEnv(Pair(), [faults.Reversed(actuators="arm.1")], inform=True)
    env.reset(seed=0)
    infos = env.step({"arm": np.ones(2, dtype=np.float32), "leg": 2})[-1]
    assert infos["arm"]["faults"] == {"arm.1": "reversed"}
    assert infos["arm"]["carried"].tolist() == [1, -1]
    assert infos["leg"]["faults"] == {}


def run(schedule: Any, seed: int = 3, **wrapping: Any) -> list[Any]:
    """Return what equal random actions lead to in two episodes."""
    env = faults.FaultyEnv(Told(BOX), schedule, **wrapping)
    BOX.seed(1)
    found = []
    for episode in range(2):
        found.append(env.reset(seed=seed if episode == 0 else None)[0].tolist())
        for _ in range(5):
            found += [env.step(BOX.sample())[0].tolist(), np.array(env.carried).tolist()]
    return found


def test_worlds_are_paired_and_runs_repeat() -> None:
    noisy = [faults.Noisy(actuators=0, episode=1, step=2)]
    plain, faulty = run([]), run(noisy)
    assert faulty == run(noisy) != run(noisy, seed=4)
    onset = 11 + 1 + 2 * 2  # an episode, a reset and two steps
    assert plain[:onset] == faulty[:onset]
    differ = [i for i, (a, b) in enumerate(zip(plain, faulty, strict=True)) if a != b]
    assert differ == [17, 19, 21]  # what is done in the last three steps; never the world


def test_the_mechanism_is_called_while_it_lasts() -> None:
    calls: list[dict[str, str]] = []
    schedule = [faults.Seized(actuators=1, step=1, end_episode=0, end_step=3)]
    env = faults.FaultyEnv(Told(BOX), schedule, mechanism=lambda env, now: calls.append(now))
    env.reset(seed=0)
    for _ in range(6):
        env.step(ACTIONS[0])
    assert calls == [{"1": "seized"}, {"1": "seized"}, {}]


def test_the_number_of_the_episode_is_an_option_of_ours_alone() -> None:
    env = faults.FaultyEnv(Told(BOX), [faults.Free(actuators=0, episode=7)])
    env.reset(seed=0, options={"fault_episode": 7, "low": 1})
    assert env.unwrapped.options == {"low": 1}
    env.step(ACTIONS[0])
    assert env.carried.tolist() == [0, 0.5]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: faults.FaultyEnv(Told(BOX), [faults.Weak(actuators="hip")]),
         "faults[0].actuators = 'hip': no such actuator, allowed 0, 1"),
        (lambda: faults.FaultyEnv(Told(BOX), [faults.Seized(actuators=0)]), "no effort can"),
        (lambda: faults.FaultyEnv(Told(BOX), [], commands="torque"), "commands = 'torque'"),
        (lambda: faults.FaultyEnv(Told(Box(-np.inf, np.inf, (1,))), []), "finite bounds"),
        (lambda: faults.FaultyEnv(Told(gymnasium.spaces.MultiBinary(2)), []), "allowed: Discrete"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_a_line(make: Any, said: str) -> None:
    with pytest.raises(ValueError) as raised:  # noqa: PT011
        make()
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


def test_what_the_page_on_faults_does(capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "faults.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL))
    exec(compile(code, "faults.md", "exec"), {})
    assert "random: weak" in capsys.readouterr().out
