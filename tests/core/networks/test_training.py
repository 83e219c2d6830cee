"""Teams of PPO agents learn, are saved and restored, and continue elsewhere."""

from typing import Any

import numpy as np
import pytest
from acting import look

from nested_agents.core.agents.fuzzy import FuzzyAgents
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.experience import Experience
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.core.learners import LEARNERS
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import arrange, check_conditions
from nested_agents.studies.trials.session import Session, run_trial
from nested_agents.studies.trials.trial import trials_of

PPO = {"rollout": 16, "batch_size": 8, "epochs": 2}
KINDS: dict[str, dict[str, Any]] = {
    "ppo": {"kind": "ppo", **PPO},
    "ippo": {"kind": "ippo", **PPO},
    "mappo": {"kind": "mappo", **PPO},
    "hierarchy-ppo": {"kind": "hierarchy-ppo", **PPO},
    "own weights": {"kind": "hierarchy-ppo", "weights": "own", **PPO},
}
MIXED = [
    {"agents": "cart1", "learner": KINDS["ippo"]},
    {"agents": ["cart2", "cart3"], "learner": KINDS["ppo"]},
    {"agents": ["cart4", "cart5"], "learner": KINDS["hierarchy-ppo"]},
    {"agents": "cart6", "learner": KINDS["mappo"]},
    {"agents": "*", "learner": {"kind": "fitted-q"}},
]


def spec_of(name: str, **changes: Any) -> Spec:
    table: dict[str, Any] = {
        "study": "learning-curve",
        "seeds": [10_000],
        "episodes": 6,
        "steps": 11,
        "evaluation": 2,
        "scenario": {"kind": "line-up", "carts": 2},
        "learner": KINDS[name],
    }
    return Spec.of({**table, **changes})


def same(one: Session, other: Session) -> bool:
    first, second = one.team.state_dict(), other.team.state_dict()
    assert first.keys() == second.keys()
    return all((first[name] == second[name]).all() for name in first)


@pytest.mark.parametrize("failing", [False, True])
@pytest.mark.parametrize("name", KINDS)
def test_a_restored_team_goes_on_to_the_same_bits(name: str, failing: bool) -> None:
    topology: dict[str, Any] = {"kind": "chain"}
    if failing:
        topology["failures"] = [{"kind": "lost", "agents": "*", "probability": 0.5}]
    (trial,) = trials_of(spec_of(name, topology=topology))
    session = Session(trial)
    for episode in range(6):
        kept = {key: array.copy() for key, array in session.team.state_dict().items()}
        restored = Session.restored(trial, kept)
        session.train(1, episode)
        restored.train(1, episode)
        assert same(session, restored), f"after episode {episode}"
    kept = {key: array.copy() for key, array in session.team.state_dict().items()}
    restored = Session.restored(trial, kept)
    for one in (session, restored):
        one.evaluate()
        one.run_other_evaluations()
    evaluated = [row for row in session.result().rows if row.phase != "training"]
    assert list(restored.result().rows) == evaluated


def test_networks_are_parts_of_a_team() -> None:
    """Each learns of its own, is told of all others, goes on to the same bits when restored."""
    world = {"kind": "line-up", "carts": 8}
    learner = {"kind": "mixed", "parts": MIXED}
    (trial,) = trials_of(spec_of("ppo", scenario=world, learner=learner))
    session = Session(trial)
    for episode in range(3):
        restored = Session.restored(trial, session.team.state_dict())
        session.train(1, episode)
        restored.train(1, episode)
        assert same(session, restored)
    states = session.scenario.reset(0)
    seen = look(session.scenario, states)
    decision = session.team.act(seen)
    ppo: Any = session.team.parts[1]
    assert (decision.inputs[1].logits[0].any(axis=1) == [False, True, True, *[False] * 5]).all()
    assert ppo.policies["all"].rollout.actions.shape[1:] == (1, 1, 2)
    policies: Any = session.team.parts[2]
    expected = np.zeros((2, 7, 4))
    for place, agent in enumerate((3, 4)):
        expected[place, range(agent), decision.joint_action[:agent]] = 1.0
    told = decision.inputs[2].actor[0, [3, 4], : len(policies.told_names)]
    assert (told == expected.reshape(2, -1)).all()
    assert session.team.parts[3].told_names == [], "mappo is told nothing"


@pytest.mark.parametrize("name", KINDS)
def test_the_team_that_a_trial_keeps_is_the_one_that_was_evaluated(name: str) -> None:
    (trial,) = trials_of(spec_of(name, keep_teams=True))
    result = run_trial(trial)
    restored = Session.restored(trial, result.recordings["team"])
    restored.evaluate()
    evaluated = [row for row in result.rows if row.phase == "evaluation"]
    assert list(restored.result().rows) == evaluated


@pytest.mark.parametrize("name", KINDS)
def test_arrays_of_other_teams_are_refused(name: str) -> None:
    other = "mappo" if name == "ppo" else "ppo"
    arrays = arrange(spec_of(other).conditions()[0].settings, 0).team.state_dict()
    team = arrange(spec_of(name).conditions()[0].settings, 0).team
    with pytest.raises(ValueError, match=r"^team: ") as raised:
        team.load_state_dict(arrays)
    assert "\n" not in str(raised.value)


def test_arrays_of_more_policies_are_refused() -> None:
    settings = [spec_of(name).conditions()[0].settings for name in ("own weights", "ippo")]
    own, every = (arrange(each, 0).team for each in settings)
    with pytest.raises(ValueError, match=r"^team: the saved state has further policies than all$"):
        every.load_state_dict({**own.state_dict(), **every.state_dict()})


ELSEWHERE: dict[str, dict[str, Any]] = {
    "more agents": {"carts": 4},
    "star": {"topology": {"kind": "star"}},
    "reversed": {"topology": {"kind": "chain", "order": "reversed"}},
    "independent": {"topology": "independent"},
    "lost": {"topology": {"kind": "chain", "failures": [{"kind": "lost", "agents": "*"}]}},
    "delayed": {"topology": {"kind": "chain", "failures": [{"kind": "delayed", "agents": "*"}]}},
}


@pytest.mark.parametrize("name", ["ippo", "mappo", "hierarchy-ppo"])
def test_teams_are_evaluated_and_taught_elsewhere(name: str) -> None:
    stages = [
        {"name": "one", "episodes": 2, "scenario": {"carts": 1}},
        {"name": "three", "episodes": 2, "scenario": {"carts": 3}},
    ]
    spec = spec_of(name, episodes=2, evaluations=ELSEWHERE, curriculum=stages)
    check_conditions(spec)
    (trial,) = trials_of(spec)
    rows = run_trial(trial).rows
    phases = {row.phase for row in rows}
    assert {f"evaluation:{other}" for other in ELSEWHERE} < phases
    assert {"training:one", "training:three"} < phases
    assert run_trial(trial).rows == rows


@pytest.mark.parametrize("critic", ["own", "central"])
def test_weights_go_on_with_the_names_of_inputs(critic: str) -> None:
    """Whoever decides first says as much as before, who is told of nobody new decides as before."""
    table = {**KINDS["hierarchy-ppo"], "critic": critic}
    chain = spec_of("hierarchy-ppo", learner=table, scenario={"kind": "line-up", "carts": 3})
    others = {
        "reversed": {"topology": {"kind": "chain", "order": "reversed"}},
        "more": {"scenario": {"kind": "line-up", "carts": 5}},
    }
    session = Session(trials_of(chain)[0])
    session.train(3)
    former: Any = session.team.parts[0]
    for name, changes in others.items():
        spec = spec_of(
            "hierarchy-ppo",
            **{"learner": table, "scenario": {"kind": "line-up", "carts": 3}, **changes},
        )
        there = arrange(spec.conditions()[0].settings, 0)
        agents: Any = there.team.parts[0]
        agents.warm_start(former)
        before = dict(zip(former.input_names[0], weights_into(former), strict=True))
        after = dict(zip(agents.input_names[0], weights_into(agents), strict=True))
        for input_, column in after.items():
            assert (column == before.get(input_, 0.0)).all(), (name, input_)
        assert {*after} - {*before}, "some inputs are new"
        states = np.random.default_rng(0).random((5, there.scenario.state_space.n_variables))
        first = int(there.team.hierarchy.order[0])
        seen = look(there.scenario, states[: len(there.scenario.agents)])
        inputs = agents.observe(seen, explore=False)
        there.team._decide(seen, (inputs,), None)
        alike = look(former.scenario, states[:3])
        own = former.observe(alike, explore=False)
        own.actor[..., : len(former.told_names)] = 0.0
        if first < 3:
            expected = former.policies["all"].logits(own.actor[0, [first]])[0, 0]
            assert inputs.logits[0, first] == pytest.approx(expected, abs=1e-6)


def weights_into(agents: Any) -> Any:
    return agents.policies["all"].actor._layers[0][0]


def test_whose_weights_are_their_own_meet_no_other_agents() -> None:
    spec = spec_of("own weights", evaluations={"more": {"carts": 4}})
    with pytest.raises(SpecError, match=r"evaluations.more: .*'own'; with 'all', all") as raised:
        check_conditions(spec)
    assert "\n" not in str(raised.value)


def test_a_policy_of_all_meets_no_other_agents() -> None:
    spec = spec_of("ppo", evaluations={"more": {"carts": 3}})
    problem = "one policy acts for all of them"
    with pytest.raises(SpecError, match=f"evaluations.more: .*{problem}") as raised:
        check_conditions(spec)
    assert "\n" not in str(raised.value)


def ended(name: str, *, terminated: bool) -> Any:
    """Return the agents of a team after a single decision that ended its episode."""
    (trial,) = trials_of(spec_of(name))
    session = Session(trial)
    team = session.team
    seen = look(session.scenario, session.scenario.reset(0))
    team.reset(0, 0, learn=True)
    decision = team.act(seen)
    states = session.scenario.step(decision.joint_action).states
    over = Transition(states, 1.0, terminated, not terminated, {})
    team.learn(Experience(seen, decision, over, last=True))
    return team.parts[0], states


@pytest.mark.parametrize("name", ["ppo", "ippo", "mappo", "hierarchy-ppo"])
def test_only_an_episode_that_was_cut_off_is_worth_what_would_have_come(name: str) -> None:
    rewards, ahead = [], np.zeros(0)
    for terminated in (True, False):
        agents, states = ended(name, terminated=terminated)
        (policy,) = agents.policies.values()
        rewards.append(policy.rollout.rewards[0, 0].copy())
        own, joint = agents._encode(states[None])
        ahead = policy.values(own[:, agents._rows["all"]], joint)[0]
    assert ahead.any()
    assert rewards[1] - rewards[0] == pytest.approx(agents.settings.discount * ahead, rel=1e-3)


class Beacons(Scenario):
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


@pytest.mark.parametrize("name", KINDS)
def test_equal_seeds_give_equal_bits(name: str) -> None:
    (trial,) = trials_of(spec_of(name))
    first = run_trial(trial)
    session = Session(trial)
    session.train(2)
    session.train(4, 2)
    session.evaluate()
    session.run_other_evaluations()
    assert session.result().rows == first.rows
    assert all(np.isfinite(array).all() for array in session.team.state_dict().values())
    (other,) = trials_of(spec_of(name, seeds=[10_001]))
    assert run_trial(other).rows != first.rows


@pytest.mark.parametrize("kind", ["ppo", "ippo", "mappo"])
def test_agents_learn(kind: str) -> None:
    table = {"kind": kind, "rollout": 32, "learning_rate": 0.003, "entropy": 0.02}
    world = Beacons(10_000)
    settings: Any = LEARNERS.model(kind).model_validate(table)
    team = Team(settings, world, Hierarchy(world.agents, []), np.random.SeedSequence(0))

    def rate(episodes: int, *, learn: bool) -> float:
        paid = 0.0
        for _ in range(episodes):
            team.reset(0, 0, learn=True)
            seen = look(world, world.reset())
            decision = team.act(seen, explore=learn)
            transition = world.step(decision.joint_action)
            paid += np.mean(transition.reward)
            if learn:
                team.learn(Experience(seen, decision, transition, last=True))
        return paid / episodes

    rate(500, learn=True)
    assert rate(100, learn=False) > 0.6  # of a quarter by chance


def test_code_that_needs_rule_bases_says_so() -> None:
    team = arrange(spec_of("ppo").conditions()[0].settings, 0).team
    with pytest.raises(
        ValueError, match="needs one part of FuzzyAgents; the team has Central"
    ) as raised:
        team.only(FuzzyAgents)
    assert "\n" not in str(raised.value)
