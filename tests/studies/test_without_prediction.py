"""A scenario that predicts nothing: who acts there does, and who needs predictions is refused."""

from pathlib import Path

import numpy as np
import pytest

from nested_agents.core.agents.joint import join_agents
from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.interface.scenario import Scenario
from nested_agents.core.learners.td import FrozenSettings
from nested_agents.core.networks.settings import PPOSettings
from nested_agents.scenarios.checking.checker import CHECKS, check_scenario
from nested_agents.scenarios.line_up import LineUp, LineUpSettings
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.topologies import build, parse

MUTE = """
import numpy as np
import nested_agents as na

class Mute(na.Scenario):
    class Settings(na.ScenarioSettings):
        pass

    def __init__(self, settings):
        pass

    measures = (na.SUCCESS,)
    agents = ("one", "two")
    action_set = na.ActionSet()
    state_space = na.StateSpace("place", (na.Variable("place", "m", -1, 1),))

    def reset(self, seed, episode=0):
        self.places = np.random.default_rng(seed).uniform(-1, 1, (2, 1))
        return self.places

    def step(self, joint_action):
        self.places = np.clip(self.places + 0.1 * (joint_action[:, None] - 1.5), -1, 1)
        return na.Transition(self.places, -abs(self.places[:, 0]), False, False, {})
"""
SPEC = 'seeds = 1\nepisodes = 2\nsteps = 3\nevaluation = 1\nscenario.kind = "mute.py:Mute"\n'
RANDOM = FrozenSettings(decision={"rule": "random"})


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "mute.py").write_text(MUTE)
    (tmp_path / "spec.toml").write_text(SPEC)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "spec.toml"


@pytest.mark.parametrize("command", ["run", "plan", "check"])
def test_learners_that_need_predictions_are_refused_before_any_trial(
    command: str, spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--out", "results"] if command == "run" else []
    assert main([command, str(spec), *out]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "learner.kind = 'batch-td': needs predicted states" in line
    assert "the scenario Mute has no method predict" in line
    assert "ppo" in line
    assert "learner.decision.rule = 'random'" in line
    assert [path.name for path in spec.parent.iterdir() if path.is_dir()] == []


def test_the_random_act_without_predictions(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (trial,) = trials_of(Spec.load(spec, ['preset="random"']))
    assert [row.steps for row in run_trial(trial).rows] == [3, 3, 3]
    assert main(["check", str(spec), "--set", 'preset="random"']) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "not checked predictions: the scenario Mute has no method predict" in printed


def test_settings_say_whether_they_need_predictions() -> None:
    assert FrozenSettings().needs_prediction
    assert not RANDOM.needs_prediction
    assert not PPOSettings().needs_prediction


class Unpredicted(LineUp):
    """Carts of which nothing is predicted."""

    predict = Scenario.predict

    def with_exact_prediction(self) -> None:
        """Return None, because nothing is predicted."""


def test_joint_agents_predict_what_their_scenario_predicts() -> None:
    mute = Unpredicted(LineUpSettings())
    assert not join_agents(LineUp(LineUpSettings()), "team").lacks_prediction
    assert "has no method predict" in join_agents(mute, "team").lacks_prediction
    assert join_agents(mute, "team").predict() is None
    findings = check_scenario(lambda: Unpredicted(LineUpSettings()))
    assert set(CHECKS) - set(findings.passed) == {"predictions", "sensed and predicted"}
    with pytest.raises(ValueError, match="has no method predict"):
        Team(FrozenSettings(), mute, build(parse("chain"), mute.agents), policy_seed(0))


def test_the_random_do_the_same_whether_predictions_are_there_or_not() -> None:
    def actions(scenario: LineUp) -> list[list[int]]:
        team = Team(RANDOM, scenario, build(parse("chain"), scenario.agents), policy_seed(3))
        records = control_loop(scenario, team, episodes=1, steps=5, seed=3)
        return [record.joint_action.tolist() for record in records]

    settings = LineUpSettings(carts=3)
    assert actions(LineUp(settings)) == actions(Unpredicted(settings))
    assert np.shape(actions(LineUp(settings))) == (5, 3)
