"""A leader decides when its option ends, learns from what happened meanwhile, and is saved."""

import numpy as np
import pytest

from nested_agents.core.agents.loop import control_loop, policy_seed
from nested_agents.core.agents.team import Team
from nested_agents.core.hierarchy.failures import LostMessages
from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.options import LeaderOptions
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.core.learners.fitted_q import FittedQSettings
from nested_agents.core.learners.learner import LearnerSettings
from nested_agents.core.learners.written import WrittenSettings
from nested_agents.core.networks.settings import PPOSettings
from nested_agents.core.search.exploration import BurstExploration

SPACE = StateSpace("road", (Variable("place", "m", 0.0, 6.0),))
OPTIONS = ActionSet(("walk", "ride"), (1.0, 1.0), (0.0, 0.0), neutral=0)
LEARNER = FittedQSettings(
    discount=0.9, ridge=1e-6, exploration=BurstExploration(rate=1.0, decay=1.0, length=1.0)
)


class RoadOptions(LeaderOptions):
    """``walk`` moves by 1 in a decision, ``ride`` by 4 in two decisions, a given skill."""

    state_space = SPACE
    action_set = OPTIONS

    def __init__(self, road: "Road", learner: FittedQSettings | None, limit: int = 9) -> None:
        self.road, self.learner, self.limit = road, learner, limit
        self.begun: list[int] = []

    def observe(self) -> np.ndarray:
        return np.array([self.road.place])

    def rule(self) -> int:
        return int(self.road.place < 2.0)

    def begin(self, option: int) -> np.ndarray:
        self.begun.append(option)
        self.option, self.left = option, 2 if option else 1
        return np.full((1, 1), 100.0 + option)

    def advance(self) -> bool:
        self.left -= 1
        return self.left > 0

    def joint_action(self) -> np.ndarray | None:
        return np.ones(1, int) if self.option else None


class Road(Scenario):
    """A traveler on a road of 6 m; a decision costs 1, and the end is worth 0 forever."""

    agents = ("traveler",)
    state_space = StateSpace("traveler", (Variable("place", "m", 0.0, 200.0),))
    action_set = ActionSet(("step", "ride"), (1.0, 1.0), (0.0, 0.0), neutral=0)

    def reset(self, seed: object, episode: int = 0) -> np.ndarray:
        self.place = 0.0
        return np.zeros((1, 1))

    def step(self, joint_action: np.ndarray) -> Transition:
        self.place += 2.0 if joint_action[0] else 1.0
        is_there = self.place >= 6.0
        return Transition(np.full((1, 1), self.place), float(is_there) - 1.0, is_there, False, {})


def led(
    learner: FittedQSettings | None, below: LearnerSettings | PPOSettings | None = None, **keys: int
) -> tuple[Road, Team]:
    road = Road()
    road.options = RoadOptions(road, learner, **keys)
    below = below or WrittenSettings(value={"place": 0.0}, decision={"rule": "random"})
    team = Team(below, road, Hierarchy(road.agents, []), policy_seed(0))
    return road, team


def test_a_leader_by_rule_decides_when_its_option_has_ended() -> None:
    road, team = led(None)
    road.step = lambda joint: Road.step(road, joint if road.options.option else np.zeros(1, int))
    steps = list(control_loop(road, team, episodes=1, steps=20, seed=0, learn=False))
    assert road.options.begun == [1, 0, 0]  # ride to 4, walk to 6
    assert len(steps) == 4


def test_an_option_ends_at_the_limit() -> None:
    road, team = led(None, limit=1)
    list(control_loop(road, team, episodes=1, steps=2, seed=0, learn=False))
    assert road.options.begun[0] == 1
    assert len(road.options.begun) == 2


def test_the_learner_receives_discounted_rewards_and_the_duration() -> None:
    road, team = led(LEARNER)
    road.step = lambda joint: Road.step(road, joint if road.options.option else np.zeros(1, int))
    (agent,) = team.leader.agents
    received = []
    observe = agent.learner.observe_decision

    def spy(left, joint, states, reward, terminated, duration=1):
        received.append((float(left[0, 0]), int(joint[0]), float(reward), terminated, duration))
        return observe(left, joint, states, reward, terminated, duration)

    agent.learner.observe_decision = spy
    list(control_loop(road, team, episodes=40, steps=20, seed=0))
    for place, option, reward, terminated, duration in received:
        rides_on = option == 1 and place < 4.0
        if not terminated:
            assert duration == (2 if rides_on else 1)
            assert reward == pytest.approx(-1.9 if rides_on else -1.0)
    # Weights: riding twice, through 4, costs 1 + .9 + .81 and nothing at the end.
    theta = agent.learner.theta[0]
    values = [agent.rules.values(theta, np.array([[0.0, k]]))[0] for k in (0.0, 1.0)]
    assert values[1] > values[0]


def test_a_leader_learns_from_every_option_if_it_learns_without_exploring() -> None:
    road, team = led(LEARNER)
    steps = list(control_loop(road, team, episodes=3, steps=20, seed=0, learn=True, explore=False))
    state = team.leader.agents[0].learner.state_dict()
    assert len(state["rewards"]) == len(road.options.begun)
    assert state["durations"].sum() == len(steps)
    assert state["rewards"].min() >= -1.9  # that of a ride


def test_a_leader_that_does_not_learn_neither_explores_nor_stores_anything() -> None:
    road, team = led(LEARNER)
    list(control_loop(road, team, episodes=3, steps=20, seed=0))
    before = {name: array.copy() for name, array in team.state_dict().items()}
    team.leader.agents[0].explorer.choose = None  # nobody calls it
    loop = control_loop(road, team, episodes=9, steps=20, seed=0, learn=False, explore=True)
    assert len(list(loop)) > 9
    after = team.state_dict()
    for name in before.keys() - {"part0.generator", "part1.generator"}:
        np.testing.assert_array_equal(after[name], before[name], name)


def test_policies_below_a_leader_draw_in_an_evaluation_by_sampled_actions() -> None:
    road, team = led(LEARNER, PPOSettings(), limit=1)
    road.options.joint_action = lambda: None
    drawn = {}
    for learn, explore in ((True, True), (False, False), (False, True)):
        state = team.parts[0].rng.bit_generator.state
        list(control_loop(road, team, episodes=1, steps=3, seed=0, learn=learn, explore=explore))
        drawn[learn, explore] = team.parts[0].rng.bit_generator.state != state
    assert drawn == {(True, True): False, (False, False): False, (False, True): True}


def test_a_led_team_is_saved_and_continues(tmp_path) -> None:
    road, team = led(LEARNER)
    list(control_loop(road, team, episodes=3, steps=20, seed=0))
    team.save(tmp_path / "team.npz")
    again, other = led(LEARNER)
    other.load(tmp_path / "team.npz")
    after = [
        [record.joint_action.tolist() for record in control_loop(
            scenario, one, episodes=3, steps=20, seed=0, first_episode=3)]
        for scenario, one in ((road, team), (again, other))
    ]  # fmt: skip
    assert after[0] == after[1]
    assert road.options.begun[-5:] == again.options.begun[-5:]
    _, third = led(LEARNER)
    third.warm_start(team)
    theta = team.leader.agents[0].learner.theta
    np.testing.assert_array_equal(third.leader.agents[0].learner.theta, theta)


def test_below_a_leader_messages_do_not_fail_and_environments_are_not_many() -> None:
    road = Road()
    road.options = RoadOptions(road, None)
    chain = Hierarchy(road.agents, [])
    with pytest.raises(ValueError, match="environments"):
        Team(PPOSettings(environments=2), road, chain, policy_seed(0))
    with pytest.raises(ValueError, match=r"topology\.failures"):
        Team(LEARNER, road, chain, policy_seed(0), [LostMessages(agents="*", probability=0.5)])


def test_a_team_without_a_leader_refuses_a_scenario_with_one() -> None:
    road, team = led(None)
    road.options = None
    with pytest.raises(ValueError, match=r"scenario\.leader"):
        list(control_loop(road, team, episodes=1, steps=1, seed=0))
