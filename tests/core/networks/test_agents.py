"""Agents that act by PPO: communication, rewards, failures of messages, joint learners."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acting import look

import nested_agents as na
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.hierarchy.messages import Messages
from nested_agents.core.hierarchy.stages import decision_stages
from nested_agents.core.interface.experience import Experience
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.core.learners import LEARNERS
from nested_agents.core.networks.agents import CentralPPOAgents
from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios.line_up import LineUpSettings
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import arrange, check_conditions
from nested_agents.studies.trials.session import Session, run_trial
from nested_agents.studies.trials.trial import trials_of
from nested_agents.topologies.config import parse

SHORT = {"kind": "hierarchy-ppo", "rollout": 16, "batch_size": 8, "epochs": 2}
CARTS = 4
TREE = [("a", "b"), ("a", "c"), ("b", "d")]


def spec_of(topology: Any = "chain", **learner: Any) -> Spec:
    return Spec.of(
        {
            "study": "learning-curve", "seeds": [10_000],
            "episodes": 3, "steps": 20, "evaluation": 2,
            "scenario": {"kind": "line-up", "carts": CARTS}, "topology": topology,
            "learner": {**SHORT, **learner},
        }
    )  # fmt: skip


class Players(Scenario):
    """Agents who see nothing of a world in which nothing happens."""

    state_space = StateSpace("one", (Variable("x", "1", 0, 1),))

    def __init__(self, agents: str, n_actions: int, roles: str = "") -> None:
        self.agents = tuple(agents)
        self.roles = tuple(roles or agents)
        zeros = (0.0,) * n_actions
        self.action_set = ActionSet(tuple("uvwxyz"[:n_actions]), zeros, zeros, 0)

    def reset(self, seed: Any, episode: int = 0) -> Any:
        return np.zeros((len(self.agents), 1))

    def step(self, joint: Any) -> Transition:
        return Transition(np.zeros((len(self.agents), 1)), 0.0, False, False, {})


def team_of(
    scenario: Any, hierarchy: Hierarchy | None = None, failures: Any = (), **table: Any
) -> tuple[Team, Any]:
    """A team, and the agents that it is made of."""
    table = {**SHORT, **table}
    settings = LEARNERS.model(table["kind"]).model_validate(table)
    hierarchy = hierarchy or Hierarchy(scenario.agents, [])
    team = Team(settings, scenario, hierarchy, np.random.SeedSequence(0), failures)
    return team, team.parts[0]


def sequence(scenario: Any, team: Team, steps: int) -> None:
    """Act and learn for some steps of an episode, which goes on."""
    states = scenario.reset(1)
    for _ in range(steps):
        seen = look(scenario, states)
        decision = team.act(seen)
        transition = scenario.step(decision.joint_action)
        team.learn(Experience(seen, decision, transition, last=False))
        states = transition.states


def told_of(team: Team, joint: Any) -> Any:
    """What all agents are told ``(n, width)`` who are made to decide a joint action."""
    agents: Any = team.parts[0]
    inputs = agents.observe(look(agents.scenario), explore=False)
    inputs.noise[0, np.arange(len(joint)), joint] = 1e9
    team.messages.advance(team._decide(look(agents.scenario), (inputs,), None))
    return inputs.actor[0, :, : len(agents.told_names)]


def test_turns_and_messages_by_hand() -> None:
    hierarchy = Hierarchy("abcd", TREE)
    slots = decision_stages(hierarchy, [0] * 4, [True])
    assert [slot.agents.tolist() for slot in slots] == [[0], [1, 2], [3]]
    told = [list(zip(slot.senders, slot.receivers, strict=True)) for slot in slots]
    assert told == [[], [(0, 1), (0, 2)], [(0, 3), (1, 3)]]
    team, agents = team_of(Players("abcd", 3, "xxyx"), hierarchy, weights="role")
    by_role = agents.policies["x"], agents.policies["y"]
    turns = [agents._grouped(slot.agents) for slot in slots]
    own = [[(by_role.index(policy), who.tolist()) for policy, who in turn] for turn in turns]
    assert own == [[(0, [0])], [(0, [1]), (1, [2])], [(0, [3])]]
    assert len(agents.told_names) == 6  # of a and b; nobody is told by c or d
    by_a, by_b = [0, 0, 1], [1, 0, 0]
    told = told_of(team, [2, 0, 1, 1]).tolist()
    assert told == [[0] * 6, by_a + [0] * 3, by_a + [0] * 3, by_a + by_b]


def test_parents_alone_are_heard() -> None:
    chain = Hierarchy("abc", pairwise("abc"), communication="parents")
    slots = decision_stages(chain, [0] * 3, [True])
    assert [slot.receivers.tolist() for slot in slots] == [[], [1], [2]]
    assert [slot.senders.tolist() for slot in slots] == [[], [0], [1]]
    silent = Hierarchy("abc", pairwise("abc"), communication="none")
    (slot,) = decision_stages(silent, [0] * 3, [True])
    assert (slot.agents.tolist(), slot.receivers.tolist()) == ([0, 1, 2], [])
    assert not team_of(Players("abc", 2), silent)[1].told_names


@pytest.mark.parametrize("weights", ["all", "role", "own"])
@pytest.mark.parametrize("critic", ["central", "own"])
@pytest.mark.parametrize("kind", ["hierarchy-ppo", "ppo"])
def test_rollouts_hold_the_probabilities_by_which_agents_acted(
    kind: str, weights: str, critic: str
) -> None:
    scenario = LineUpSettings(carts=CARTS).build()
    hierarchy = Hierarchy(scenario.agents, pairwise(scenario.agents))
    own = {"weights": weights, "critic": critic} if kind == "hierarchy-ppo" else {}
    team, agents = team_of(scenario, hierarchy, kind=kind, **own)
    expected = {"all": 1, "role": 1, "own": CARTS}[weights] if own else 1
    assert len(agents.policies) == expected
    sequence(scenario, team, 24)  # updated after 16, and 8 steps are in the rollouts
    for name, policy in agents.policies.items():
        rollout, rows = policy.rollout, agents._rows[name]
        assert rollout.steps == 8
        inputs = rollout.actor_inputs[:8, 0]
        if own:
            told = inputs[..., : len(agents.told_names)].sum(axis=2)
            assert (told == [len(hierarchy.senders(agent)) for agent in rows]).all()
        logits = policy.logits(inputs.reshape(-1, inputs.shape[-1])).astype(float)
        logs = logits - np.log(np.exp(logits).sum(axis=2, keepdims=True))
        actions = rollout.actions[:8, 0].reshape(*logits.shape[:2], 1)
        chosen = np.take_along_axis(logs, actions, axis=2).sum(axis=(1, 2))
        assert rollout.log_probs[:8, 0].ravel() == pytest.approx(chosen, abs=1e-5)


def test_permuting_agents_permutes_results() -> None:
    first = LineUpSettings(carts=CARTS).build()
    names = first.agents
    order = [2, 0, 3, 1]  # who stands at each place in the second
    edges = [(names[0], names[1]), (names[1], names[2]), (names[2], names[3])]
    second: Any = LineUpSettings(carts=CARTS).build()
    second.agents = tuple(names[i] for i in order)
    _, one = team_of(first, Hierarchy(first.agents, edges), critic="own")
    team, other = team_of(second, Hierarchy(second.agents, edges), critic="own")
    rows = [one.input_names[0].index(name) for name in other.input_names[0]]
    other.policies["all"].actor.warm_start(one.policies["all"].actor, rows)
    states = first.reset(4)
    noise = np.random.default_rng(0).gumbel(size=(CARTS, len(first.action_set)))
    logits, joint = decided(one, Hierarchy(first.agents, edges), states, noise)
    permuted, acted = decided(other, team.hierarchy, states[order], noise[order])
    assert permuted == pytest.approx(logits[order], abs=1e-6)
    assert (acted == joint[order]).all()


def decided(agents: Any, hierarchy: Hierarchy, states: Any, noise: Any) -> tuple[Any, Any]:
    """The logits of agents in states, and what they decide by noise."""
    team = Team(agents.settings, agents.scenario, hierarchy, np.random.SeedSequence(0))
    team.parts = (agents,)
    seen = look(agents.scenario, states)
    inputs = agents.observe(seen, explore=False)
    inputs.noise[0] = noise
    joint = team._decide(seen, (inputs,), None)
    return inputs.logits[0], joint


def test_a_joint_step_has_one_reward_for_all() -> None:
    scenario = LineUpSettings(carts=CARTS).build()
    for value_of, spread in (("team", 0.0), ("own", 1.0)):
        team, agents = team_of(scenario, value_of=value_of)
        seen = look(scenario, scenario.reset(1))
        own = np.arange(CARTS, dtype=float)
        transition = Transition(scenario.reset(1), own, False, False, {})
        team.learn(Experience(seen, team.act(seen), transition, last=False))
        rewards = agents.policies["all"].rollout.rewards[0]
        assert (np.ptp(rewards) > 0) == (spread > 0)


TWO = [("a", "b"), ("a", "c")]
FAILURES: dict[str, dict[str, Any]] = {
    "lost": {"kind": "lost", "agents": "a"},
    "lost at times": {"kind": "lost", "agents": "*", "probability": 0.5},
    "delayed": {"kind": "delayed", "agents": "*", "decisions": 2},
    "noisy": {"kind": "noisy", "agents": "*", "probability": 0.7},
    "absent": {"kind": "absent", "agents": "b"},
    "later": {"kind": "lost", "agents": "a", "step": 3, "end_episode": 0, "end_step": 5},
}


def failures_of(*tables: dict[str, Any]) -> Any:
    return parse({"kind": "chain", "failures": list(tables)}).failures


@pytest.mark.parametrize("edges", [TREE[:2], list(pairwise("abc"))], ids=["star", "chain"])
@pytest.mark.parametrize("failure", FAILURES)
def test_what_is_told_is_what_arrives(failure: str, edges: Any) -> None:
    n_actions = 3
    hierarchy = Hierarchy("abc", edges)
    failures = failures_of(FAILURES[failure])
    team, agents = team_of(Players("abc", n_actions), hierarchy, failures)
    messages = Messages(hierarchy, failures, n_actions)
    for begun in (team.reset, messages.reset):
        begun(7, 0)
    rng = np.random.default_rng(0)
    for _ in range(8):
        joint = rng.integers(n_actions, size=3)
        joint[messages.absent] = 0
        arriving = np.zeros((3, 2, n_actions))
        for agent in np.array(hierarchy.order)[~messages.absent[list(hierarchy.order)]]:
            senders, actions, _ = messages.received(agent, joint)
            arriving[agent, senders, actions] = 1.0
        messages.advance(joint)
        assert len(agents.told_names) == 2 * n_actions, "of a and b, who decide before another"
        assert (told_of(team, joint) == arriving.reshape(3, -1)).all()


@pytest.mark.parametrize("kind", ["absent", "left"])
def test_agents_that_do_not_decide_are_not_learned_from(kind: str) -> None:
    """From the fourth decision on, b is away; all share one policy."""
    failures = failures_of({"kind": kind, "agents": "b", "episode": 0, "step": 3})
    team, agents = team_of(Players("abc", 3), Hierarchy("abc", TWO), failures)
    team.reset(0, 0, learn=True)
    sequence(agents.scenario, team, 5)
    decided = agents.policies["all"].rollout.decided[:5, 0, :, 0]
    assert decided.tolist() == [[True] * 3] * 3 + [[True, False, True]] * 2
    told = na.explain_decision(team.act(look(agents.scenario), inspect=True))
    assert told.splitlines()[-1] == "b is absent and decides nothing; its action is u."


def echoing(agents: Any, untold: int) -> None:
    """Set weights by hand: agents do the action after that of the last who tells them.

    Of nobody told, they do `untold`.
    """
    n_actions = len(agents.scenario.action_set)
    policy = agents.policies["all"]
    policy.weights[:] = 0.0
    (into, _), (out, biases) = policy.actor._layers
    biases[untold] = 0.5
    for unit in range(len(agents.told_names)):
        sender, action = divmod(unit, n_actions)
        into[unit, unit] = 5.0
        out[unit, (action + 1) % n_actions] = 10.0**sender


@pytest.mark.parametrize(
    ("failure", "joint"),
    [
        (None, [2, 3, 3]),
        ({"kind": "lost", "agents": "a"}, [2, 2, 2]),
        ({"kind": "lost", "agents": "b"}, [2, 3, 3]),
        ({"kind": "delayed", "agents": "a"}, [2, 2, 2]),
        ({"kind": "absent", "agents": "a"}, [0, 2, 2]),
    ],
)
def test_agents_act_by_what_arrives(failure: Any, joint: list[int]) -> None:
    failures = failures_of(failure) if failure else ()
    world = Players("abc", 4)
    team, agents = team_of(world, Hierarchy("abc", TWO), failures, hidden=(12,))
    echoing(agents, untold=2)
    assert team.act(look(world), explore=False).joint_action.tolist() == joint
    if failure and failure["kind"] == "delayed":
        assert team.act(look(world), explore=False).joint_action.tolist() == [2, 3, 3]


def test_agents_whose_messages_may_fail_begin_as_others_do() -> None:
    scenario = LineUpSettings(carts=CARTS).build()
    star = Hierarchy(scenario.agents, [("cart1", f"cart{k}") for k in (2, 3, 4)])
    seen = look(scenario, scenario.reset(3))
    logits = []
    words = []
    for failures in ((), failures_of({"kind": "lost", "agents": "cart1", "episode": 99})):
        team, agents = team_of(scenario, star, failures)
        decision = team.act(seen)
        logits.append(decision.inputs[0].logits)
        words.append(agents.rng.bit_generator.state)
    assert logits[0] == pytest.approx(logits[1], abs=1e-6)
    assert words[0] == words[1]


def test_what_arrives_is_learned_from() -> None:
    """Agent c is rewarded for repeating the action of b, which is one of its senders."""
    failures = failures_of({"kind": "lost", "agents": "a"})
    world = Players("abc", 2)
    table = {"rollout": 32, "learning_rate": 0.003, "entropy": 0.05}
    team, agents = team_of(world, Hierarchy("abc", list(pairwise("abc"))), failures, **table)
    for _ in range(1000):
        team.reset(0, 0, learn=True)
        seen = look(world)
        decision = team.act(seen)
        reward = float(decision.joint_action[1] == decision.joint_action[2])
        transition = Transition(np.zeros((3, 1)), reward, True, False, {})
        team.learn(Experience(seen, decision, transition, last=True))
    for action in (0, 1):
        inputs = agents.observe(look(world), explore=False)
        inputs.noise[0, 1, action] = 1e9
        assert team._decide(look(world), (inputs,), None)[2] == action


def test_without_edges_it_is_mappo_and_by_own_critics_ippo() -> None:
    told_nothing = [
        {"topology": "independent"},
        {"topology": {"kind": "chain", "communication": "none"}},
    ]
    for kind, critic in (("mappo", "central"), ("ippo", "own")):
        (trial,) = trials_of(spec_of(kind=kind))
        rows = run_trial(trial).rows
        for table in told_nothing:
            (like,) = trials_of(spec_of(**table, critic=critic, value_of="own"))
            assert run_trial(like).rows == rows
        (chain,) = trials_of(spec_of(critic=critic, value_of="own"))
        assert run_trial(chain).rows != rows


def test_policies_of_probabilities_are_evaluated_by_sampled_actions_too() -> None:
    session = Session(trials_of(spec_of())[0])
    session.train(1)
    state = session.team.parts[0].rng.bit_generator.state
    session.run_other_evaluations()
    assert session.team.parts[0].rng.bit_generator.state == state
    phases = [row.phase for row in session.result().rows]
    assert phases == ["training", "evaluation:sampled actions", "evaluation:sampled actions"]


def test_what_cannot_be_passed_down_is_refused() -> None:
    problem = "neighbors decide at the same time and send no messages"
    with pytest.raises(SpecError, match=problem) as raised:
        check_conditions(spec_of("simultaneous"))
    assert "\n" not in str(raised.value)


def remarks(spec: Spec) -> list[str]:
    """Return what is said of a spec, beside what of its preset is left out."""
    return [line for line in spec.warnings() if ": set by default, left out" not in line]


def test_a_topology_that_says_nothing_to_the_learner_is_remarked() -> None:
    considering = {"kind": "chain", "lookahead": "none", "communication": "parents"}
    assert remarks(spec_of()) == remarks(spec_of("tree")) == []
    assert remarks(spec_of(considering)) == [
        "topology.lookahead: left out, learner.kind = 'hierarchy-ppo' has no lookahead"
    ]
    assert remarks(spec_of("tree", kind="mappo")) == [
        "topology: left out, learner.kind = 'mappo' passes no actions down"
    ]


MINE = """
from typing import ClassVar
import nested_agents as na

class Mine(na.Peer):
    class Settings(na.PeerSettings):
        uses_hierarchy: ClassVar[bool] = USES

    def __init__(self, settings, scenario, seed, hierarchy=None):
        super().__init__(seed)
        self.hierarchy = hierarchy

    def act(self, seen, *, explore=True):
        return [0] * len(seen.states)
"""
SPEC = """
scenario.kind = "line-up"
topology = {kind = "tree", communication = "parents"}
learner.kind = "mine.py:Mine"
"""


@pytest.mark.parametrize("uses", [True, False])
def test_a_learner_of_ones_own_is_given_the_hierarchy_if_it_asks(
    tmp_path: Path, uses: bool
) -> None:
    (tmp_path / "mine.py").write_text(MINE.replace("USES", str(uses)), encoding="utf-8")
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    spec = Spec.load(tmp_path / "spec.toml")
    with spec.sources.active():
        agents: Any = arrange(spec.conditions()[0].settings, 0).team.parts[0]
    peer = agents.peer
    assert (peer.hierarchy.communication if uses else peer.hierarchy) == (
        "parents" if uses else None
    )
    assert [line[:18] for line in remarks(spec)] == ([] if uses else ["topology: left out"])


@pytest.mark.parametrize("answer", ["[0, -1, 0, 0]", "[0.0, 1.7, 0, 0]", "[0, 9, 0, 0]", "[0]"])
def test_actions_that_a_learner_of_ones_own_has_not_are_refused(answer: str) -> None:
    source = MINE.replace("USES", "False").replace("[0] * len(seen.states)", answer)
    with Sources(texts={"mine.py": source}).active():
        scenario = LineUpSettings(carts=CARTS).build()
        settings = LEARNERS.model("mine.py:Mine").model_validate({"kind": "mine.py:Mine"})
        team = Team(settings, scenario, Hierarchy(scenario.agents, []), np.random.SeedSequence(0))
        with pytest.raises(ValueError, match=r"^Mine\.act returns \[.*\], allowed: a whole number"):
            team.act(look(scenario))


@pytest.mark.slow
@pytest.mark.parametrize("game", ["climbing", "penalty:-30"])
def test_a_chain_finds_the_optimum_of_games_where_independent_agents_do_not(game: str) -> None:
    table = {
        "study": "learning-curve", "seeds": [0], "episodes": 5, "steps": 1000, "evaluation": 1,
        "scenario": {"kind": "matrix-game", "game": game, "observed": "own"},
        "learner": {"kind": "hierarchy-ppo", "discount": 0.0},
        "sweep": {"topology": ["chain", "independent"]},
    }  # fmt: skip
    rates: dict[str, list[float]] = {"chain": [], "independent": []}
    for trial in trials_of(Spec.of(table)):
        rows = run_trial(trial).rows
        last = next(row for row in rows if row.phase == "evaluation")
        rates[trial.settings.topology.kind].append(last.measures["success"])
    assert rates == {"chain": [1], "independent": [0]}


@pytest.mark.parametrize("kind", ["absent", "left"])
def test_an_absent_agent_learns_nothing(kind: str) -> None:
    failure = {"kind": kind, "agents": "cart2"}
    scenario = LineUpSettings(carts=3).build()
    team, agents = team_of(scenario, None, failures_of(failure), weights="own")
    team.reset(0, 0, learn=True)
    before = agents.state_dict()
    sequence(scenario, team, 40)
    after = agents.state_dict()
    changed = {cart: not np.array_equal(before[cart], after[cart]) for cart in before}
    for array in ("weights", "moments", "adam.steps"):
        assert [changed[f"cart{k}.{array}"] for k in (1, 2, 3)] == [True, False, True]


@pytest.mark.parametrize("kind", ["absent", "left"])
def test_shared_weights_learn_from_the_agents_that_act(kind: str, monkeypatch: Any) -> None:
    failure = {"kind": kind, "agents": "cart2", "step": 4, "end_episode": 0, "end_step": 14}
    scenario = LineUpSettings(carts=3).build()
    team, agents = team_of(scenario, None, failures_of(failure), epochs=1)
    policy = agents.policies["all"]
    learned: list[int] = []
    loss_and_grad = policy.loss_and_grad

    def spy(batch: Any, entropy: float) -> float:
        learned.append(len(batch.actions))
        return loss_and_grad(batch, entropy)

    monkeypatch.setattr(policy, "loss_and_grad", spy)
    team.reset(0, 0, learn=True)
    sequence(scenario, team, 16)
    assert sum(learned) == 3 * 16 - 10
    assert policy.state_dict()["moments"][0] == pytest.approx(3 * 16 - 10, abs=1e-3)


def test_a_central_policy_in_a_mixed_team_learns_without_an_absent_member() -> None:
    failure = {"kind": "absent", "agents": "cart2"}
    scenario = LineUpSettings(carts=3).build()
    parts = [{"agents": "*", "learner": {**SHORT, "kind": "ppo"}}]
    settings = LEARNERS.model("mixed").model_validate({"kind": "mixed", "parts": parts})
    hierarchy = Hierarchy(scenario.agents, [])
    seed = np.random.SeedSequence(0)
    team = Team(settings, scenario, hierarchy, seed, failures_of(failure))
    team.reset(0, 0, learn=True)
    sequence(scenario, team, 15)
    rollout = team.only(CentralPPOAgents).policies["all"].rollout
    assert rollout.decided[:15].reshape(-1, 3).all(axis=0).tolist() == [True, False, True]
