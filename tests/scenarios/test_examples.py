"""The scenario that an example writes keeps its promises."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios import SCENARIOS
from nested_agents.scenarios.checking.checker import CHECKS, check_scenario

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


Tank = example("tank").Tank


@pytest.mark.parametrize("pumps", [1, 3, 6])
def test_tanks_keep_their_promises(pumps: int) -> None:
    assert check_scenario(lambda: Tank(Tank.Settings(pumps=pumps))).passed == tuple(CHECKS)


def test_a_spec_finds_it_by_name() -> None:
    with Sources(EXAMPLES).active():
        scenario = SCENARIOS.parsed("tank.py:Tank").build()
    assert len(scenario.agents) == 3
