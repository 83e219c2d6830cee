"""A team passes actions down, saves and continues bit for bit, and refuses foreign files."""

import copy
import zipfile
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from acting import fuzzy, joint_of, look

import nested_agents as na
from nested_agents.core.agents.joint import join_agents
from nested_agents.core.agents.loop import control_loop
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import AbsentAgents, LostMessages
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.experience import Experience
from nested_agents.core.interface.spaces import ActionSet, StateSpace
from nested_agents.core.learners import LEARNERS, LearnerSettings
from nested_agents.core.learners.learner import Learner
from nested_agents.core.search.enumeration import ExactEnumeration, Sampling
from nested_agents.core.search.evaluator import Counts, Evaluator, EvaluatorSettings
from nested_agents.core.search.exploration import BurstExploration, Explorer
from nested_agents.core.search.settings import DecisionSettings
from tests.scenarios.test_examples import Tank

PAPER = {"kind": "paper", "decay": 0.05, "clock": "episode"}
BURST = {"kind": "burst", "rate": 0.4}
TEAMS = {
    "td-lambda, paper": {"kind": "td-lambda", "step_size": 0.1, "exploration": PAPER},
    "td-lambda, burst": {"kind": "td-lambda", "step_size": 0.1, "exploration": BURST},
    "td-lambda, 75 rules": {
        "kind": "td-lambda",
        "rule_base": {"membership": "sigmoid", "memberships": 5, "order": 2},
        "decision": {"teammates": "empirical"},
    },
    "td-lambda, averaged": {"kind": "td-lambda", "step_size": 0.1, "averaging": 5.0},
    "batch-td": {"kind": "batch-td", "ridge": 0.1, "exploration": BURST},
    "batch-td, sigmoid": {"kind": "batch-td", "rule_base": {"membership": "sigmoid"}},
    "fitted-q": {"kind": "fitted-q", "forgetting": 0.1, "exploration": BURST},
    "sampling": {
        "kind": "batch-td",
        "decision": {
            "evaluator": {"kind": "sampling", "samples": 7},
            "teammates": "empirical",
        },
    },
    "frozen": {"kind": "frozen", "decision": {"rule": "reward-and-value"}},
    "random": {"kind": "td-lambda", "decision": {"rule": "random"}},
}


def settings_of(table: dict) -> LearnerSettings:
    return LEARNERS.model(table["kind"]).model_validate(table)


def chain_of(agents: tuple[str, ...]) -> Hierarchy:
    return Hierarchy(agents, list(pairwise(agents)))


@pytest.fixture
def world(line_world):
    return line_world(carts=2, wheels=2, closed=0.05)


def team_of(name: str, world, seed: int = 1, hierarchy: Hierarchy | None = None) -> Team:
    hierarchy = hierarchy or chain_of(world.agents)
    return Team(settings_of(TEAMS[name]), world, hierarchy, np.random.SeedSequence(seed))


def run_steps(team: Team, world, steps: int, *, end: bool = False) -> list[list[int]]:
    """Let a team act and learn; with `end` the episode ends with the last step."""
    actions = []
    states = world.present()
    for step in range(steps):
        seen = look(world, states)
        decision = team.act(seen)
        transition = world.step(decision.joint_action)
        last = end and step == steps - 1
        team.learn(Experience(seen, decision, transition, last))
        states = transition.states
        actions.append(decision.joint_action.tolist())
    return actions


def run_episode(team: Team, world, seed: int, steps: int = 12) -> list[list[int]]:
    world.reset(seed)
    team.reset(0, 0, learn=True)
    return run_steps(team, world, steps, end=True)


def same(one: Team, two: Team) -> bool:
    a = one.state_dict()
    b = two.state_dict()
    return a.keys() == b.keys() and all((a[k] == b[k]).all() for k in a)


@pytest.mark.parametrize("name", TEAMS)
def test_a_saved_team_continues_bit_for_bit_within_an_episode(
    name: str, world, tmp_path: Path
) -> None:
    team = team_of(name, world)
    for episode in range(2):
        run_episode(team, world, episode)
    world.reset(2)
    team.reset(0, 0, learn=True)
    run_steps(team, world, 5)
    team.save(tmp_path / "team.npz")
    elsewhere, restored = copy.deepcopy(world), team_of(name, world, seed=99)
    restored.load(tmp_path / "team.npz")
    assert same(team, restored)

    def carry_on(team: Team, world) -> list:
        return run_steps(team, world, 6, end=True) + run_episode(team, world, 3)

    assert carry_on(team, world) == carry_on(restored, elsewhere)
    assert same(team, restored)


@pytest.mark.parametrize("name", TEAMS)
def test_a_fresh_team_can_be_saved(name: str, world, tmp_path: Path) -> None:
    team, restored = team_of(name, world), team_of(name, world, seed=99)
    team.save(tmp_path / "team.npz")
    restored.load(tmp_path / "team.npz")
    assert run_episode(team, world, 0) == run_episode(restored, world, 0)
    assert same(team, restored)


@pytest.mark.parametrize("name", TEAMS)
def test_same_seed_same_bits_other_seed_other_actions(name: str, world) -> None:
    one, two, three = team_of(name, world), team_of(name, world), team_of(name, world, seed=2)
    actions = [[run_episode(t, world, e) for e in range(2)] for t in (one, two, three)]
    assert actions[0] == actions[1]
    assert same(one, two)
    assert actions[0] != actions[2]


def test_a_file_holds_arrays_only(world, tmp_path: Path) -> None:
    team = team_of("batch-td", world)
    run_episode(team, world, 0)
    team.save(tmp_path / "team.npz")
    with np.load(tmp_path / "team.npz", allow_pickle=False) as arrays:
        assert {arrays[name].dtype.kind for name in arrays.files} <= set("fiuU")
    assert all(n.endswith(".npy") for n in zipfile.ZipFile(tmp_path / "team.npz").namelist())


def test_pickles_are_refused(world, tmp_path: Path) -> None:
    team = team_of("frozen", world)
    arrays = {**team.state_dict(), "seen": np.array([{"a": 1}], dtype=object)}
    np.savez(tmp_path / "team.npz", **arrays)
    with pytest.raises(ValueError, match="allow_pickle=False"):
        team.load(tmp_path / "team.npz")


@pytest.mark.parametrize(
    ("saved", "loading", "complaint"),
    [
        ("td-lambda, paper", "td-lambda, 75 rules", r"learner.theta has shape \(4, 15\)"),
        ("td-lambda, paper", "td-lambda, burst", r"explorer has shape \(1,\), this team's \(9,\)"),
        ("td-lambda, paper", "batch-td", "saved arrays .* are not this team's"),
        ("batch-td", "td-lambda, paper", "saved arrays .* are not this team's"),
        ("frozen", "td-lambda, paper", "saved arrays .* are not this team's"),
    ],
)
def test_what_another_team_saved_is_refused(
    saved: str, loading: str, complaint: str, world, tmp_path: Path
) -> None:
    team_of(saved, world).save(tmp_path / "team.npz")
    team, untouched = team_of(loading, world, 5), team_of(loading, world, 5)
    with pytest.raises(ValueError, match=complaint) as caught:
        team.load(tmp_path / "team.npz")
    assert "\n" not in str(caught.value)
    assert same(team, untouched)


def test_a_team_of_other_size_is_refused(world, line_world, tmp_path: Path) -> None:
    team_of("frozen", line_world(carts=3, wheels=2)).save(tmp_path / "team.npz")
    with pytest.raises(ValueError, match=r"learner.theta has shape \(6, 15\)"):
        team_of("frozen", world).load(tmp_path / "team.npz")


def test_bounds_of_traces_by_other_rows_are_refused(world) -> None:
    team = team_of("td-lambda, paper", world)
    arrays = team.state_dict()
    arrays["learner.trace"] = arrays["learner.trace"][:, :-1]
    with pytest.raises(ValueError, match=r"saved learner.trace has shape"):
        team.load_state_dict(arrays)


class Witness:
    """Notes what each agent is told, and values its actions by a script."""

    continues = False

    def __init__(self, best: list[int]) -> None:
        self.best, self.told = best, {}
        self.counts = Counts()

    def values(self, deliberation) -> np.ndarray:
        self.told[deliberation.agent] = deliberation.joint_action.tolist()
        return np.eye(4)[self.best[deliberation.agent]]


@pytest.mark.parametrize(
    ("edges", "told"),
    [
        # Agents choose 0, 1, 3, 0; those above are told, all others count as maintaining (2).
        ([(0, 1), (1, 2), (2, 3)], [[2, 2, 2, 2], [0, 2, 2, 2], [0, 1, 2, 2], [0, 1, 3, 2]]),
        ([(3, 2), (2, 1), (1, 0)], [[2, 1, 3, 0], [2, 2, 3, 0], [2, 2, 2, 0], [2, 2, 2, 2]]),
        ([(0, 1), (0, 2), (1, 3)], [[2, 2, 2, 2], [0, 2, 2, 2], [0, 2, 2, 2], [0, 1, 2, 2]]),
        ([(0, 1), (2, 3)], [[2, 2, 2, 2], [0, 2, 2, 2], [2, 2, 2, 2], [2, 2, 3, 2]]),
        ([], [[2, 2, 2, 2]] * 4),
    ],
)
def test_actions_are_passed_down_and_the_unseen_maintain(edges, told, world) -> None:
    names = world.agents
    hierarchy = Hierarchy(names, [(names[a], names[b]) for a, b in edges])
    team = team_of("frozen", world, hierarchy=hierarchy)
    witness = fuzzy(team).search.evaluator = Witness([0, 1, 3, 0])  # type: ignore[assignment]
    world.reset(0)
    assert joint_of(team, world, explore=False).tolist() == [0, 1, 3, 0]
    assert [witness.told[i] for i in range(4)] == told
    assert tuple(witness.told) == hierarchy.order


def test_frequencies_are_what_was_seen(world) -> None:
    team = team_of("random", world)
    fuzzy(team).search.evaluator = Witness([0, 1, 3, 0])  # type: ignore[assignment]
    fuzzy(team).explorer = BurstExploration(rate=0.0, floor=0.0).build(4)
    world.reset(0)
    for _ in range(6):
        joint_of(team, world)
    # One of each to begin with, then six times the same: 7 in 10.
    assert team.state_dict()["seen"].tolist() == [
        [7, 1, 1, 1],
        [1, 7, 1, 1],
        [1, 1, 1, 7],
        [7, 1, 1, 1],
    ]


@pytest.mark.parametrize("name", ["td-lambda, paper", "batch-td", "sampling"])
def test_acting_without_exploring_leaves_the_memory_alone(name: str, world) -> None:
    team = team_of(name, world)
    run_episode(team, world, 0)
    before = {k: v.copy() for k, v in team.state_dict().items() if k != "generator"}
    world.reset(1)
    for _ in range(5):
        world.step(joint_of(team, world, explore=False))
    after = team.state_dict()
    assert all((after[k] == v).all() for k, v in before.items())


def test_a_random_team_draws_all_actions_alike(world) -> None:
    team = team_of("random", world)
    world.reset(0)
    drawn = np.array([joint_of(team, world) for _ in range(4000)])
    fractions = np.stack([(drawn == action).mean(axis=0) for action in range(4)])
    assert fractions == pytest.approx(np.full((4, 4), 0.25), abs=0.035)


def test_counts_of_an_episode(world) -> None:
    team = team_of("td-lambda, paper", world)
    run_episode(team, world, 0, steps=12)
    # Twelve decisions; eleven updates, as the first after-state has none before it.
    assert isinstance(fuzzy(team).evaluator, ExactEnumeration)
    counts = fuzzy(team).evaluator.counts
    assert counts.joint_actions == 12 * (256 + 64 + 16 + 4)
    assert counts.rule_evaluations == counts.joint_actions * 15
    assert counts.weight_updates == 11 * 4 * 15


@pytest.mark.parametrize(
    ("decision", "kind"),
    [
        ({}, ExactEnumeration),
        ({"evaluator": {"kind": "auto", "exact_up_to": 3}}, Sampling),
        ({"evaluator": "sampling"}, Sampling),
        ({"evaluator": "exact"}, ExactEnumeration),
        ({"evaluator": {"kind": "auto", "exact_up_to": 10}}, ExactEnumeration),
    ],
)
def test_the_evaluator_follows_the_settings(decision: dict, kind: type, world) -> None:
    settings = settings_of({"kind": "frozen", "decision": decision})
    team = Team(settings, world, chain_of(world.agents), np.random.SeedSequence(1))
    assert isinstance(fuzzy(team).evaluator, kind)


def test_what_is_too_much_to_enumerate_is_sampled(line_world) -> None:
    # 256 joint actions of four wheels each: four agents have four thousand million.
    scenario = join_agents(line_world(carts=4, wheels=4), "body")
    learner = settings_of({"kind": "frozen"})
    hierarchy = chain_of(scenario.agents)
    team = Team(learner, scenario, hierarchy, np.random.SeedSequence(1))
    assert isinstance(fuzzy(team).evaluator, Sampling)


def test_a_scenario_may_list_its_agents(line_world) -> None:
    scenario = line_world(carts=2, wheels=2)
    scenario.agents = list(scenario.agents)
    assert team_of("frozen", scenario).hierarchy.agents == tuple(scenario.agents)


def test_a_hierarchy_over_other_agents_is_refused(world) -> None:
    with pytest.raises(ValueError, match=r"topology: agents a, b are not the scenario's") as caught:
        team_of("frozen", world, hierarchy=Hierarchy("ab", []))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["td-lambda, burst", "batch-td"])
def test_permuting_agents_permutes_what_is_learned(name: str, line_world) -> None:
    # Every agent's cart has one wheel. Both worlds are stepped with the same actions; what agents
    # learn from them does not depend on the order in which they are listed.
    class Permuted(line_world):
        order = np.array([2, 0, 1])

        def step(self, joint_action):
            inverse = np.argsort(self.order)
            transition = super().step(np.asarray(joint_action)[inverse])
            return replace(transition, states=transition.states[self.order])

    here, there = line_world(3, 1), Permuted(3, 1)
    one, two = team_of(name, here), team_of(name, there)
    rng = np.random.default_rng(4)
    for episode in range(2):
        for team, world in ((one, here), (two, there)):
            world.reset(episode)
            team.reset(0, 0, learn=True)
        for step in range(10):
            joint = rng.integers(4, size=3)
            for team, world, done in ((one, here, joint), (two, there, joint[there.order])):
                seen = look(world, world.present())
                decision = team.act(seen)._replace(joint_action=done)
                team.learn(Experience(seen, decision, world.step(done), step == 9))
    assert np.abs(fuzzy(one).learner.theta).max() > 0
    assert (fuzzy(two).learner.theta == fuzzy(one).learner.theta[there.order]).all()


@pytest.mark.parametrize("name", TEAMS)
def test_a_team_that_takes_over_goes_on_as_the_former_one_would(name: str, world) -> None:
    former = team_of(name, world)
    run_episode(former, world, seed=5)
    same = copy.deepcopy(former)
    successor = team_of(name, world, seed=2)
    successor.warm_start(former)
    assert run_episode(successor, world, seed=6) == run_episode(same, world, seed=6)
    assert (fuzzy(successor).learner.theta == fuzzy(same).learner.theta).all()


def test_a_larger_team_takes_over_by_role(line_world) -> None:
    small, large = (line_world(carts=carts, wheels=2) for carts in (1, 3))
    for world in (small, large):
        world.roles = ("front", "rear") * world.shape[0]
    settings = settings_of({**TEAMS["sampling"], "weights": "role", "exploration": BURST})
    former, successor = (
        Team(settings, world, chain_of(world.agents), np.random.SeedSequence(1))
        for world in (small, large)
    )
    run_episode(former, small, seed=5)
    successor.warm_start(former)
    assert (fuzzy(successor).learner.theta == fuzzy(former).learner.theta).all()
    assert fuzzy(successor).explorer.memory[0] == 0.0  # one episode has been begun
    seen = successor.state_dict()["seen"]
    before = former.state_dict()["seen"]
    assert (seen == np.tile(before, (3, 1))).all()
    run_episode(successor, large, seed=6)
    assert (fuzzy(successor).learner.theta != fuzzy(former).learner.theta).any()


@pytest.mark.parametrize(
    ("change", "weights", "said"),
    [
        ({"carts": 3}, "own", "learner.weights = 'own': the 4 agents .* 6 .*'role'"),
        ({"carts": 3}, "role", "learner.weights = 'role': .* cart0.wheel0,.* cart2.wheel1"),
        ({"state_space": "short"}, "role", "with 4 agents over 'short': the state spaces differ"),
        ({"action_set": "two"}, "role", "the actions differ"),
    ],
)
def test_weights_are_not_carried_where_they_mean_nothing(
    change: dict, weights: str, said: str, world, line_world
) -> None:
    other = line_world(carts=change.get("carts", 2), wheels=2)
    if "state_space" in change:
        other.state_space = StateSpace("short", other.state_space.variables[:1])
    if "action_set" in change:
        other.action_set = ActionSet(("go", "stay"), (1.0, 1.0), (1.0, 0.0), 1)
    settings = settings_of({**TEAMS["batch-td"], "weights": weights})
    former, successor = (
        Team(settings, w, chain_of(w.agents), np.random.SeedSequence(1)) for w in (world, other)
    )
    with pytest.raises(ValueError, match=said) as caught:
        successor.warm_start(former)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("part", ["learner", "explorer"])
def test_parts_without_a_warm_start_are_named(part: str, world) -> None:
    class CannotStartWarm(Learner if part == "learner" else Explorer):  # type: ignore[misc]
        def choose(self, agent, values, rng) -> int:
            return 0

    former, successor = team_of("batch-td", world), team_of("batch-td", world)
    setattr(fuzzy(successor), part, CannotStartWarm())
    with pytest.raises(ValueError, match=r"learner\..*kind: CannotStartWarm has no warm_start"):
        successor.warm_start(former)


def acting(world, unseen: str, told: str, failures=()) -> tuple[Team, list[np.ndarray]]:
    """A team, and five joint actions of an episode; it has seen what it did before the last."""
    settings = settings_of({"kind": "frozen", "decision": {"rule": "reward", "unseen": unseen}})
    hierarchy = Hierarchy(world.agents, list(pairwise(world.agents)), (), told)
    team = Team(settings, world, hierarchy, np.random.SeedSequence(1), failures)
    joints = []
    world.reset(4)
    team.reset(4, 0)
    previous = None
    for _ in range(5):
        joints.append(joint_of(team, world, explore=False, previous=previous))
        previous = joints[-1]
        world.step(previous)
    return team, joints


def known_to_the_last(world, unseen: str, told: str, previous=None) -> tuple[list[int], list[int]]:
    """What the last agent of four reckons with, and what all did."""
    team, _ = acting(world, unseen, told)
    witness = fuzzy(team).search.evaluator = Witness([0, 1, 3, 0])
    joint = joint_of(team, world, explore=False, previous=previous)
    return witness.told[3], joint.tolist()


def test_the_unseen_are_read_as_the_settings_say(world) -> None:
    neutral = [world.action_set.neutral] * 4
    before = np.array([3, 0, 1, 3])
    assert known_to_the_last(world, "last", "none", before)[0] == before.tolist()
    assert known_to_the_last(world, "last", "none")[0] == neutral
    assert known_to_the_last(world, "maintain", "none", before)[0] == neutral
    known, joint = known_to_the_last(world, "maintain", "parents", before)
    assert known == [*neutral[:2], joint[2], neutral[3]]
    known, joint = known_to_the_last(world, "last", "parents", before)
    assert known == [3, 0, joint[2], 3]


def test_who_is_absent_maintains(world) -> None:
    _, joints = acting(world, "maintain", "ancestors", [AbsentAgents(agents=world.agents[1])])
    assert {joint[1] for joint in joints} == {world.action_set.neutral}


def test_failures_of_messages_leave_worlds_and_ties_as_they_are(world) -> None:
    """What is lost has a stream of its own: agents who hear all decide with the same numbers."""
    team, _ = acting(world, "maintain", "ancestors")
    broken, _ = acting(world, "maintain", "ancestors", [LostMessages(agents="*", probability=0.0)])
    assert fuzzy(team).rng.bit_generator.state == fuzzy(broken).rng.bit_generator.state


class SarsaSettings(LearnerSettings):
    """SARSA: a value for every action in every state, learned from the action taken next."""

    step_size: float = 0.2

    def build(self, rules, rows):
        return Sarsa(self, rules, rows)


class Sarsa(Learner):
    """Its ``theta`` holds a row of weights for every action, one behind the other."""

    def __init__(self, settings, rules, rows):
        self.settings, self.rules = settings, rules
        self.theta = np.zeros((len(rows), 3 * rules.n_rules))
        self.met = []

    def begin_episode(self):
        self.before = None

    def observe_decision(self, left, joint_action, states, reward, terminated, duration):
        self.met.append((left, joint_action, states))
        features, every = self.rules.features(left), np.arange(len(left))
        weights = self.theta.reshape(len(left), 3, -1)
        values = (weights[every, joint_action] * features).sum(axis=1)
        if self.before is not None:
            self.update(*self.before, self.settings.discount * values)
        self.before = features, joint_action, reward
        if terminated:
            self.update(*self.before, reward / (1 - self.settings.discount))
        return self.theta.size

    def update(self, features, joint_action, reward, ahead):
        every, weights = np.arange(len(features)), self.theta.reshape(len(features), 3, -1)
        values = (weights[every, joint_action] * features).sum(axis=1)
        steps = self.settings.step_size * (reward + ahead - values)
        weights[every, joint_action] += steps[:, None] * features


class StateActionValues(Evaluator):
    """Values actions by what has been learned of them in the present state."""

    class Settings(EvaluatorSettings):
        def build(self, problem):
            return StateActionValues(problem)

    def __init__(self, problem):
        self.problem, self.counts = problem, Counts()

    def values(self, deliberation):
        features = self.problem.rules.features(deliberation.present[[deliberation.agent]])[0]
        return deliberation.own_weights.reshape(self.problem.n_actions, -1) @ features


def test_a_learner_that_asks_is_given_what_was_done_where() -> None:
    """So that SARSA is a learner of a hierarchy like any other."""
    scenario = Tank(Tank.Settings(pumps=1))
    decision = DecisionSettings().model_copy(update={"evaluator": StateActionValues.Settings()})
    settings = SarsaSettings(decision=decision, discount=0.8)
    hierarchy = Hierarchy(scenario.agents, [])
    team = Team(settings, scenario, hierarchy, np.random.SeedSequence(0))

    def success(first: int, episodes: int, *, learn: bool) -> float:
        loop = control_loop(
            scenario, team, episodes=episodes, steps=30, seed=0, first_episode=first, learn=learn
        )
        records = list(loop)
        if learn:
            for record, (left, taken, entered) in zip(
                records, fuzzy(team).learner.met, strict=True
            ):
                np.testing.assert_array_equal(record.states, left)
                np.testing.assert_array_equal(record.joint_action, taken)
                np.testing.assert_array_equal(record.transition.states, entered)
        return sum(record.transition.terminated for record in records) / episodes

    before = success(1000, 20, learn=False)
    success(0, 60, learn=True)
    assert success(1000, 20, learn=False) > before + 0.3


@pytest.mark.parametrize("wrong", [[-1], [99], [0.5]])
def test_an_action_that_agents_do_not_have_is_refused(monkeypatch, wrong: list[float]) -> None:
    scenario = na.LineUpSettings(carts=2).build()
    hierarchy = na.build_hierarchy(na.parse_topology("chain"), scenario.agents)
    team = na.Team(na.BatchTDSettings(), scenario, hierarchy, na.policy_seed(0))
    observation = team.observe(scenario, scenario.reset(seed=1))
    monkeypatch.setattr(type(team.parts[0]), "act", lambda *_: np.array(wrong))
    with pytest.raises(ValueError, match=r"act returns \[.*\], allowed: whole numbers from 0 to"):
        team.act(observation)
