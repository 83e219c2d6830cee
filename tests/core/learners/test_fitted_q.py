"""Fitted Q against ridge regression written out in NumPy, and what it makes of a hierarchy."""

import numpy as np
import pytest
from acting import fuzzy

from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import LostMessages
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.experience import Experience, Observation
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.core.learners.batch import REWARD_SCALE
from nested_agents.core.learners.fitted_q import FittedQ, FittedQSettings
from nested_agents.core.search.evaluator import DecisionContext
from nested_agents.core.search.settings import DecisionSettings
from nested_agents.core.values.rule_base import RuleBase, RuleBaseSettings
from nested_agents.scenarios.matrix_games.team_games import TeamGameSettings
from nested_agents.studies.spec.spec import Spec

SPACE = StateSpace("gap", (Variable("gap", "m", 0.0, 1.0, centers=(0.0, 0.5, 1.0)),))
TWO = ActionSet(("left", "right"), (0.0, 0.0), (0.0, 0.0), neutral=0)


def made(n_told: int = 1, **keys: object) -> tuple[FittedQ, RuleBase]:
    settings = FittedQSettings(**{"ridge": 0.5, "discount": 0.9, **keys})
    _, rules = settings.rules_over(SPACE, TWO, n_told)
    return settings.build(rules, np.array([0, 1])), rules


def feed(
    learner: FittedQ, lefts: np.ndarray, acts: np.ndarray, paid: np.ndarray, end: bool
) -> None:
    learner.begin_episode()
    for t, (left, joint_action) in enumerate(zip(lefts, acts, strict=True)):
        last = end and t == len(acts) - 1
        learner.observe_decision(left, joint_action, left, float(paid[t]), last)
    learner.end_episode()


def by_hand(rules: RuleBase, settings: FittedQSettings, episodes: list[tuple]) -> np.ndarray:
    """Weights of both agents: for each action a weighted ridge regression on one-step targets."""
    theta = np.zeros((2, rules.n_rules))
    for k in range(1, len(episodes) + 1):
        paid = REWARD_SCALE * np.concatenate([episode[2] for episode in episodes[:k]])
        low, high = paid.min() / (1 - settings.discount), paid.max() / (1 - settings.discount)
        for i in range(2):
            w = REWARD_SCALE * theta[i]
            for _ in range(settings.regression_iterations):
                phis, targets, weights = [], [], []
                for e, (lefts, acts, rewards, end) in enumerate(episodes[:k]):
                    for t, reward in enumerate(REWARD_SCALE * rewards):
                        if t == len(rewards) - 1 and not end:
                            continue  # what follows is not known
                        phis.append(rules.features(np.append(lefts[t, i], acts[t, i])[None])[0])
                        if t == len(rewards) - 1:
                            target = reward / (1 - settings.discount)
                        else:
                            following = [np.append(lefts[t + 1, i], action) for action in (0, 1)]
                            ahead = rules.features(np.array(following)) @ w
                            target = reward + settings.discount * ahead.max()
                        targets.append(np.clip(target, low, high))
                        weights.append((1 - settings.forgetting) ** (k - 1 - e))
                phi, weight = np.array(phis), np.array(weights)
                gram = phi.T @ (weight[:, None] * phi) + settings.ridge * np.eye(rules.n_rules)
                w = np.linalg.solve(gram, phi.T @ (weight * np.array(targets)))
            step = w / REWARD_SCALE - theta[i]
            theta[i] += settings.target_averaging_rate * step
    return theta


@pytest.mark.parametrize("keys", [{}, {"forgetting": 0.3, "target_averaging_rate": 0.5}])
def test_weights_are_those_of_a_ridge_regression_for_each_action(keys: dict) -> None:
    rng, (learner, rules) = np.random.default_rng(0), made(regression_iterations=3, **keys)
    episodes = []
    for length, end in ((6, True), (1, False), (5, False)):
        gaps, told = rng.random((length, 2, 1)), rng.integers(0, 3, (length, 2, 1)).astype(float)
        acts, paid = rng.integers(0, 2, (length, 2)), 0.01 * rng.normal(size=length)
        episodes.append((np.concatenate([gaps, told], axis=2), acts, paid, end))
    for episode in episodes:
        feed(learner, *episode)
    np.testing.assert_allclose(learner.theta, by_hand(rules, learner.settings, episodes), atol=1e-9)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_targets_of_options_are_not_clipped_if_all_returns_have_one_sign(sign: float) -> None:
    settings = FittedQSettings(discount=0.9, ridge=1e-9, regression_iterations=300)
    _, rules = settings.rules_over(SPACE, TWO, 0)
    learner = settings.build(rules, np.zeros(1, dtype=int))
    learner.begin_episode()
    for k in range(9):  # both options in both places
        place = np.array([[float(k % 2)]])
        paid, duration = ((0.03, 5), (0.02, 4))[k % 2]
        learner.observe_decision(place, np.array([k // 2 % 2]), place, sign * paid, False, duration)
    learner.end_episode()
    first = (0.03 + 0.9**5 * 0.02) / (1 - 0.9**9)
    second = 0.02 + 0.9**4 * first
    known = np.array([[place, option] for place in (0.0, 1.0) for option in (0.0, 1.0)])
    values = rules.values(learner.theta[0], known)
    assert sign * values == pytest.approx([first, first, second, second], abs=1e-6)


def test_an_interval_within_an_episode_changes_nothing_of_the_sums() -> None:
    rng = np.random.default_rng(1)
    lefts, acts = rng.random((9, 2, 2)), rng.integers(0, 2, (9, 2))
    once, often = made()[0], made(interval=2)[0]
    for learner in (once, often):
        feed(learner, lefts, acts, np.arange(9) / 100, True)
    np.testing.assert_allclose(once.state_dict()["gram"], often.state_dict()["gram"], atol=1e-12)


def test_values_are_a_column_of_weights_for_each_action() -> None:
    learner, _ = made()
    # gap at 0, 0.5, 1; told left, right, nobody; for each left, right.
    learner.theta[1] = [1, 2, 3, 4, 5, 6, 10, 20, 30, 40, 50, 60]
    present = np.array([[0.0, 0.0], [0.75, 1.0]])
    nothing = np.zeros((2, 2))
    known = DecisionContext(
        1, np.array([1, 0]), None, list(learner.theta), nothing, np.random.default_rng(0),
        present=present,
    )  # fmt: skip
    assert learner.values(known).tolist() == [0.5 * (3 + 5) + 30, 0.5 * (4 + 6) + 40]
    assert (learner.counts.joint_actions, learner.counts.rule_evaluations) == (2, 12)


def test_what_is_told_keeps_a_function_for_every_action_whatever_memberships_says() -> None:
    settings = FittedQSettings(rule_base=RuleBaseSettings(memberships=4, order=2))
    space, rules = settings.rules_over(SPACE, TWO, 2)
    assert [v.name for v in space.variables] == ["gap", "told1", "told2", "action"]
    assert [p.size for p in rules.partitions] == [4, 3, 3, 2]
    assert rules.terms == ((0, 1, 3), (0, 2, 3), (1, 2, 3))


def team(hierarchy: Hierarchy, *failures: LostMessages, **keys: object) -> Team:
    game = TeamGameSettings(players=3, shape="line", seed=0).build()
    return Team(FittedQSettings(**keys), game, hierarchy, np.random.SeedSequence(1), failures)


def told_in(team: Team, decisions: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """What every agent was told ``(T, 3, k)``, and what all did ``(T, 3)``."""
    told, did = [], []
    team.reset(0, 0, learn=True)
    previous = None
    for _ in range(decisions):
        seen = Observation(np.zeros((3, 1)), previous=previous)
        decision = team.act(seen)
        previous = decision.joint_action
        did.append(previous)
        told.append(decision.inputs[0].left[:, 1:].copy())
    return np.array(told), np.array(did)


def chain(**keys: object) -> Hierarchy:
    names = ("agent1", "agent2", "agent3")
    return Hierarchy(names, [names[:2], names[1:]], **keys)


def test_an_agent_sees_what_its_parents_decided_and_nothing_else() -> None:
    told, did = told_in(team(chain(communication="parents")))
    assert told.shape == (20, 3, 1)
    assert (told[:, 0] == 3).all(), "of nobody"
    np.testing.assert_array_equal(told[:, 1:, 0], did[:, :2])


def test_an_agent_sees_what_its_ancestors_decided_in_the_order_of_decision() -> None:
    names = ("agent1", "agent2", "agent3")
    told, did = told_in(team(Hierarchy(names, [("agent3", "agent1"), ("agent1", "agent2")])))
    np.testing.assert_array_equal(told[:, 1], did[:, [2, 0]])
    np.testing.assert_array_equal(told[:, 0, 0], did[:, 2])
    assert told_in(team(chain(communication="none")))[0].shape == (20, 3, 0)


@pytest.mark.parametrize("unseen", ["maintain", "last"])
def test_a_lost_message_is_read_as_the_decision_says(unseen: str) -> None:
    lost = LostMessages(agents="agent1")
    decision = DecisionSettings(unseen=unseen)
    told, did = told_in(team(chain(communication="parents"), lost, decision=decision))
    before = np.append(0, did[:-1, 0])  # at first it is taken to have maintained
    np.testing.assert_array_equal(told[:, 1, 0], before if unseen == "last" else 0 * before)
    np.testing.assert_array_equal(told[:, 2, 0], did[:, 1])


def test_who_is_told_learns_a_best_reply_and_who_is_not_does_not() -> None:
    game = TeamGameSettings(game="permutation", players=2).build()
    reached = []
    for edges in ([("agent1", "agent2")], []):
        shared = FittedQSettings(discount=0.0, weights="role", forgetting=0.2)
        both = Team(shared, game, Hierarchy(game.agents, edges), np.random.SeedSequence(2))
        for episode in range(10):
            states = game.reset(episode)
            both.reset(0, 0, learn=True)
            seen = Observation(states)
            for play in range(20):
                decision = both.act(seen)
                transition = game.step(decision.joint_action)
                both.learn(Experience(seen, decision, transition, play == 19))
        plays = [both.act(seen, explore=False).joint_action for _ in range(20)]
        reached.append(np.mean([a != b for a, b in plays]))
    assert reached[0] == 1.0
    assert reached[1] < 1.0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"decision": DecisionSettings(value_of="team")},
            "learner.decision.value_of = 'team': fitted-q",
        ),
        ({"decision": DecisionSettings(evaluator="exact")}, "learner.decision.evaluator = 'exact'"),
        ({"decision": DecisionSettings(rule="reward")}, "allowed: rule = value or random"),
        ({"decision": DecisionSettings(unseen="plan")}, "unseen = maintain or last"),
        ({"self_model": {"enabled": True}}, "learner.self_model"),
    ],
)
def test_what_takes_a_prediction_is_refused(keys: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FittedQSettings(**keys).rules_over(SPACE, TWO, 0)


def test_messages_have_no_mirror_image() -> None:
    with pytest.raises(ValueError, match=r"learner\.mirrored = true: messages have no mirror"):
        FittedQSettings(mirrored=True).rules_over(SPACE, TWO, 1)
    FittedQSettings(mirrored=True).rules_over(SPACE, TWO, 0)


def test_neighbors_are_refused_as_they_tell_nothing() -> None:
    names = ("agent1", "agent2", "agent3")
    with pytest.raises(ValueError, match=r"set topology\.decision_order"):
        team(Hierarchy(names, [], [names[:2]]))


def test_a_team_goes_on_with_all_it_has_learned() -> None:
    former, later = team(chain()), team(chain())
    told_in(former)
    fuzzy(former).learner.theta[:] = 1.0
    later.warm_start(former)
    assert (fuzzy(later).learner.theta == 1.0).all()


def test_who_is_told_by_others_goes_on_by_name_of_variable() -> None:
    fewer, more = made(1)[0], made(2)[0]
    fewer.theta[1] = [1, 2, 3, 4, 5, 6, 10, 20, 30, 40, 50, 60]
    more.warm_start(fewer, np.arange(2))
    assert more.theta[1].tolist() == [1, 2, 3, 4, 5, 6, 10, 20, 30, 40, 50, 60, *[0] * 6]
    assert (more.theta[0] == 0).all()
    more.theta[1, -6:] = [100, 200, 300, 400, 500, 600]  # told2 is left, right, nobody
    fewer.warm_start(more, np.arange(2))
    # Where told2 was nobody there is left the sum, of which it does not matter whose part it is.
    values = fewer.theta[1].reshape(2, 3, 2)
    assert (values[0, :, None] + values[1]).tolist() == [
        [[1 + 10 + 500, 2 + 20 + 600], [1 + 30 + 500, 2 + 40 + 600], [1 + 50 + 500, 2 + 60 + 600]],
        [[3 + 10 + 500, 4 + 20 + 600], [3 + 30 + 500, 4 + 40 + 600], [3 + 50 + 500, 4 + 60 + 600]],
        [[5 + 10 + 500, 6 + 20 + 600], [5 + 30 + 500, 6 + 40 + 600], [5 + 50 + 500, 6 + 60 + 600]],
    ]


@pytest.mark.parametrize("numbers", [(0, 2), (2, 0), (1, 3), (3, 1), (2, 1)])
def test_values_are_carried_whoever_tells(numbers: tuple[int, int]) -> None:
    """With those who tell nothing any more, or nothing yet, an agent values as it did."""
    rng = np.random.default_rng(0)
    before, after = (made(n)[0] for n in numbers)
    before.theta[:] = rng.normal(size=before.theta.shape)
    after.warm_start(before, np.arange(2))
    known = min(numbers)
    told = rng.integers(0, 3, (20, known)).astype(float)
    gaps, acts = rng.random((20, 1)), rng.integers(0, 2, (20, 1))
    there, here = (np.hstack([gaps, told, np.full((20, n - known), 2.0), acts]) for n in numbers)
    for old, new in zip(before.theta, after.theta, strict=True):
        ours, theirs = after.rules.values(new, here), before.rules.values(old, there)
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_experience_of_others_who_tell_is_that_of_nobody() -> None:
    """What is learned after is what would have been learned with nobody in place of them."""
    rng = np.random.default_rng(2)
    keys = {"forgetting": 0.2, "target_averaging_rate": 1.0, "regression_iterations": 60}
    lefts = np.concatenate([rng.random((7, 2, 1)), rng.integers(0, 3, (7, 2, 1))], axis=2)
    padded = np.concatenate([lefts, np.full((7, 2, 1), 2.0)], axis=2)
    acts, paid = rng.integers(0, 2, (7, 2)), 0.01 * rng.normal(size=7)
    carried, whole = made(2, **keys)[0], made(2, **keys)[0]
    former = made(1, **keys)[0]
    feed(former, lefts, acts, paid, True)
    feed(whole, padded, acts, paid, True)
    carried.warm_start(former, np.arange(2))
    np.testing.assert_allclose(carried.state_dict()["gram"], whole.state_dict()["gram"], atol=1e-12)
    for learner in (carried, whole):
        feed(learner, padded[::-1], acts, paid, True)
    np.testing.assert_allclose(carried.theta, whole.theta, atol=1e-6)
    shorter = made(1, **keys)[0]
    shorter.warm_start(whole, np.arange(2))
    assert shorter.states_of(0).shape == (14, 3)
    fresh = made(1, **keys)[0]
    feed(fresh, lefts, acts, paid, True)
    feed(fresh, lefts[::-1], acts, paid, True)
    np.testing.assert_allclose(shorter.state_dict()["gram"], fresh.state_dict()["gram"], atol=1e-12)


def test_rules_over_several_messages_are_not_carried_to_another_number() -> None:
    before = made(2, rule_base=RuleBaseSettings(order=2))[0]
    with pytest.raises(ValueError, match=r"learner.rule_base.order: .* order = 1"):
        made(1)[0].warm_start(before, np.arange(2))


def test_a_topology_that_says_whom_agents_consider_is_remarked_on() -> None:
    silent = {"kind": "chain", "lookahead": "none"}
    spec = Spec(preset="fitted-q", scenario={"kind": "line-up"}, topology=silent)
    told = "topology.lookahead: left out, learner.kind = 'fitted-q' has no lookahead"
    assert any(told in line for c in spec.conditions() for line in c.settings.warnings())
