"""A learner, an evaluator and an exploration of one's own from files; scenarios of few members."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from acting import fuzzy, joint_of, look

from nested_agents.core.agents.joint import join_agents
from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.learners import LEARNERS
from nested_agents.core.learners.batch import BatchTDSettings
from nested_agents.core.plugins.sources import Sources
from nested_agents.core.search import EVALUATORS
from nested_agents.core.search.exploration import EXPLORATIONS

MINE = """
import numpy as np
from nested_agents.core.search.evaluator import Counts, Evaluator, EvaluatorSettings
from nested_agents.core.search.exploration import ExplorationSettings, Explorer
from nested_agents.core.learners.learner import Learner, LearnerSettings

class MonteCarlo(Learner):
    '''Weights a step towards every reward.'''

    class Settings(LearnerSettings):
        step_size: float = 0.5

    def __init__(self, settings, rules, rows):
        self.settings, self.rules, self.rows = settings, rules, rows
        self.theta = np.zeros((int(rows.max()) + 1, rules.n_rules))

    def observe(self, states, reward, terminated):
        step = self.settings.step_size * np.broadcast_to(reward, len(states))
        np.add.at(self.theta, self.rows, step[:, None] * self.rules.features(states))
        return self.theta.size

class Favorite(EvaluatorSettings):
    action: int = 1

    def build(self, problem):
        return Fixed(np.eye(problem.n_actions)[self.action])

class Fixed(Evaluator):
    def __init__(self, found):
        self.found, self.counts = found, Counts()

    def values(self, deliberation):
        self.counts.joint_actions += 1
        return self.found

class Least(Explorer):
    '''Takes the action of least value.'''

    class Settings(ExplorationSettings):
        pass

    def __init__(self, settings, n_agents):
        self.memory = np.zeros(n_agents)

    def choose(self, agent, values, rng):
        self.memory[agent] += 1
        return int(values.argmin())
"""
TABLE = {
    "kind": "mine.py:MonteCarlo",
    "step_size": 0.25,
    "exploration": {"kind": "mine.py:Least"},
    "decision": {"evaluator": {"kind": "mine.py:Favorite", "action": 3}},
}


class FewMembers(Scenario):
    """Scenario with the necessary members only; its prediction gives next states only."""

    def __init__(self, world) -> None:
        self.agents, self.state_space = world.agents, world.state_space
        self.action_set = world.action_set
        self._world = world

    def reset(self, seed, episode=0) -> np.ndarray:
        return self._world.reset(seed, episode)

    def step(self, joint_action) -> Transition:
        return self._world.step(joint_action)

    def predict(self) -> Prediction:
        return StatesOnly(self._world.predict())


class StatesOnly(Prediction):
    """Prediction of next states, without rewards and tables."""

    def __init__(self, complete: Prediction) -> None:
        self._complete = complete

    def states(self, agent, joint_actions) -> np.ndarray:
        return self._complete.states(agent, joint_actions)


def team_of(settings, scenario) -> Team:
    hierarchy = Hierarchy(scenario.agents, [scenario.agents] if len(scenario.agents) == 2 else [])
    return Team(settings, scenario, hierarchy, policy_seed(1))


def test_a_team_of_ones_own_parts(line_world, tmp_path) -> None:
    world = line_world(carts=2, wheels=1)
    with Sources(texts={"mine.py": MINE}).active():
        settings = LEARNERS.model("mine.py:MonteCarlo").model_validate(TABLE)
        assert (
            LEARNERS.model("mine.py:MonteCarlo").model_validate(settings.model_dump()) == settings
        )
        team, restored = team_of(settings, world), team_of(settings, world)
    rewarded = np.zeros_like(fuzzy(team).learner.theta)
    for record in control_loop(world, team, episodes=2, steps=4, seed=3):
        assert record.joint_action.tolist() == [0, 0]  # the least of 0, 0, 0, 1
        features = fuzzy(team).learner.rules.features(record.transition.states)  # type: ignore[attr-defined]
        rewarded += 0.25 * record.transition.reward * features
    assert fuzzy(team).learner.theta == pytest.approx(rewarded, rel=0, abs=1e-15)
    assert fuzzy(team).explorer.memory.tolist() == [8, 8]
    assert fuzzy(team).evaluator.counts.joint_actions == 16
    assert joint_of(team, world, explore=False).tolist() == [3, 3]
    team.save(tmp_path / "team.npz")
    restored.load(tmp_path / "team.npz")
    assert (fuzzy(restored).learner.theta == fuzzy(team).learner.theta).all()


def test_values_of_other_than_all_actions_are_refused(line_world) -> None:
    world = line_world(carts=2, wheels=1)
    team = team_of(BatchTDSettings(), world)
    fuzzy(team).search.evaluator = SimpleNamespace(values=lambda deliberation: np.zeros(2))
    team.reset(0, 0, learn=True)
    world.reset(0)
    with pytest.raises(ValueError, match=r"^the evaluator returned 2 values for 4 actions$"):
        joint_of(team, world)


@pytest.mark.parametrize(
    ("table", "base"),
    [
        ({"kind": "plain.py:Plain"}, "learner.kind: Plain must inherit nested_agents.Learner"),
        (
            {"exploration": {"kind": "plain.py:Still"}},
            "learner.exploration.kind: Still must inherit nested_agents.Explorer",
        ),
        (
            {"decision": {"evaluator": {"kind": "plain.py:Zero"}}},
            "learner.decision.evaluator: Zero must inherit nested_agents.Evaluator",
        ),
    ],
)
def test_parts_must_inherit_their_base_class(table: dict, base: str, line_world) -> None:
    text = """
import nested_agents as na
class Plain:
    class Settings(na.LearnerSettings): pass
    def __init__(self, *given): pass
class Still:
    class Settings(na.ExplorationSettings): pass
    def __init__(self, *given): pass
class Zero:
    class Settings(na.EvaluatorSettings): pass
    def __init__(self, *given): pass
"""
    with Sources(texts={"plain.py": text}).active():
        kind = table.get("kind", "batch-td")
        settings = LEARNERS.model(kind).model_validate({**table, "kind": kind})
        with pytest.raises(ValueError, match=base):
            team_of(settings, line_world(carts=2, wheels=1))


@pytest.mark.parametrize("name", ["auto", "exact", "sampling"])
@pytest.mark.parametrize("agents", ["actuator", "body", "team"])
def test_a_scenario_of_few_members_is_learned(name: str, agents, line_world) -> None:
    scenario = FewMembers(line_world(carts=2, wheels=1))
    seen = join_agents(scenario, agents)
    settings = BatchTDSettings.model_validate({"decision": {"evaluator": name}})
    team = team_of(settings, seen)
    records = list(control_loop(seen, team, episodes=2, steps=5, seed=0))
    assert len(records) == 10
    assert fuzzy(team).learner.theta.any()


@pytest.mark.parametrize("agents", ["actuator", "body", "team"])
@pytest.mark.parametrize("rule", ["reward", "reward-and-value"])
def test_rewards_that_are_not_predicted_cannot_decide(rule: str, agents, line_world) -> None:
    scenario = FewMembers(line_world(carts=2, wheels=1))
    seen = join_agents(scenario, agents)
    team = team_of(BatchTDSettings.model_validate({"decision": {"rule": rule}}), seen)
    seen.reset(0)
    said = rf"^learner\.decision\.rule = '{rule}': no rewards are predicted, use value$"
    with pytest.raises(ValueError, match=said):
        team.check(look(seen))
    with pytest.raises(ValueError, match=said):
        next(control_loop(seen, team, episodes=1, steps=1, seed=0))


@pytest.mark.parametrize("rule", ["reward", "reward-and-value"])
def test_rewards_without_tables_decide_too(rule: str, line_world) -> None:
    world, few = line_world(carts=2, wheels=1), FewMembers(line_world(carts=2, wheels=1))

    class WithRewards(StatesOnly):
        def rewards(self, joint_actions) -> np.ndarray:
            return self._complete.rewards(joint_actions)

    few.predict = lambda: WithRewards(few._world.predict())  # type: ignore[method-assign]
    chosen = []
    for scenario in (world, few):
        team = team_of(BatchTDSettings.model_validate({"decision": {"rule": rule}}), scenario)
        records = control_loop(scenario, team, episodes=2, steps=5, seed=0)
        chosen.append([record.joint_action.tolist() for record in records])
    assert chosen[0] == chosen[1]


def test_settings_are_read_without_numba_and_scipy() -> None:
    models = [(r, name) for r in (LEARNERS, EVALUATORS, EXPLORATIONS) for name in r.built_in]
    assert len(models) >= 12
    program = """
import sys
import nested_agents.core.learners.learner
from nested_agents.core.search import EVALUATORS
from nested_agents.core.search.exploration import EXPLORATIONS
from nested_agents.core.learners import LEARNERS
for registry in (LEARNERS, EVALUATORS, EXPLORATIONS):
    for name in registry.built_in:
        registry.model(name)
print(*({"numba", "scipy"} & {name.partition(".")[0] for name in sys.modules}))
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == []
