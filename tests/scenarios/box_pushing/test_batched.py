"""Vector environments: what Gymnasium's own gives around single ones, whatever the processes."""

import os
import signal
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from nested_agents import make_vec
from nested_agents.scenarios.box_pushing.batched.environments import (
    VecBoxPushingEnv,
    VecWheelsEnv,
)
from nested_agents.scenarios.box_pushing.environments import ENV_ID, BoxPushingEnv, WheelsEnv

FAILING: dict[str, Any] = {
    "action_repeat": 2,
    "reward": {"of": "robot"},
    "failures": [{"kind": "noisy", "wheels": "robot1.left", "deviation": 0.2, "episode": 1}],
}


def singles(worlds: int, steps: int, mode: AutoresetMode) -> SyncVectorEnv:
    return SyncVectorEnv(
        [lambda: BoxPushingEnv(FAILING, steps=steps)] * worlds, autoreset_mode=mode
    )


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("processes", [1, 2])
def test_worlds_are_those_of_single_environments(mode: AutoresetMode, processes: int) -> None:
    ours = VecBoxPushingEnv(5, FAILING, steps=3, processes=processes, autoreset_mode=mode)
    known = singles(5, 3, mode)
    assert ours.single_action_space == known.single_action_space
    assert ours.observation_space == known.observation_space
    assert ours.metadata["autoreset_mode"] is mode
    assert data_equivalence(ours.reset(seed=4), known.reset(seed=4), exact=True)
    rng = np.random.default_rng(0)
    for _ in range(8):
        actions = rng.integers(4, size=(5, 4))
        given = ours.step(actions)
        assert data_equivalence(given, known.step(actions), exact=True)
        assert given[0] in ours.observation_space
        over = given[2] | given[3]
        if mode is AutoresetMode.DISABLED and over.any():
            pair = [env.reset(options={"reset_mask": over}) for env in (ours, known)]
            assert data_equivalence(*pair, exact=True)
    ours.close()


def test_a_part_of_the_worlds_is_reset() -> None:
    ours = VecBoxPushingEnv(3, FAILING, processes=2, autoreset_mode=AutoresetMode.DISABLED)
    known = singles(3, 450, AutoresetMode.DISABLED)
    mask = np.array([True, False, True])
    for options in ({"episode": 1}, {"reset_mask": mask, "episode": 3}):
        pair = [env.reset(seed=[5, None, 9], options=dict(options)) for env in (ours, known)]
        seen = [found[0][mask] for found in pair]
        np.testing.assert_array_equal(*seen)
    assert pair[0][1]["_failed"].tolist() == mask.tolist()
    assert pair[0][1]["failed"][:, 0].tolist() == [True, False, True]
    ours.close()


def test_worlds_do_not_depend_on_how_many_there_are() -> None:
    def played(worlds: int, processes: int) -> list[Any]:
        envs = VecWheelsEnv(worlds, FAILING, steps=4, processes=processes, context="fork")
        seen = [envs.reset(seed=7)[0][2]]
        for action in np.random.default_rng(1).integers(4, size=(6, 4)):
            seen.append(envs.step(np.tile(action, (worlds, 1)))[0][2])
        envs.close()
        return seen

    known = WheelsEnv(FAILING, steps=4)
    single = np.stack(list(known.reset(seed=9)[0].values()))
    first = played(3, 1)
    np.testing.assert_array_equal(first[0], single)
    for worlds, processes in ((3, 3), (8, 3)):
        np.testing.assert_array_equal(played(worlds, processes), first)


def test_gymnasium_makes_and_wraps_them() -> None:
    envs = gymnasium.make_vec(ENV_ID, num_envs=2, settings=FAILING, steps=2, processes=1)
    assert isinstance(envs.unwrapped, VecBoxPushingEnv)
    envs = RecordEpisodeStatistics(envs)
    envs.reset(seed=0)
    for _ in range(2):
        *_, infos = envs.step(envs.action_space.sample())
    assert infos["episode"]["l"].tolist() == [2, 2]
    assert isinstance(make_vec(2, FAILING, processes=1), VecWheelsEnv)
    assert type(make_vec(1, agents="all")) is VecBoxPushingEnv


def test_pictures() -> None:
    envs = VecWheelsEnv(3, FAILING, processes=2, render_mode="rgb_array")
    envs.reset(seed=0)
    pictures = envs.render()
    assert pictures is not None
    assert [picture.ndim for picture in pictures] == [3, 3, 3]
    assert not np.array_equal(pictures[0], pictures[2])
    envs.close()
    assert make_vec(1).render() is None


def test_processes_end() -> None:
    envs = VecWheelsEnv(3, FAILING, processes=3)
    processes = [process for process, _ in envs._processes._workers]
    envs.reset(seed=0)
    envs.close()
    assert [process.exitcode for process in processes] == [0, 0]
    envs = VecWheelsEnv(2, FAILING, processes=2)
    os.kill(envs._processes._workers[0][0].pid, signal.SIGKILL)
    with pytest.raises(RuntimeError, match=r"has died \(exit status -9\)"):
        envs.reset(seed=0)
    envs.close()


def test_what_a_world_refuses_is_raised_here() -> None:
    envs = VecWheelsEnv(2, FAILING, processes=2)
    with pytest.raises(ValueError, match="invalid literal"):
        envs.reset(options={"episode": "x"})
    assert envs.reset(seed=0)[0].shape == (2, 4, 8)
    with pytest.raises(ValueError, match="must be 2 of bool"):
        envs.reset(options={"reset_mask": np.zeros(2, dtype=bool)})
    with pytest.raises(ValueError, match="seed has 3 entries, must have 2"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(ValueError, match=r"actions of shape \(4,\), must be \(2, 4\)"):
        envs.step(np.zeros(4))
    envs.close()
    envs = VecWheelsEnv(2, FAILING, steps=1, processes=1, autoreset_mode="Disabled")
    envs.reset(seed=0)
    envs.step(np.zeros((2, 4)))
    with pytest.raises(ValueError, match=r"worlds \[0, 1\] are over"):
        envs.step(np.zeros((2, 4)))


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"num_envs": 0}, "num_envs = 0, must be at least 1"),
        ({"num_envs": 2, "processes": 3}, "processes = 3, must be 1 to 2"),
        ({"num_envs": 2, "render_mode": "human"}, "render_mode = 'human', allowed"),
        ({"num_envs": 2, "steps": 0}, "steps = 0"),
    ],
)
def test_refusals(arguments: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        VecBoxPushingEnv(**arguments)


def test_an_unknown_view_is_refused() -> None:
    with pytest.raises(ValueError, match="agents = 'robots', allowed"):
        make_vec(2, agents="robots")  # type: ignore[arg-type]
