"""What environments return is read where it is, or refused in words."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from made_up_environments import (
    LENGTH,
    Cart,
    CartPaidInArrays,
    EndsApart,
    LateButSeeing,
    MixedEnd,
    Numbered,
    NumberedTurns,
    PaidInArrays,
    ReusingAfterwards,
    StrayEnd,
    Turns,
    Unnamed,
    Walkers,
)

from nested_agents.scenarios.adapters.simulators import (
    SINGLE,
    EnvironmentStep,
    Simulator,
    make_simulator,
)


def play(env: Any, action: int = 2) -> tuple[Simulator, list[EnvironmentStep]]:
    """Play an episode of an environment in which all do the same."""
    simulator = make_simulator(env)
    played = [simulator.reset(0)]
    while not played[-1].is_over:
        played.append(simulator.step(dict.fromkeys(simulator.players, action)))
    return simulator, played


def test_a_step_is_told_by_player() -> None:
    simulator, played = play(Walkers())
    assert simulator.players == ("agent_0", "agent_1")
    assert [step.step for step in played] == list(range(LENGTH + 1))
    assert (played[-1].terminated, played[-1].truncated) == (False, True)
    assert not any(step.is_over for step in played[:-1])


@pytest.mark.parametrize("env", [Numbered(), Unnamed()], ids=["0, 1, 2", ""])
def test_ids_are_of_any_type(env: Any) -> None:
    simulator, played = play(env)
    assert simulator.players == tuple(env.possible_agents)
    assert set(played[-1].observations) == set(played[-1].rewards) == set(simulator.players)


def test_turns_are_taken_at_once() -> None:
    _, played = play(Turns(), action=2)
    assert len(played) == LENGTH + 1
    assert played[1].rewards == {"first": 1.0, "second": 2.0}
    moved = [float(step.observations["second"][0]) for step in played]  # type: ignore[index]
    assert moved[3] - moved[0] == pytest.approx(0.3)


def test_an_episode_ends_when_each_has_ended_in_either_way() -> None:
    _, played = play(MixedEnd())
    assert len(played) == 6
    assert (played[-1].terminated, played[-1].truncated) == (False, True)
    _, played = play(EndsApart())
    assert len(played) == 5
    assert (played[-1].terminated, played[-1].truncated) == (True, False)


def test_a_flag_of_an_unknown_agent_is_refused() -> None:
    with pytest.raises(ValueError, match="terminations at step 1: 'agent_2' is not in possible"):
        play(StrayEnd())


def test_rewards_of_one_number_are_numbers() -> None:
    _, played = play(PaidInArrays())
    assert {type(reward) for step in played for reward in step.rewards.values()} == {float}
    _, played = play(CartPaidInArrays())
    assert type(played[-1].rewards[SINGLE]) is float


def test_who_observes_from_the_start_may_act_later() -> None:
    _, played = play(LateButSeeing())
    assert len(played) == LENGTH + 1
    assert played[1].rewards["agent_1"] == 0.0


def test_who_has_left_observes_what_it_last_observed() -> None:
    _, played = play(ReusingAfterwards())
    last = [step.observations["agent_0"] for step in played[4:]]
    assert all(seen[1] == pytest.approx(0.3) for seen in last)  # type: ignore[index]


@pytest.mark.parametrize(
    ("env", "message"),
    [
        (3, "is int, allowed: an environment of Gymnasium or PettingZoo"),
        (
            gymnasium.vector.SyncVectorEnv([Cart, Cart]),
            "is a vector of environments, allowed: a single",
        ),
        (NumberedTurns(), "possible_agents: 0 is not text"),
    ],
)
def test_what_is_no_environment_is_refused(env: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make_simulator(env)


def test_a_reward_that_has_many_numbers_is_refused_by_player_and_step() -> None:
    class Pair(Walkers):
        def pay(self, agent: Any) -> Any:
            return np.zeros(2) if agent == "agent_1" and self.t == 2 else 0.0

    with pytest.raises(
        ValueError, match=r"reward of agent_1 at step 2 = array.*, allowed: one finite"
    ):
        play(Pair())
