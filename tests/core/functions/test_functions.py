"""Functions as agents: what they are given, what they may answer, what they say and cost."""

from itertools import pairwise

import numpy as np
import pytest
from acting import look

from nested_agents.core.agents.loop import policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.functions.agents import FunctionAgents, FunctionError
from nested_agents.core.functions.replies import read_reply
from nested_agents.core.hierarchy.failures import (
    DelayedMessages,
    LostMessages,
    NoisyMessages,
)
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.learners import LEARNERS
from nested_agents.core.plugins.sources import Sources
from nested_agents.scenarios.line_up import LineUpSettings

SOURCE = '''
CALLS = []
def plain(observation, received, rng, agent, actions, step, *, far: float = 0.5):
    """Halts near the line."""
    drawn = float(rng.random())
    CALLS.append((agent, dict(observation), dict(received), drawn, actions, step, far))
    return {"action": "zero", "message": {"from": agent}, "costs": {"tokens": 2}}
def many(observations, received, rngs, agents):
    CALLS.append(list(agents))
    return [k % 2 for k in range(len(observations))]
async def slow(observation): return 0
def first(observation): return 0
def jumps(observation): return "jump"
def fails(observation, agent):
    if agent == "cart2": raise ZeroDivisionError("so")
    return 0
def leaves(observation): raise SystemExit
def odd(observation, goal): return 0
def short(observations): return [0]
def own_timeout(observation): raise TimeoutError("the network's")
def echo(observation, received, agent, step):
    CALLS.append((step, agent, {k: tuple(m) for k, m in received.items()}))
    return {"action": step % 4, "message": f"{agent}{step}"}
'''


def team_of(name: str, n: int = 3, hierarchy: Hierarchy | None = None, failures=(), **more):
    """A team of a function of `SOURCE`, its world, and what it notes."""
    sources = Sources(texts={"f.py": SOURCE})
    with sources.active():
        settings = LEARNERS.parsed(f"f.py:{name}", **more)
        world = LineUpSettings(carts=n).build()
        hierarchy = hierarchy or Hierarchy(world.agents, list(pairwise(world.agents)))
        team = Team(settings, world, hierarchy, policy_seed(3), failures)
        calls = sources.load("f.py:CALLS")
        calls.clear()
    team.reset(0, 0)
    return team, world, calls


def test_a_function_is_given_names_and_is_told_by_name() -> None:
    team, world, calls = team_of("plain", far=0.25, costs={"tokens": "1"})
    states = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])
    decision = team.act(look(world, states))
    assert decision.joint_action.tolist() == [3, 3, 3]
    agent, seen, told, _, actions, step, far = calls[2]
    assert (agent, seen) == ("cart3", {"distance": 0.5, "lead": 0.6})
    assert {k: (m.action, m.content) for k, m in told.items()} == {
        "cart1": ("zero", {"from": "cart1"}),
        "cart2": ("zero", {"from": "cart2"}),
    }
    assert (actions, step, far) == (world.action_set.names, 0, 0.25)
    # three messages of {"from":"cart1"}, 16 bytes each; two tokens each
    assert team.decision_costs == {"calls": 3, "messages": 3, "message_bytes": 48, "tokens": 6}


def test_random_numbers_follow_from_agent_step_and_episode_alone() -> None:
    def drawn(hierarchy: Hierarchy | None) -> dict:
        team, world, calls = team_of("plain", hierarchy=hierarchy, costs={"tokens": "1"})
        for episode in (0, 1):
            team.reset(0, episode)
            for _ in range(2):
                team.act(look(world))
        return {(k // 6, call[0], call[5]): call[3] for k, call in enumerate(calls)}

    chain = drawn(None)
    names = [f"cart{i}" for i in (1, 2, 3)]
    assert chain == drawn(Hierarchy(names, [("cart3", "cart1")]))
    assert len(set(chain.values())) == 12


def test_several_agents_are_asked_in_one_call_if_the_function_says_so() -> None:
    names = ["cart1", "cart2", "cart3"]
    star = Hierarchy(names, [("cart1", "cart2"), ("cart1", "cart3")])
    team, world, calls = team_of("many", hierarchy=star)
    assert team.act(look(world)).joint_action.tolist() == [0, 0, 1]
    assert calls == [["cart1"], ["cart2", "cart3"]]


@pytest.mark.parametrize(
    ("name", "settings", "complaint"),
    [
        ("jumps", {}, r"agent 'cart1': f\.py:jumps returns the action 'jump', allowed: increase"),
        ("fails", {}, r"agent 'cart2': f\.py:fails raises ZeroDivisionError: so in line \d+ of"),
        ("leaves", {}, r"agent 'cart1': f\.py:leaves raises SystemExit"),
        ("own_timeout", {}, r"agent 'cart1': .* raises TimeoutError: the network's"),
        ("short", {}, r"agent 'cart1': .* allowed: a list of 3 answers"),
        (
            "plain",
            {},
            r"f\.py:plain returns costs\.tokens: unknown cost, allowed: none",
        ),
    ],
)
def test_what_a_function_does_wrong_names_the_agent(name, settings, complaint) -> None:
    alone = Hierarchy(["cart1", "cart2", "cart3"], [])
    team, world, _ = team_of(name, hierarchy=alone, **settings)
    with pytest.raises(FunctionError, match=complaint) as caught:
        team.act(look(world))
    assert "\n" not in str(caught.value)


def test_a_function_that_takes_something_else_is_refused() -> None:
    with pytest.raises(ValueError, match=r"parameter 'goal', allowed: observation, received"):
        team_of("odd")
    with pytest.raises(ValueError, match=r"f\.py:slow.*pip install plugins/language_agents"):
        team_of("slow")


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        (True, "the action True"),
        (2, "the action 2"),
        (-1, "the action -1"),
        (None, "the action None"),
        ({"message": "so"}, "the action None"),
        ({"action": 0, "says": 1}, "answers with 'says'"),
        ({"action": 0, "message": {1, 2}}, "allowed: values that JSON can"),
        ({"action": 0, "message": float("nan")}, "allowed: values that JSON can"),
        ({"action": 0, "costs": 3}, "numbers by name"),
        ({"action": 0, "costs": {"t": -1}}, r"costs\.t = -1, allowed: numbers from 0"),
        ({"action": 0, "costs": {"t": "many"}}, r"costs\.t = 'many'"),
        ({"action": 0, "costs": {"x": 1}}, r"costs\.x: unknown cost, allowed: t"),
    ],
)
def test_answers_that_mean_nothing_are_refused(answer, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        read_reply(answer, ("left", "right"), {"t": "1"})


def test_neighbors_are_told_what_was_said_in_the_decision_before() -> None:
    names = ["cart1", "cart2", "cart3"]
    beside = Hierarchy(names, [], [("cart1", "cart2")])
    team, world, calls = team_of("echo", hierarchy=beside)
    for _ in range(2):
        team.act(look(world))
    assert calls[:3] == [(0, name, {}) for name in names]
    assert calls[3:] == [
        (1, "cart1", {"cart2": ("increase", "cart20")}),
        (1, "cart2", {"cart1": ("increase", "cart10")}),
        (1, "cart3", {}),
    ]


@pytest.mark.parametrize(
    ("failure", "told"),
    [
        (LostMessages(agents="cart1"), [{}, {}, {}]),
        (
            DelayedMessages(agents="cart1", decisions=2),
            [{}, {}, {"cart1": ("increase", "cart10")}],
        ),
    ],
)
def test_a_content_has_the_fate_of_its_message(failure, told) -> None:
    team, world, calls = team_of("echo", 2, failures=[failure])
    for _ in range(3):
        team.act(look(world))
    assert [own for _, agent, own in calls if agent == "cart2"] == told


def test_nobody_can_read_what_noise_has_replaced() -> None:
    team, world, calls = team_of("echo", 2, failures=[NoisyMessages(agents="*", probability=1.0)])
    for _ in range(40):
        team.act(look(world))
    heard = [(step, own["cart1"]) for step, agent, own in calls if agent == "cart2"]
    names = world.action_set.names
    is_same = [action == names[step % 4] for step, (action, _) in heard]
    assert 0 < sum(is_same) < 40
    assert [content is not None for _, (_, content) in heard] == is_same


def test_delays_of_neighbors_add_to_the_decision_before() -> None:
    beside = Hierarchy(["cart1", "cart2"], [], [("cart1", "cart2")])
    failure = DelayedMessages(agents="cart1", decisions=1)
    team, world, calls = team_of("echo", 2, beside, [failure])
    for _ in range(3):
        team.act(look(world))
    heard = [own for _, agent, own in calls if agent == "cart2"]
    assert heard == [{}, {}, {"cart1": ("increase", "cart10")}]


def test_actions_alone_are_heard_if_the_receiver_wants_no_more() -> None:
    team, world, calls = team_of("echo", 2, hears="actions")
    team.act(look(world))
    assert calls[1][2] == {"cart1": ("increase", None)}
    assert team.decision_costs == {"calls": 2, "messages": 1, "message_bytes": 0}


def test_functions_and_learners_are_one_team() -> None:
    with Sources(texts={"f.py": SOURCE}).active():
        parts = [
            {"agents": "cart1", "learner": {"kind": "f.py:first"}},
            {"agents": "*", "learner": {"kind": "td-lambda"}},
        ]
        settings = LEARNERS.model("mixed").model_validate({"kind": "mixed", "parts": parts})
        world = LineUpSettings(carts=3).build()
        chain = Hierarchy(world.agents, list(pairwise(world.agents)))
        team = Team(settings, world, chain, policy_seed(0))
    seen = look(world, world.reset(0))
    assert [int(team.act(seen).joint_action[0]) for _ in range(3)] == [0, 0, 0]
    assert isinstance(team.parts[0], FunctionAgents)
    team.load_state_dict(team.state_dict())
