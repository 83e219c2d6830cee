"""The scenarios that examples write keep their promises, and the default learner learns them."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

import nested_agents as na
from nested_agents.core.protocols import ExactlyPredictedScenario, measures_of, roles_of
from nested_agents.core.sources import Sources
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


Arm, Tank = example("arm").Arm, example("tank").Tank


@pytest.mark.parametrize("links", [2, 3, 5, 8])
def test_arms_keep_their_promises(links: int) -> None:
    assert check_scenario(lambda: Arm(Arm.Settings(links=links))) == tuple(CHECKS)
    arm = Arm(Arm.Settings(links=links))
    assert isinstance(arm, ExactlyPredictedScenario)
    assert roles_of(arm) == ("joint",) * links
    assert [measure.name for measure in measures_of(arm)] == ["success", "final_distance"]


@pytest.mark.parametrize("pumps", [1, 3, 6])
def test_tanks_keep_their_promises(pumps: int) -> None:
    assert check_scenario(lambda: Tank(Tank.Settings(pumps=pumps))) == tuple(CHECKS)


@pytest.mark.parametrize("name", ["arm.py:Arm", "tank.py:Tank"])
def test_a_spec_finds_them_by_name(name: str) -> None:
    with Sources(EXAMPLES).active():
        scenario = SCENARIOS.parsed(name).build()
    assert len(scenario.agents) == 3


def solved(scenario, team: na.Team, first: int, episodes: int, *, learn: bool) -> int:
    loop = na.control_loop(
        scenario, team, episodes=episodes, steps=150, seed=0, first_episode=first, learn=learn
    )
    return sum(record.transition.terminated for record in loop)


def test_an_arm_is_learned_by_the_default_learner() -> None:
    arm = Arm()
    hierarchy = na.build_hierarchy(na.parse_topology("chain"), arm.agents)
    team = na.Team.build(na.BatchTDSettings(), arm, hierarchy, na.policy_seed(0))
    before = solved(arm, team, 1000, 10, learn=False)
    solved(arm, team, 0, 20, learn=True)
    assert before <= 2
    assert solved(arm, team, 1000, 10, learn=False) >= 9
