"""Tasks of VMAS: each world by its seed, many at once as one by itself, what is refused."""

import numpy as np
import pytest

from nested_agents.core.interface.stacked import LoopedEnvironments
from nested_agents.scenarios import SCENARIOS
from nested_agents.studies.catalogue.experience import measure
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.trial import trials_of

pytest.importorskip("vmas", reason="extra vmas")

COUNT = 5


def build(task, **keys):
    return SCENARIOS.parsed("vmas", task=task, **keys).build()


def seeds(first, count=COUNT):
    return [np.random.SeedSequence(3, spawn_key=(0, first + k)) for k in range(count)]


@pytest.mark.parametrize("task", ["navigation", "dispersion"])
def test_many_worlds_are_each_by_itself(task):
    many = build(task).environments(COUNT)
    single = LoopedEnvironments([build(task) for _ in range(COUNT)])
    assert np.array_equal(many.reset(seeds(0)), single.reset(seeds(0)))
    rng = np.random.default_rng(0)
    n, n_actions = len(build(task).agents), len(build(task).action_set)
    for step in range(12):
        joint = rng.integers(0, n_actions, (COUNT, n))
        for one, other in zip(many.step(joint), single.step(joint), strict=True):
            assert np.allclose(one, other, rtol=0.0, atol=1e-5)
        if step == 6:
            begun = [worlds.begin([1, 3], seeds(9, 2), 9) for worlds in (many, single)]
            assert np.allclose(*begun, rtol=0.0, atol=1e-6)


def test_an_episode_follows_from_its_seed_and_ends():
    first, second = build("balance", most_decisions=3), build("balance", most_decisions=3)
    second.reset(7)
    assert np.array_equal(first.reset(1), second.reset(1))
    n = len(first.agents)
    ends = [first.step(np.zeros(n, int)).truncated for _ in range(3)]
    assert ends == [False, False, True]
    assert build("balance", options={"n_agents": 5}).agents[-1] == "agent_4"


def test_a_return_is_a_success_if_it_is_said_to_be():
    world = build("navigation", success_return=-1000.0)
    world.reset(0)
    assert world.step(np.zeros(4, int)).info["succeeded"]
    (warning,) = SCENARIOS.parsed("vmas", task="navigation").warnings()
    assert "not set, so studies compare returns" in warning


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"task": "balanse"}, "scenario.task = 'balanse': did you mean 'balance'"),
        ({"task": "balance", "options": {"continuous_actions": True}}, "VMAS's discrete actions"),
        ({"task": "balance", "options": {"n_agents": "many"}}, "cannot be made, TypeError"),
        ({"task": "simple_adversary"}, "agents must have equal spaces"),
    ],
)
def test_bad_input_is_one_line(keys, message):
    with pytest.raises(ValueError, match=message) as refusal:
        build(**keys)
    assert "\n" not in str(refusal.value)


def test_networks_train_in_it_to_the_same_rows():
    learner = {"kind": "mappo", "environments": 8, "rollout": 10, "batch_size": 80, "epochs": 1}
    table = {
        "study": "experience", "seeds": 1, "decisions": 400, "steps": 20, "evaluation": 1,
        "scenario": {"kind": "vmas", "task": "balance"}, "learner": learner,
    }  # fmt: skip
    (trial,) = trials_of(Spec.of(table))
    first = measure(trial)
    assert first.rows == measure(trial).rows
    assert first.numbers == {"decisions": 400.0}
