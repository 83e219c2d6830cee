"""The scenario that an example writes keeps its promises."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.checking.checker import CHECKS, check_scenario
from nested_agents.studies.cli.main import main

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


Tank = example("tank").Tank
Aloha = example("worlds/aloha").Aloha


@pytest.mark.parametrize("pumps", [1, 3, 6])
def test_tanks_keep_their_promises(pumps: int) -> None:
    assert check_scenario(lambda: Tank(Tank.Settings(pumps=pumps))).passed == tuple(CHECKS)


def test_a_spec_finds_it_by_name() -> None:
    with Sources(EXAMPLES).active():
        scenario = SCENARIOS.parsed("tank.py:Tank").build()
    assert len(scenario.agents) == 3


def test_islands_are_an_environment_of_pettingzoo(capsys: pytest.CaptureFixture[str]) -> None:
    parallel_api_test(Aloha(), num_cycles=50)
    parallel_seed_test(Aloha)
    assert "Passed Parallel API test" in capsys.readouterr().out


def test_islands_send_what_no_neighbor_disturbs() -> None:
    env = Aloha(arrival=0.0)
    env.reset(seed=0)
    seen, rewards, *_ = env.step({a: a in ("island1", "island2", "island9") for a in env.agents})
    assert set(rewards.values()) == {0.1 - 20.0}  # 1 and 2 collide
    assert [agent for agent, backlog in seen.items() if backlog == 0] == ["island9"]
    _, rewards, *_ = env.step({a: a in ("island9", "island10") for a in env.agents})
    assert set(rewards.values()) == {-10.0}  # 9 has nothing to send, and disturbs 10
    for _ in range(18):
        *_, truncated, _ = env.step(dict.fromkeys(env.agents, 0))
    assert all(truncated.values())
    assert env.agents == []


@pytest.mark.parametrize(("is_told", "reached"), [(True, 9.25), (False, 6.15)])
def test_rules_of_thumb_send_messages(is_told: bool, reached: float) -> None:
    """Islands send unless a neighbor listed before does; or those of one color of a board."""
    env, returns = Aloha(), np.zeros(100)
    before = np.tril(env.near)
    for episode in range(len(returns)):
        env.reset(seed=episode)
        while env.agents:
            sends = np.zeros(10, dtype=bool)
            for i in range(10):
                free = not sends[before[i]].any() if is_told else (i // 5 + i % 5) % 2 == 0
                sends[i] = env.backlog[i] > 0 and free
            _, rewards, *_ = env.step(dict(zip(env.agents, sends, strict=True)))
            returns[episode] += rewards["island1"]
    assert returns.mean() == pytest.approx(reached, abs=0.05)


def test_a_spec_names_islands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(EXAMPLES / "worlds" / "aloha.toml"), "--steps", "20"]) == 0
    assert "passed" in capsys.readouterr().out
