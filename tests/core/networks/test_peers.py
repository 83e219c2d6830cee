"""Learners of other libraries in the control loop: equal bits, what they see, what they learn."""

from typing import Any

import numpy as np
import pytest
from acting import look

from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.agents import Agents
from nested_agents.core.interface.experience import Experience, Observation
from nested_agents.core.interface.plain import as_scenario
from nested_agents.core.interface.scenario import Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.core.learners import LEARNERS
from nested_agents.core.networks.inputs import FARTHEST, Inputs, RewardScale
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.session import Session, run_trial
from nested_agents.studies.trials.trial import trials_of

TABLE: dict[str, Any] = {
    "study": "peers", "seeds": [10_000], "episodes": 3, "steps": 20, "evaluation": 2,
    "scenario": {"kind": "line-up", "carts": 2},
}  # fmt: skip
SHORT = {
    "ppo": {"kind": "ppo", "rollout": 16, "batch_size": 8, "epochs": 2},
    "ippo": {"kind": "ippo", "rollout": 16, "batch_size": 8, "epochs": 2},
    "mappo": {"kind": "mappo", "rollout": 16, "batch_size": 8, "epochs": 2},
    "dqn": {"kind": "dqn", "begin": 10, "target_interval": 20, "memory": 100},
}


def spec_of(kind: str, **changes: Any) -> Spec:
    single = {"agents": "team"} if kind == "dqn" else {}
    return Spec.of({**TABLE, **single, "learner": SHORT[kind], **changes})


class Beacons:
    """Agents see which of four beacons is lit, and are paid for naming it; an episode is a step."""

    agents = ("a", "b")
    action_set = ActionSet()
    state_space = StateSpace("beacons", tuple(Variable(f"b{i}", "1", 0, 1) for i in range(4)))

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def reset(self, seed: Any = 0, episode: int = 0) -> Any:
        self.lit = self.rng.integers(4, size=2)
        return np.eye(4)[self.lit]

    def step(self, joint: Any) -> Transition:
        rewards = (joint == self.lit).astype(float)
        return Transition(np.zeros((2, 4)), rewards, True, False, {})


def test_inputs_by_hand() -> None:
    class Two(Beacons):
        groups = ((0, 1),)
        state_space = StateSpace(
            "two", (Variable("speed", "1", -2, 2), Variable("way", "rad", 0, 2, periodic=True)), 1
        )

    inputs = Inputs(as_scenario(Two(0)))
    states = np.array([[1.0, 0.5], [-100.0, 0.5]])
    assert inputs.each(states) == pytest.approx(
        np.array([[0.5, 1, 0, 1, 0], [-FARTHEST, 1, 0, 0, 1]]), abs=1e-12
    )
    assert inputs.joint(states) == pytest.approx([0.5, -FARTHEST, 1, 0], abs=1e-12)
    assert (inputs.n_own, inputs.n_joint) == (5, 4)


def test_what_is_seen_is_the_present_and_what_may_follow() -> None:
    scenario = LineUpSettings(carts=2).build()
    states = scenario.reset(3)
    seen = look(scenario, states)
    assert isinstance(seen, Observation)
    assert seen.present is states
    joint = np.array([[0, 1], [2, 3]])
    assert (seen.states(1, joint) == scenario.predict().states(1, joint)).all()


def test_rewards_are_scaled_by_the_spread_of_returns() -> None:
    scale, rng = RewardScale(0.5, 1), np.random.default_rng(0)
    for _ in range(5000):
        scale.scaled(rng.standard_normal(1))
    assert scale.scaled(np.ones(1))[0] == pytest.approx(np.sqrt(1 - 0.25), rel=0.05)


def test_an_extra_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "nested_agents.core.networks.policies", None)
    with pytest.raises(SpecError, match=r"'ippo': needs the extra peers, pip install") as raised:
        check_conditions(spec_of("ippo"))
    assert "\n" not in str(raised.value)
    assert str(raised.value).endswith(
        "learner.environments = 16 in study = 'experience' does without"
    )


@pytest.mark.parametrize("kind", SHORT)
def test_equal_seeds_give_equal_bits(kind: str) -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    (trial,) = trials_of(spec_of(kind))
    first = run_trial(trial)
    np.random.seed(5)  # noqa: NPY002 - whatever the global generators are at
    session = Session(trial)
    session.train(2)
    session.train(1, 2)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    session.evaluate()
    session.run_other_evaluations()
    assert session.result().rows == first.rows
    assert (np.random.get_state()[1] == before).all()  # noqa: NPY002
    assert all(np.isfinite(array).all() for array in session.team.arrays().values())
    (other,) = trials_of(spec_of(kind, seeds=[10_001]))
    assert run_trial(other).rows != first.rows


@pytest.mark.parametrize("kind", ["ppo", "ippo", "mappo"])
def test_they_learn(kind: str) -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    table = {"kind": kind, "rollout": 32, "learning_rate": 0.003, "entropy": 0.02}
    world = Beacons(10_000)
    settings: Any = LEARNERS.model(kind).model_validate(table)
    team = Team(settings, world, Hierarchy(world.agents, []), np.random.SeedSequence(0))

    def rate(episodes: int, *, learn: bool) -> float:
        paid = 0.0
        for _ in range(episodes):
            team.begin_episode()
            seen = look(world, world.reset())
            decision = team.act(seen, explore=learn)
            transition = world.step(decision.joint_action)
            paid += np.mean(transition.reward)
            if learn:
                team.learn(Experience(seen, decision, transition, last=True))
        return paid / episodes

    rate(500, learn=True)
    assert rate(100, learn=False) > 0.6  # of a quarter by chance


@pytest.mark.parametrize("kind", SHORT)
def test_arrays_act_as_the_networks_do(kind: str) -> None:
    torch: Any = pytest.importorskip("torch", reason="extra [peers]")
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    session = Session(trials_of(spec_of(kind))[0])
    session.train(2)  # the networks have been updated by now
    agents: Any = session.team.only(Agents)
    policy = agents._model.policy if kind == "dqn" else agents.policies["all"].model.policy
    n_inputs = policy.observation_space.shape[0]
    seen = np.random.default_rng(0).standard_normal((5, n_inputs)).astype(np.float32)
    with torch.no_grad():
        if kind == "dqn":
            pairs = [(agents._q(seen), policy.q_net(torch.as_tensor(seen)))]
        else:
            features = policy.mlp_extractor(torch.as_tensor(seen))
            pairs = [(agents.policies["all"].actor(seen), policy.action_net(features[0]))]
            pairs += [(agents.policies["all"].critic(seen), policy.value_net(features[1]))]
    for ours, theirs in pairs:
        assert ours == pytest.approx(theirs.numpy(), abs=1e-5)


def test_dqn_needs_one_agent() -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    with pytest.raises(SpecError, match=r"dqn': acts for one agent, there are 2; use agents"):
        check_conditions(spec_of("dqn", agents="actuator"))


def test_what_needs_rule_bases_says_so() -> None:
    pytest.importorskip("stable_baselines3", reason="extra [peers]")
    (trial,) = trials_of(spec_of("ppo", study="related"))
    from nested_agents.research.studies.related import measure

    with pytest.raises(ValueError, match="needs FuzzyAgents, the team is of CentralPPO") as raised:
        measure(trial)
    assert "\n" not in str(raised.value)
