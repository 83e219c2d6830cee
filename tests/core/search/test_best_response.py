"""Decisions by the values of several agents, and best responses around a plan."""

from itertools import pairwise, product

import numpy as np
import pytest

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.spaces import StateSpace, Variable
from nested_agents.core.numerics import FloatArray
from nested_agents.core.search.best_response import BestResponse, BestResponseSettings
from nested_agents.core.search.enumeration import (
    AutoSettings,
    ExactEnumeration,
    Sampling,
    SamplingSettings,
)
from nested_agents.core.search.evaluator import (
    DecisionContext,
    DecisionProblem,
    Rule,
    ValueOf,
    concerned,
)
from nested_agents.core.values.rule_base import PooledWeights, RuleBase, RuleBaseSettings

A = 4
NEUTRAL = 2
VALUES_OF = ("own", "below", "team")
EDGES = {"chain": ["ab", "bc", "cd"], "tree": ["ab", "ac", "bd"], "apart": []}


class Paid(Prediction):
    """Predicts rewards alone."""

    def states(self, agent: int, joint_actions: np.ndarray) -> np.ndarray:
        raise AssertionError("asked for states")


def problem_of(world, rules, name, value_of: ValueOf, rule: Rule = "value") -> DecisionProblem:
    rename = dict(zip("abcd", world.agents, strict=True))
    hierarchy = Hierarchy(world.agents, [(rename[x], rename[y]) for x, y in EDGES[name]])
    return DecisionProblem(rules, hierarchy, A, world.groups, rule, "best-response", 0.9, value_of)


@pytest.fixture
def world(line_world):
    world = line_world(carts=2, wheels=2)
    world.reset(3)
    world.step(np.array([0, 1, 0, 0]))
    return world


@pytest.fixture
def rules(world) -> RuleBase:
    return RuleBase.build(world.state_space, RuleBaseSettings(order=2))


def asked(agent, world, theta, hierarchy, rng) -> DecisionContext:
    joint = np.full(4, NEUTRAL)
    above = list(hierarchy.senders(agent))
    joint[above] = rng.integers(A, size=len(above))
    return DecisionContext(agent, joint, world.predict(), theta, np.full((4, A), 1 / A), rng)


def worth_of(problem, context, joint, theta) -> float:
    """The mean f of those concerned, read aloud."""
    who = concerned(problem.hierarchy, problem.value_of)[context.agent]
    prediction = context.prediction
    values = [problem.rules.features(prediction.states(i, joint[None]))[0] @ theta[i] for i in who]
    mean, reward = float(np.mean(values)), float(prediction.rewards(joint[None])[0])
    return {"value": mean, "reward": reward, "reward-and-value": reward + 0.9 * mean}[problem.rule]


@pytest.mark.parametrize("rule", ["value", "reward-and-value"])
@pytest.mark.parametrize("value_of", VALUES_OF)
@pytest.mark.parametrize("name", EDGES)
def test_whose_value_decides(name, value_of, rule, world, rules) -> None:
    problem, rng = problem_of(world, rules, name, value_of, rule), np.random.default_rng(1)
    theta = rng.normal(size=(4, rules.n_rules))
    for agent in range(4):
        context = asked(agent, world, theta, problem.hierarchy, rng)
        below = problem.hierarchy.searched(agent)
        expected = np.full(A, -np.inf)
        for own, *actions in product(range(A), repeat=1 + len(below)):
            joint = context.joint_action.copy()
            joint[[agent, *below]] = own, *actions
            expected[own] = max(expected[own], worth_of(problem, context, joint, theta))
        sampling = Sampling(SamplingSettings(samples=A**3), problem)
        for evaluator in (ExactEnumeration(problem), sampling):
            assert evaluator.values(context) == pytest.approx(expected, rel=0, abs=1e-12)


@pytest.mark.parametrize("value_of", VALUES_OF)
@pytest.mark.parametrize("name", EDGES)
def test_values_are_those_of_joint_actions_that_keep_what_is_decided(
    name, value_of, world, rules
) -> None:
    problem, rng = problem_of(world, rules, name, value_of), np.random.default_rng(2)
    theta = rng.normal(size=(4, rules.n_rules))
    exact, search = ExactEnumeration(problem), BestResponse(problem)
    for agent in problem.hierarchy.order:
        context = asked(agent, world, theta, problem.hierarchy, rng)
        before = context.joint_action.copy()
        found, best = search.values(context), exact.values(context)
        assert (found <= best + 1e-12).all()
        assert found.max() >= np.median(best)
        if not set(problem.hierarchy.searched(agent)) - set(world.groups[agent // 2]):
            assert found == pytest.approx(best, rel=0, abs=1e-12)
        assert (context.joint_action == before).all()


def test_what_half_a_team_must_do_together_is_found(line_world) -> None:
    # Only if the carts drive apart is anything gained; any cart alone loses.
    world = line_world(carts=6, wheels=2)
    world.reset(0)
    rules = RuleBase.build(world.state_space, RuleBaseSettings())
    edges = list(zip(world.agents, world.agents[1:], strict=False))
    hierarchy = Hierarchy(world.agents, edges)
    problem = DecisionProblem(
        rules, hierarchy, A, world.groups, "reward", "best-response", 0.9, "team"
    )

    class Apart(Paid):
        def rewards(self, joint: np.ndarray) -> np.ndarray:
            halves = (joint[:, :6] == 1).all(axis=1) & (joint[:, 6:] == 0).all(axis=1)
            return np.where(halves, 1.0, -0.1 * (joint != NEUTRAL).sum(axis=1))

    rng, prediction = np.random.default_rng(0), Apart()
    search, joint = BestResponse(problem), np.full(12, NEUTRAL)
    for agent in hierarchy.order:
        context = DecisionContext(agent, joint, prediction, [], np.zeros((12, A)), rng)
        joint[agent] = search.values(context).argmax()
    assert joint.tolist() == [1] * 6 + [0] * 6


def test_agents_below_answer_to_what_is_decided_above(world, rules) -> None:
    # The reward asks agent 3 to do as agent 0 does, whatever that is.
    problem = problem_of(world, rules, "chain", "team", "reward")

    class Alike(Paid):
        def rewards(self, joint: np.ndarray) -> np.ndarray:
            return (joint[:, 3] == joint[:, 0]).astype(float)

    rng, prediction, search = np.random.default_rng(0), Alike(), BestResponse(problem)
    for first in range(A):
        joint = np.full(4, NEUTRAL)
        for agent in range(4):
            asking = DecisionContext(agent, joint, prediction, [], np.zeros((4, A)), rng)
            values = search.values(asking)
            joint[agent] = first if agent == 0 else values.argmax()
        assert joint[3] == first


class Remembered(Prediction):
    """A prediction that leads to the same states whatever is done."""

    def __init__(self, states: FloatArray) -> None:
        self.known = states

    def states(self, agent: int, joint_actions: np.ndarray) -> np.ndarray:
        return self.known[agent]


@pytest.mark.parametrize("membership", ["triangular", "sigmoid"])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_pooled_means_are_means(order: int, membership: str) -> None:
    # One that is a circle of each kind, its states beyond the range on either side.
    variables = [Variable(f"{name}s", "m", 0.0, 1.0) for name in ("own", "mine", "our", "common")]
    circles = [Variable(v.name[:-1], "rad", -0.3, 0.6, True, (-0.2, 0.1, 0.5)) for v in variables]
    pairs = [v for pair in zip(variables, circles, strict=True) for v in pair]
    space = StateSpace("demo", tuple(pairs), 2, tuple(v.name for v in pairs[4:]))
    rules = RuleBase.build(space, RuleBaseSettings(order=order, membership=membership))
    rng = np.random.default_rng(order)
    groups, agents = ((0, 1), (2, 3), (4, 5)), np.array([1, 2, 3, 5])
    states = rng.uniform(-0.5, 1.5, size=(6, 7, 8))
    states[1::2, :, 2:4] = states[::2, :, 2:4]
    states[:, :, 4:] = states[0, :, 4:]
    theta = rng.normal(size=(6, rules.n_rules))
    hierarchy = Hierarchy("abcdef", [])
    problem = DecisionProblem(rules, hierarchy, A, groups, "value", "best-response", 0.9)
    pooling = BestResponse(problem)
    expected = np.mean([rules.values(theta[i], states[i]) for i in agents], axis=0)
    of_bodies = np.stack([theta[1], theta[2] + theta[3], theta[5]])
    weights = theta[agents], of_bodies, theta[agents].sum(axis=0)[None]
    pooled = PooledWeights(weights, agents, np.arange(3), np.array([0, 1, 3, 4]))
    found = pooling.mean(pooled, Remembered(states), np.zeros((7, 6), dtype=int))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_neighbors_in_one_body_both_try_the_actions_of_their_body(world, rules) -> None:
    first, second, *_ = world.agents
    hierarchy = Hierarchy(world.agents, [], neighbors=[(first, second)])
    fields = (rules, hierarchy, A, world.groups, "value", "best-response", 0.9, "team")
    search = BestResponse(DecisionProblem(*fields, plan="common"))
    rng, prediction = np.random.default_rng(4), world.predict()
    theta, joint = rng.normal(size=(4, rules.n_rules)), np.full(4, NEUTRAL)
    tried = []
    for agent in (0, 1):
        context = DecisionContext(agent, joint, prediction, theta, np.full((4, A), 1 / A), rng)
        search.values(context)
        tried.append(search.counts.joint_actions)
    assert tried[1] - tried[0] == A**2


def test_auto_takes_best_responses_where_values_of_others_decide(world, rules) -> None:
    auto = AutoSettings(exact_up_to=2)
    assert auto.chosen(problem_of(world, rules, "chain", "team")).kind == "best-response"
    assert auto.chosen(problem_of(world, rules, "apart", "team")).kind == "exact"


def test_other_teammate_models_are_refused(world, rules) -> None:
    problem = problem_of(world, rules, "chain", "team")
    fields = {**vars(problem), "teammates": "uniform"}
    with pytest.raises(
        ValueError, match=r"learner\.decision\.teammates = 'uniform': best-response"
    ):
        BestResponse(DecisionProblem(**fields))


class InStep(Paid):
    """Rewards every pair of neighboring agents that do the same."""

    def rewards(self, joint: np.ndarray) -> np.ndarray:
        return (joint[:, 1:] == joint[:, :-1]).mean(axis=1)


def decided(
    hierarchy,
    first,
    plan="private",
    unseen="maintain",
    seed=0,
    prediction=None,
    sweeps=1,
    value_of="own",
) -> list[np.ndarray]:
    """What all value their actions at, after the first agent does `first` whatever it values."""
    n = len(hierarchy)
    rules = RuleBase.build(
        StateSpace("none", (Variable("x", "1", -1.0, 1.0),), 1), RuleBaseSettings()
    )
    problem = DecisionProblem(
        rules, hierarchy, A, tuple((i,) for i in range(n)), "reward", "best-response", 0.9,
        value_of, unseen, plan, hierarchy.communication == "ancestors",
    )  # fmt: skip
    search = BestResponseSettings(sweeps=sweeps).build(problem)
    rng = np.random.default_rng(seed)
    prediction = prediction or InStep()
    joint, values = np.full(n, NEUTRAL), []
    for agent in hierarchy.order:
        told = np.array(hierarchy.senders(agent), dtype=np.int64)
        known = np.full(n, NEUTRAL)
        known[told] = joint[told]
        context = DecisionContext(
            agent, known, prediction, [], np.zeros((n, A)), rng, told=told
        )  # fmt: skip
        values.append(search.values(context))
        joint[agent] = first if agent == hierarchy.order[0] else values[-1].argmax()
    return values


class Noted(InStep):
    """Notes how many joint actions it was asked for each time."""

    def __init__(self) -> None:
        self.tried: list[int] = []

    def rewards(self, joint: np.ndarray) -> np.ndarray:
        self.tried.append(len(joint))
        return super().rewards(joint)


class Twins(Noted):
    """Two pairs of actions come to the same."""

    alike = np.array([[0, 1, 1, 0]] * 6)


@pytest.mark.parametrize(("prediction", "each"), [(Noted(), 3), (Twins(), 1)])
def test_the_plan_is_not_predicted_again(prediction, each: int) -> None:
    """Six of one wheel: 40 starts, then all actions of the first, all but the plan's of others."""
    decided(Hierarchy(NAMES, PAIRS), 0, prediction=prediction)
    assert prediction.tried[:7] == [40, 4] + 5 * [each]


@pytest.mark.parametrize(("sweeps", "tried"), [(0, 40 + 24), (1, 40 + 19 + 24), (2, 40 + 37 + 24)])
def test_every_sweep_goes_over_all_bodies(sweeps: int, tried: int) -> None:
    prediction = Noted()
    decided(Hierarchy(NAMES, PAIRS), 0, prediction=prediction, sweeps=sweeps)
    assert sum(prediction.tried) == tried


NAMES = tuple("abcdef")
PAIRS = list(pairwise(NAMES))
ALL = [(a, b) for k, a in enumerate(NAMES) for b in NAMES[k + 1 :]]


@pytest.mark.parametrize("plan", ["private", "common"])
@pytest.mark.parametrize(
    ("hierarchy", "unseen"),
    [
        (Hierarchy(NAMES, [], ALL), "maintain"),
        (Hierarchy(NAMES, PAIRS, communication="none"), "maintain"),
        (Hierarchy(NAMES, PAIRS, communication="none"), "plan"),
        (Hierarchy(NAMES, PAIRS, communication="none", lookahead="children"), "plan"),
    ],
)
def test_who_is_told_nothing_learns_nothing_of_what_others_decide(hierarchy, unseen, plan) -> None:
    runs = [decided(hierarchy, first, plan, unseen) for first in range(A)]
    for agent in range(1, 6):
        assert len({tuple(run[agent]) for run in runs}) == 1


def test_a_common_plan_carries_nothing_from_who_is_told_to_who_is_not() -> None:
    """The second answers what the first does; the others decide by the plan as it was made."""
    runs = [decided(Hierarchy(NAMES, PAIRS[:1]), first, "common", "plan") for first in range(A)]
    assert [int(run[1].argmax()) for run in runs] == list(range(A))
    for agent in range(2, 6):
        assert len({tuple(run[agent]) for run in runs}) == 1


@pytest.mark.parametrize("plan", ["private", "common"])
def test_who_is_told_answers(plan) -> None:
    for hierarchy in (Hierarchy(NAMES, PAIRS), Hierarchy(NAMES, PAIRS, communication="parents")):
        answers = [decided(hierarchy, first, plan)[1].argmax() for first in range(A)]
        assert answers == list(range(A))


def test_agents_with_a_common_plan_agree_without_a_word() -> None:
    """All are equally good who do the same: private plans break ties apart, a common one not."""
    silent = Hierarchy(NAMES, PAIRS, communication="none")

    def chosen(plan: str, seed: int) -> int:
        values = decided(silent, 0, plan, "plan", seed)
        return len({int(v.argmax()) for v in values[1:]})

    assert {chosen("common", seed) for seed in range(5)} == {1}
    assert max(chosen("private", seed) for seed in range(5)) > 1


def test_a_common_plan_needs_somebody_who_plans_for_others(world, rules) -> None:
    apart = Hierarchy(world.agents, [])
    fields = vars(problem_of(world, rules, "chain", "own")) | {"plan": "common", "hierarchy": apart}
    with pytest.raises(ValueError, match="plan = 'common': no agent searches"):
        BestResponse(DecisionProblem(**fields))
    assert BestResponse(DecisionProblem(**fields | {"unseen": "plan"})).plans


def test_a_plan_needs_an_evaluator_that_makes_one(world, rules) -> None:
    fields = vars(problem_of(world, rules, "chain", "own"))
    for key, value in (("unseen", "plan"), ("plan", "common")):
        with pytest.raises(ValueError, match=f"learner.decision.{key} = '{value}': needs an eval"):
            ExactEnumeration(DecisionProblem(**fields | {key: value}))
        chosen = AutoSettings().chosen(DecisionProblem(**fields | {key: value}))
        assert chosen.kind == "best-response"
