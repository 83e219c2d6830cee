"""Evaluators against brute force over every joint action, one at a time."""

import dataclasses
import time
from itertools import product
from typing import Any

import numpy as np
import pytest

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.spaces import StateSpace, Variable
from nested_agents.core.search import EVALUATORS
from nested_agents.core.search.enumeration import (
    MAX_JOINT_ACTIONS,
    ExactEnumeration,
    Sampling,
    SamplingSettings,
    combinations,
    probabilities_of,
)
from nested_agents.core.search.evaluator import DecisionContext, DecisionProblem, Rule, Teammates
from nested_agents.core.values.rule_base import RuleBase, RuleBaseSettings

A = 4
NEUTRAL = 2
EDGES = {
    "chain": ["ab", "bc", "cd"],
    "reversed chain": ["dc", "cb", "ba"],
    "tree": ["ab", "ac", "bd"],
    "diamond": ["ab", "ac", "bd", "cd"],
    "pairs": ["ab", "cd"],  # tries fewer joint actions than there are: no table
    "apart": [],
}
RULES = ("value", "reward", "reward-and-value")
TEAMMATES = ("best-response", "uniform", "empirical")
DISCOUNT = 0.9
ONE_VARIABLE = StateSpace("demo", (Variable("x", "m", 0.0, 1.0),))


def hierarchy_of(name: str, agents: tuple[str, ...] = tuple("abcd")) -> Hierarchy:
    """The named hierarchy over four agents that may bear other names."""
    rename = dict(zip("abcd", agents, strict=True))
    return Hierarchy(agents, [(rename[x], rename[y]) for x, y in EDGES[name]])


def problem_of(
    rules: RuleBase, hierarchy: Hierarchy, rule: Rule, teammates: Teammates
) -> DecisionProblem:
    alone = tuple((i,) for i in range(len(hierarchy)))
    return DecisionProblem(rules, hierarchy, A, alone, rule, teammates, DISCOUNT)


class Tabled(Prediction):
    """A prediction without any structure: random next states and rewards by joint action."""

    def __init__(self, states: np.ndarray, rewards: np.ndarray) -> None:
        self.table, self.paid = states, rewards  # (n, A ** n, d), (A ** n,)
        self.places = A ** np.arange(len(states) - 1, -1, -1)

    def states(self, agent: int, joint_actions: np.ndarray) -> np.ndarray:
        return self.table[agent, joint_actions @ self.places]

    def rewards(self, joint_actions: np.ndarray) -> np.ndarray:
        return self.paid[joint_actions @ self.places]

    def permuted(self, permutation: list[int]) -> "Tabled":
        """The same world with agent ``permutation[k]`` listed as k-th."""
        n = len(permutation)
        indices = np.arange(A**n).reshape((A,) * n).transpose(permutation).ravel()
        return Tabled(self.table[permutation][:, indices], self.paid[indices])


class Recorded(Tabled):
    """A prediction that counts the joint actions for which it is asked."""

    asked = 0

    def states(self, agent: int, joint_actions: np.ndarray) -> np.ndarray:
        self.asked += len(joint_actions)
        return super().states(agent, joint_actions)


class Halved(Tabled):
    """A prediction in which the last two actions of every agent have one outcome."""

    def __init__(self, states: np.ndarray, rewards: np.ndarray) -> None:
        every = np.indices((A,) * len(states)).reshape(len(states), -1).T
        first = np.minimum(every, A - 2) @ A ** np.arange(len(states) - 1, -1, -1)
        super().__init__(states[:, first], rewards[first])
        self.alike = np.tile(np.minimum(np.arange(A), A - 2), (len(states), 1))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


@pytest.fixture
def world(line_world):
    world = line_world(carts=2, wheels=2)
    world.reset(3)
    world.step(np.array([0, 1, 0, 0]))
    world.step(np.array([0, 0, 2, 0]))
    return world


@pytest.fixture(params=["triangular", "sigmoid"])
def rules(request: pytest.FixtureRequest, world) -> RuleBase:
    settings = RuleBaseSettings(membership=request.param, order=2)
    return RuleBase.build(world.state_space, settings)


def frequencies_of(rng: np.random.Generator, n: int = 4) -> np.ndarray:
    return rng.dirichlet(np.ones(A), size=n)


def brute_force(
    agent: int, joint_action, hierarchy: Hierarchy, theta, rules: RuleBase, prediction,
    frequencies, rule: str, teammates: str,
) -> np.ndarray:  # fmt: skip
    """Section V read aloud: propose each action, try all joint actions below, gather."""
    gathered = []
    for own in range(A):
        values, weights = [], []
        for actions in product(range(A), repeat=len(hierarchy.searched(agent))):
            joint = np.array(joint_action)
            joint[agent] = own
            weight = 1.0
            for other, action in zip(hierarchy.searched(agent), actions, strict=True):
                joint[other] = action
                weight *= frequencies[other, action]
            reward = prediction.rewards(joint[None])[0]
            f = rules.features(prediction.states(agent, joint[None]))[0] @ theta
            values.append(
                {"value": f, "reward": reward, "reward-and-value": reward + DISCOUNT * f}[rule]
            )
            weights.append(weight)
        best, mean = max(values), sum(values) / len(values)
        observed = float(np.dot(values, weights))
        gathered.append({"best-response": best, "uniform": mean, "empirical": observed}[teammates])
    return np.array(gathered)


@pytest.mark.parametrize("teammates", TEAMMATES)
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("name", EDGES)
def test_enumeration_is_brute_force(
    name: str, rule: str, teammates: str, world, rules: RuleBase, rng: np.random.Generator
) -> None:
    hierarchy = hierarchy_of(name, world.agents)
    prediction, frequencies = world.predict(), frequencies_of(rng)
    theta = rng.normal(size=(4, rules.n_rules))
    common = problem_of(rules, hierarchy, rule, teammates)
    exact, all_sampled = ExactEnumeration(common), Sampling(SamplingSettings(samples=A**3), common)
    for agent in range(4):
        joint = np.full(4, NEUTRAL)
        joint[list(hierarchy.senders(agent))] = rng.integers(A, size=len(hierarchy.senders(agent)))
        before = joint.copy()
        asked = DecisionContext(agent, joint, prediction, theta, frequencies, rng)
        expected = brute_force(
            agent, joint, hierarchy, theta[agent], rules, prediction, frequencies, rule, teammates
        )
        assert exact.values(asked) == pytest.approx(expected, rel=0, abs=1e-12)
        assert all_sampled.values(asked) == pytest.approx(expected, rel=0, abs=1e-12)
        assert (joint == before).all()
    tried = hierarchy.count_joint_actions(A)
    evaluations = 0 if rule == "reward" else tried * rules.n_rules
    for counts in (exact.counts, all_sampled.counts):
        assert (counts.joint_actions, counts.rule_evaluations) == (tried, evaluations)


@pytest.mark.parametrize("kind", [Tabled, Halved])
@pytest.mark.parametrize("teammates", TEAMMATES)
def test_without_structure_too(
    teammates: str, kind: type[Tabled], rng: np.random.Generator, rules: RuleBase
) -> None:
    flat = RuleBase(rules.partitions, rules.terms)
    prediction = kind(rng.uniform(-1, 2, (4, A**4, 3)), rng.normal(size=A**4))
    frequencies, theta = frequencies_of(rng), rng.normal(size=flat.n_rules)
    hierarchy = hierarchy_of("diamond")
    evaluator = ExactEnumeration(problem_of(flat, hierarchy, "reward-and-value", teammates))
    for agent in range(4):
        joint = np.full(4, NEUTRAL)
        found = evaluator.values(
            DecisionContext(agent, joint, prediction, [theta] * 4, frequencies, rng)
        )
        expected = brute_force(
            agent,
            joint,
            hierarchy,
            theta,
            flat,
            prediction,
            frequencies,
            "reward-and-value",
            teammates,
        )
        assert found == pytest.approx(expected, rel=0, abs=1e-12)


@pytest.mark.parametrize("teammates", TEAMMATES)
@pytest.mark.parametrize("name", EDGES)
def test_permuting_agents_permutes_values(
    name: str, teammates: str, rng: np.random.Generator, rules: RuleBase, permuted: Any
) -> None:
    flat = RuleBase(rules.partitions, rules.terms)
    prediction = Tabled(rng.uniform(-1, 2, (4, A**4, 3)), rng.normal(size=A**4))
    frequencies, theta = frequencies_of(rng), rng.normal(size=(4, flat.n_rules))
    hierarchy, permutation = hierarchy_of(name), [2, 0, 3, 1]
    other = permuted(hierarchy, permutation)
    joint = rng.integers(A, size=4)
    here = ExactEnumeration(problem_of(flat, hierarchy, "reward-and-value", teammates))
    there = ExactEnumeration(problem_of(flat, other, "reward-and-value", teammates))
    for k, agent in enumerate(permutation):
        expected = here.values(DecisionContext(agent, joint, prediction, theta, frequencies, rng))
        found = there.values(
            DecisionContext(
                k, joint[permutation], prediction.permuted(permutation), theta[permutation],
                frequencies[permutation], rng,
            )
        )  # fmt: skip
        assert found == pytest.approx(expected, rel=0, abs=1e-12)


def test_frequent_actions_weigh_more_by_hand() -> None:
    # Superior a, subordinate b. Rewards by (a, b): row a = 0 is 0, 1, 2, 3. b was seen to take its
    # actions with 0.1, 0.2, 0.3, 0.4: 0.2 + 0.6 + 1.2 = 2 observed, 1.5 in the mean, 3 at best.
    rewards = np.concatenate([np.arange(4.0), np.zeros(12)])
    prediction = Tabled(np.zeros((2, 16, 1)), rewards)
    frequencies = np.array([[0.25] * 4, [0.1, 0.2, 0.3, 0.4]])
    rules = RuleBase.build(ONE_VARIABLE, RuleBaseSettings())
    rng = np.random.default_rng(0)
    for teammates, expected in (("empirical", 2.0), ("uniform", 1.5), ("best-response", 3.0)):
        hierarchy = Hierarchy("ab", [("a", "b")])
        evaluator = ExactEnumeration(problem_of(rules, hierarchy, "reward", teammates))
        theta = np.zeros(rules.n_rules)
        found = evaluator.values(
            DecisionContext(0, np.full(2, NEUTRAL), prediction, [theta] * 4, frequencies, rng)
        )
        assert found == pytest.approx([expected, 0.0, 0.0, 0.0], abs=1e-15)


def test_sampling_converges(world, rules: RuleBase, rng: np.random.Generator) -> None:
    hierarchy = hierarchy_of("chain", world.agents)
    prediction, frequencies = world.predict(), frequencies_of(rng)
    theta, joint = rng.normal(size=rules.n_rules), np.full(4, NEUTRAL)
    for teammates in TEAMMATES:
        common = problem_of(rules, hierarchy, "value", teammates)
        exact = ExactEnumeration(common).values(
            DecisionContext(0, joint, prediction, [theta] * 4, frequencies, rng)
        )
        # 63 of the 64 joint actions below would be drawn: with repetition, hence at random.
        sampling = Sampling(SamplingSettings(samples=63), common)
        draws = [
            sampling.values(DecisionContext(0, joint, prediction, [theta] * 4, frequencies, rng))
            for _ in range(300)
        ]
        if teammates == "best-response":  # from below, and found sooner or later
            assert np.max(draws, axis=0) == pytest.approx(exact, rel=0, abs=1e-12)
        else:
            error = np.mean(draws, axis=0) - exact
            assert (np.abs(error) <= 5 * np.std(draws, axis=0) / np.sqrt(300) + 1e-12).all()


def test_a_sample_is_shared_by_all_own_actions(rng: np.random.Generator) -> None:
    # The reward depends on the agents below only, so that all own actions must come out equal.
    below = rng.normal(size=A**3)
    prediction = Tabled(np.zeros((4, A**4, 1)), np.tile(below, A))
    rules = RuleBase.build(ONE_VARIABLE, RuleBaseSettings())
    for teammates in TEAMMATES:
        sampling = Sampling(
            SamplingSettings(samples=5),
            problem_of(rules, hierarchy_of("chain"), "reward", teammates),
        )
        theta, joint = np.zeros(rules.n_rules), np.full(4, NEUTRAL)
        found = sampling.values(
            DecisionContext(0, joint, prediction, [theta] * 4, frequencies_of(rng), rng)
        )
        assert np.ptp(found) == pytest.approx(0.0, abs=1e-15)
        assert sampling.counts.joint_actions == A * 5


@pytest.mark.parametrize(
    ("name", "asked"), [("pairs", 2 * (A**2 + A)), ("apart", 4 * A), ("chain", 4 * A**4)]
)
def test_all_joint_actions_are_predicted_only_if_as_many_are_tried(
    name: str, asked: int, rng: np.random.Generator, rules: RuleBase
) -> None:
    prediction = Recorded(rng.uniform(-1, 2, (4, A**4, 3)), rng.normal(size=A**4))
    evaluator = ExactEnumeration(
        problem_of(rules, hierarchy_of(name), "reward-and-value", "best-response")
    )
    theta, joint = rng.normal(size=rules.n_rules), np.full(4, NEUTRAL)
    for agent in range(4):
        evaluator.values(
            DecisionContext(agent, joint, prediction, [theta] * 4, frequencies_of(rng), rng)
        )
    assert prediction.asked == asked


@pytest.mark.parametrize("value_of", ["below", "team"])
def test_equivalent_actions_have_equal_means(
    value_of: str, rng: np.random.Generator, rules: RuleBase
) -> None:
    flat = RuleBase(rules.partitions, rules.terms)
    prediction = Halved(rng.uniform(-1, 2, (4, A**4, 3)), rng.normal(size=A**4))
    plain = Tabled(prediction.table, prediction.paid)
    theta = rng.normal(size=(4, flat.n_rules))
    common = problem_of(flat, hierarchy_of("chain"), "value", "best-response")
    evaluator = ExactEnumeration(dataclasses.replace(common, value_of=value_of))
    for agent in range(4):
        found = [
            evaluator.values(
                DecisionContext(agent, np.full(4, 2), known, theta, frequencies_of(rng), rng)
            )
            for known in (prediction, plain)
        ]
        assert found[0] == pytest.approx(found[1], rel=0, abs=1e-12)
        assert found[0][A - 2] == found[0][A - 1]


def test_a_hundred_agents_apart_are_enumerated() -> None:
    names = [f"agent{i}" for i in range(100)]
    rules = RuleBase.build(ONE_VARIABLE, RuleBaseSettings())
    ExactEnumeration(problem_of(rules, Hierarchy(names, []), "value", "best-response"))


def test_too_many_joint_actions_are_refused() -> None:
    names = [f"agent{i}" for i in range(13)]
    edges = [("agent0", name) for name in names[1:]]
    rules = RuleBase.build(ONE_VARIABLE, RuleBaseSettings())
    assert MAX_JOINT_ACTIONS == A**11
    with pytest.raises(
        ValueError,
        match=r"^learner\.decision\.evaluator: 4 \*\* 12 joint actions of 12 agents would be",
    ) as caught:
        ExactEnumeration(problem_of(rules, Hierarchy(names, edges), "value", "best-response"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("evaluator", ["best-response", "variable-elimination"])
def test_no_evaluator_makes_more_joint_actions_than_there_is_room_for(evaluator: str) -> None:
    names = [f"wheel{i}" for i in range(1000)]
    rules = RuleBase.build(ONE_VARIABLE, RuleBaseSettings())
    edges = [(names[0], name) for name in names[1:]]
    of_graph = evaluator == "variable-elimination"
    hierarchy = Hierarchy(names, (), edges) if of_graph else Hierarchy(names, edges)
    problem = problem_of(rules, hierarchy, "value", "best-response")
    problem = dataclasses.replace(problem, groups=(tuple(range(1000)),))
    begin = time.process_time()
    with pytest.raises(ValueError, match=r"4 \*\* 1000|allowed: 1,048,576") as error:
        EVALUATORS.parsed(evaluator).build(problem)
    assert "\n" not in str(error.value)
    assert time.process_time() - begin < 5.0


def test_probabilities_are_products_of_frequencies(rng: np.random.Generator) -> None:
    frequencies = frequencies_of(rng)
    tried = combinations((1, 3), A)
    expected = frequencies[1, tried[:, 0]] * frequencies[3, tried[:, 1]]
    found = probabilities_of(frequencies, (1, 3))
    assert found == pytest.approx(expected / expected.sum(), rel=0, abs=1e-15)
