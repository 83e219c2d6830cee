"""Messages down the hierarchy: who hears what, and how it fails."""

from itertools import pairwise

import numpy as np
import pytest

from nested_agents.core.hierarchy.failures import (
    GARBLED,
    AbsentAgents,
    DelayedMessages,
    LeftAgents,
    LostMessages,
    MessageFailure,
    NoisyMessages,
)
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.hierarchy.messages import Messages

CHAIN = Hierarchy("abcd", list(pairwise("abcd")))
DECIDED = np.array([3, 1, 0, 2])


def messages(*failures: MessageFailure, hierarchy: Hierarchy = CHAIN) -> Messages:
    made = Messages(hierarchy, failures, n_actions=4)
    made.reset(5, episode=0)
    return made


def heard(made: Messages, agent: int, decided: np.ndarray = DECIDED) -> dict[int, int]:
    senders, actions, _ = made.received(agent, decided)
    return dict(zip(senders.tolist(), actions.tolist(), strict=True))


def test_all_that_is_told_arrives_unless_something_fails() -> None:
    assert heard(messages(), 3) == {0: 3, 1: 1, 2: 0}
    assert heard(messages(), 0) == {}
    assert not messages().failures


def test_those_who_are_silent_are_not_heard_and_act_on() -> None:
    made = messages(LostMessages(agents=["a", "c"]))
    assert heard(made, 3) == {1: 1}
    assert not made.absent.any()
    assert made.failures


def test_messages_are_lost_as_often_as_they_should_be() -> None:
    made = messages(LostMessages(agents="*", probability=0.3))
    count = sum(len(heard(made, 3)) for _ in range(2000))
    assert count / 6000 == pytest.approx(0.7, abs=0.03)


def test_late_messages_say_what_was_done_before() -> None:
    made = messages(DelayedMessages(agents="b", decisions=2))
    assert heard(made, 3) == {0: 3, 2: 0}
    for past in ([0, 2, 0, 0], [0, 3, 0, 0]):
        made.advance(np.array(past))
    assert heard(made, 3) == {0: 3, 1: 2, 2: 0}
    made.reset(5, episode=1)
    assert heard(made, 3) == {0: 3, 2: 0}


def test_each_delay_has_its_own_length_and_one_decision_by_default() -> None:
    made = messages(DelayedMessages(agents="a"), DelayedMessages(agents="b", decisions=3))
    for past in ([1, 3, 0, 0], [2, 2, 0, 0], [0, 1, 0, 0]):
        made.advance(np.array(past))
    assert heard(made, 3) == {0: 0, 1: 3, 2: 0}


def test_noise_alters_what_is_said_by_whom_it_befalls_alone() -> None:
    made = messages(NoisyMessages(agents="b", probability=1.0))
    said = [heard(made, 3) for _ in range(400)]
    assert {(s[0], s[2]) for s in said} == {(3, 0)}
    assert np.bincount([s[1] for s in said], minlength=4) == pytest.approx([100] * 4, abs=35)


@pytest.mark.parametrize("is_first", [True, False])
def test_several_failures_of_one_agent_delay_first(is_first: bool) -> None:
    """The longest delay counts, and what is garbled stays so: its payload is lost, not late."""
    delay = [DelayedMessages(agents="a", decisions=n) for n in (2, 1)]
    noise = NoisyMessages(agents="a", probability=1.0)
    made = messages(*delay)
    made.reset(0, 0)
    for n in range(3):
        made.advance(np.array([n, 3, 3, 3]))
    _, actions, ages = made.received(1, DECIDED)
    assert (actions.tolist(), ages.tolist()) == ([1], [2])
    garbled = messages(*(delay[1], noise)[:: 1 if is_first else -1])
    drawn = set()
    for seed in range(20):
        garbled.reset(seed, 0)
        garbled.advance(np.array([1, 3, 3, 3]))
        _, actions, ages = garbled.received(1, DECIDED)
        drawn |= {(*actions.tolist(), *ages.tolist())}
    assert {age for action, age in drawn if action != 1} == {GARBLED}
    assert len({action for action, _ in drawn}) > 1


def test_who_is_absent_says_nothing() -> None:
    made = messages(AbsentAgents(agents="a", episode=1, end_episode=2))
    assert (made.absent.any(), len(heard(made, 3))) == (False, 3)
    made.reset(5, episode=1)
    assert made.absent.tolist() == [True, False, False, False]
    assert heard(made, 1) == {}
    made.reset(5, episode=2)
    assert not made.absent.any()


@pytest.mark.parametrize("absence", [AbsentAgents, LeftAgents])
def test_no_message_of_an_absence_arrives_later(absence) -> None:
    made = messages(
        absence(agents="a", end_episode=0, end_step=1),
        DelayedMessages(agents="*"),
        NoisyMessages(agents="*", probability=0.5),
    )
    for senders in ([1], [0, 1]):
        made.advance(DECIDED)
        assert made.received(2, DECIDED)[0].tolist() == senders


def test_the_same_seed_loses_the_same_messages() -> None:
    one, same, other = (messages(LostMessages(agents="*", probability=0.5)) for _ in range(3))
    other.reset(6, episode=0)
    lost = [[tuple(heard(made, 3)) for _ in range(50)] for made in (one, same, other)]
    assert lost[0] == lost[1] != lost[2]


def test_whose_messages_fail_when_is_known_beforehand() -> None:
    silent = LostMessages(agents="b", step=1, end_episode=0, end_step=2)
    made = messages(silent, NoisyMessages(agents=["a"], episode=1))
    assert made.failing(0, 3).tolist() == [[0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]]
    assert made.failing(1, 1).tolist() == [[1, 0, 0, 0]]
    absent = messages(AbsentAgents(agents="b"), NoisyMessages(agents="*"), LeftAgents(agents="c"))
    assert absent.failing(0, 1).tolist() == [[1, 2, 2, 1]]
    assert LostMessages(agents=["a", "c*"], probability=0.5).text == "lost: a, c*, probability 0.5"


@pytest.mark.parametrize(
    ("failure", "complaint"),
    [
        (LostMessages(agents="e"), r"topology.failures\[0\].agents = 'e': no such agent, allowed"),
    ],
)
def test_failures_of_agents_that_do_not_exist_are_refused(failure, complaint) -> None:
    with pytest.raises(ValueError, match=complaint):
        messages(failure)
