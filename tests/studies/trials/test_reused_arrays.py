"""A scenario of a user may reuse each array that it returns: everything enters as a copy."""

from pathlib import Path

import numpy as np
import pytest

from nested_agents.core.interface.scenario import Transition
from nested_agents.core.interface.stacked import LoopedEnvironments
from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.catalogue.learning_curve import measure
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import Trial, trials_of

MEETING = '''
import numpy as np
import nested_agents as na

REUSES = False
KEPT = {}


def given(name, values):
    """Return values in the same array each time, or in a new one."""
    values = np.array(values, float)
    if not REUSES:
        return values
    kept = KEPT.setdefault((name, values.shape), np.empty_like(values))
    kept[...] = values
    return kept


class Meeting(na.Scenario):
    class Settings(na.ScenarioSettings):
        walkers: int = 2

    measures = (na.SUCCESS, na.Measure("spread", "final spread", "m", "spread", better="lower"))

    def __init__(self, settings):
        self.agents = tuple(map(str, range(settings.walkers)))
        self.action_set = na.ActionSet()
        self.state_space = na.StateSpace("place", (na.Variable("place", "m", -1, 1),), n_own=1)

    def reset(self, seed, episode=0):
        self.places = np.random.default_rng(seed).uniform(-1, 1, (len(self.agents), 1))
        return given("states", self.places)

    def step(self, joint_action):
        self.places = self.after(joint_action)
        rewards = -abs(self.places[:, 0])
        met = given("met", bool(max(-rewards) < 0.1))
        info = {"spread": given("spread", np.ptp(self.places))}
        if REUSES:
            joint_action[:] = 0
        return na.Transition(
            given("states", self.places), given("rewards", rewards), met, False, info
        )

    def after(self, actions):
        moves = 0.1 * np.array([1, -1, 0, 0])[actions]
        return np.clip(self.places + moves[..., None], -1, 1)

    def predict(self):
        return Ahead(self.after)


class Ahead(na.Prediction):
    def __init__(self, after):
        self.ahead = after

    def states(self, agent, joint_actions):
        return given("ahead", self.ahead(joint_actions)[:, agent])
'''

LEARNERS = [
    {"preset": "default"},
    {"learner": {"kind": "batch-td"}},
    {"learner": {"kind": "fitted-q"}},
]


def trial_of(learner: dict, *, reuses: bool) -> Trial:
    text = MEETING.replace("REUSES = False", f"REUSES = {reuses}")
    name = f"meeting{reuses}.py"
    table = {
        "seeds": 1, "episodes": 6, "steps": 15, "evaluation": 2,
        "scenario": {"kind": f"{name}:Meeting"}, **learner,
    }  # fmt: skip
    spec = Spec.of(table, Sources(Path(), {name: text}))
    return trials_of(spec)[0]


def rows(learner: dict, *, reuses: bool) -> list[str]:
    trial = trial_of(learner, reuses=reuses)
    with trial.sources.active():
        return [repr(row) for row in measure(trial).rows]


@pytest.mark.parametrize("learner", LEARNERS, ids=str)
def test_a_scenario_that_reuses_its_arrays_gives_equal_results(learner):
    assert rows(learner, reuses=True) == rows(learner, reuses=False)


def test_looped_environments_keep_no_array_of_a_scenario():
    trial = trial_of({}, reuses=True)
    environments = LoopedEnvironments([trial.world() for _ in range(2)])
    states = environments.reset(np.random.SeedSequence(0).spawn(2))
    assert (states[0] != states[1]).all()
    joint_actions = np.array([[0, 1], [1, 0]])
    first = environments.step(joint_actions)
    kept = first.states.copy(), first.rewards.copy(), first.terminated.copy()
    environments.step(np.ones_like(joint_actions))
    assert (joint_actions == [[0, 1], [1, 0]]).all()
    for before, now in zip(kept, first[:3], strict=True):
        np.testing.assert_array_equal(before, now)


def test_looped_environments_refuse_what_cannot_be_learned_from():
    trial = trial_of({}, reuses=False)
    environments = LoopedEnvironments([trial.world()])
    environments.reset(np.random.SeedSequence(0).spawn(1))
    returned = Transition(np.full((2, 1), 1j), 0.0, False, False, {})
    environments.instances[0].step = lambda joint_action: returned
    with pytest.raises(ValueError, match="complex128, allowed: real numbers"):
        environments.step(np.zeros((1, 2), int))
