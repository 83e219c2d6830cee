"""A scenario that is its own prediction: every decision is of the present states."""

from pathlib import Path

import pytest

from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.catalogue.learning_curve import measure
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of

MEETING = """
import copy
import numpy as np
import nested_agents as na


class Meeting(na.Scenario, na.Prediction):
    class Settings(na.ScenarioSettings):
        predicts: str = "itself"

    def __init__(self, settings):
        self.predicts = settings.predicts
        self.agents = ("a", "b")
        self.action_set = na.ActionSet()
        self.state_space = na.StateSpace("place", (na.Variable("place", "m", -1, 1),), n_own=1)
        self.kept = self

    def reset(self, seed, episode=0):
        self.places = np.random.default_rng(seed).uniform(-1, 1, (2, 1))
        return self.places

    def step(self, joint_action):
        self.places = self.moved(joint_action)
        reward = self.rewards(joint_action[None])[0]
        return na.Transition(self.places, reward, bool(reward > -0.1), False, {})

    def moved(self, actions):
        moves = 0.1 * np.array([1, -1, 0, 0])[actions]
        return np.clip(self.places + moves[..., None], -1, 1)

    def predict(self):
        if self.predicts == "a new object":
            return copy.copy(self)
        if self.predicts == "the same object":
            self.kept = Ahead(self) if self.kept is self else self.kept
            return self.kept
        return self

    def states(self, agent, joint_actions):
        return self.moved(joint_actions)[:, agent]

    def rewards(self, joint_actions):
        return -abs(self.moved(joint_actions)[..., 0]).max(axis=-1)


class Broken(Meeting):
    def states(self, agent, joint_actions):
        return super().states(agent, joint_actions) * np.nan


class Ahead(na.Prediction):
    def __init__(self, world):
        self.world = world

    def states(self, agent, joint_actions):
        return self.world.states(agent, joint_actions)

    def rewards(self, joint_actions):
        return self.world.rewards(joint_actions)
"""
EVALUATORS = ("auto", "exact", "sampling", "best-response")
DECIDING = [
    *({"decision": {"evaluator": name, "rule": "reward-and-value"}} for name in EVALUATORS),
    *({"decision": {"evaluator": "exact", "value_of": of}} for of in ("own", "below", "team")),
    {"decision": {"evaluator": "exact", "rule": "reward"}},
]


def rows(learner: dict, predicts: str, kind: str = "Meeting") -> list[str]:
    table = {
        "seeds": 1, "episodes": 5, "steps": 15, "evaluation": 3, "learner": learner,
        "scenario": {"kind": f"meeting.py:{kind}", "predicts": predicts},
    }  # fmt: skip
    trial = trials_of(Spec.of(table, Sources(Path(), {"meeting.py": MEETING})))[0]
    with trial.sources.active():
        return [repr(row) for row in measure(trial).rows]


@pytest.mark.parametrize("learner", DECIDING, ids=str)
def test_a_prediction_may_be_the_same_object_at_every_decision(learner: dict) -> None:
    expected = rows(learner, "a new object")
    assert rows(learner, "itself") == expected
    assert rows(learner, "the same object") == expected


@pytest.mark.parametrize("evaluator", EVALUATORS)
def test_a_prediction_that_is_not_finite_is_refused(evaluator: str) -> None:
    with pytest.raises(ValueError, match=r"Broken: predicted states of agent \d are not finite"):
        rows({"decision": {"evaluator": evaluator}}, "itself", "Broken")
