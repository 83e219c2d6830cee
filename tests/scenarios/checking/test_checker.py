"""The checker passes sound scenarios and catches every planted fault in one line."""

import random
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nested_agents import View, state_variable
from nested_agents.core.agents.joint_agents import join_agents
from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.core.interface.prediction import Blocks
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.settings import (
    WheelFailure,
)
from nested_agents.scenarios.checking.checker import CHECKS, ScenarioError, check_scenario
from nested_agents.scenarios.checking.frames import random_actions
from nested_agents.scenarios.checking.predictions import fault_of_prediction
from nested_agents.scenarios.checking.sensing import fault_of_sensing
from nested_agents.scenarios.line_up import LEAD, LineUp, LineUpPrediction, LineUpSettings
from nested_agents.scenarios.state_variables import StateVariable
from nested_agents.studies.cli.main import main

FAILURES = (
    WheelFailure.Noisy(wheels=("*",), episode=1, end_episode=2),
    WheelFailure.Delayed(wheels=("robot1.*",), periods=5),
    WheelFailure.Seized(wheels=("*.left",), step=4),
)


def line(**changes: Callable[..., Any]) -> Callable[[], Scenario]:
    """Return a factory of line-ups with methods changed."""
    return lambda: type("Changed", (LineUp,), changes)(LineUpSettings())


@pytest.mark.parametrize(
    "factory",
    [
        lambda: LineUp(LineUpSettings(carts=3)),
        lambda: join_agents(LineUp(LineUpSettings()), "team"),
        lambda: BoxPushing(BoxPushingSettings()),
        lambda: BoxPushing(BoxPushingSettings(state_space="paper", start="hard", box="bar")),
        lambda: BoxPushing(BoxPushingSettings(failures=FAILURES)),
        lambda: join_agents(BoxPushing(BoxPushingSettings(state_space="paper")), "body"),
    ],
    ids=["line-up", "single agent", "box pushing", "paper", "failures", "robots"],
)
def test_sound_scenarios_pass(factory: Callable[[], Scenario]) -> None:
    assert check_scenario(factory, steps=20) == tuple(CHECKS)


def test_a_made_up_scenario_passes(line_world: Any) -> None:
    assert check_scenario(lambda: line_world(2, 2)) == tuple(CHECKS)


class Bare:
    """A scenario with nothing but what it must have, and a reward for each agent."""

    agents = ("a", "b")
    action_set = ActionSet()
    state_space = StateSpace("bare", (Variable("place", "m", -9.0, 9.0),))

    def reset(self, seed: Any, episode: int = 0) -> Any:
        self.places = np.random.default_rng(seed).normal(size=(2, 1))
        return self.places

    def step(self, joint_action: Any) -> Transition:
        self.places = self.after(joint_action)
        return Transition(self.places, self.places[:, 0], False, False, {})

    def after(self, joint_action: Any) -> Any:
        return self.places + 0.1 * joint_action[..., None]

    def predict(self) -> Any:
        return BarePrediction(self.places)


class BarePrediction:
    def __init__(self, places: Any) -> None:
        self.places = places

    def states(self, agent: int, joint_actions: Any) -> Any:
        return self.places[agent] + 0.1 * joint_actions[:, agent, None]


def test_what_a_scenario_need_not_have_is_not_asked_for() -> None:
    assert check_scenario(Bare) == tuple(CHECKS)


def test_a_variable_with_a_hidden_state_is_sensed_otherwise_than_predicted() -> None:
    scenario: Any = perceiving(stale)()
    actions = random_actions(scenario, 5, 0)
    fault = fault_of_sensing(scenario.with_exact_prediction(), 0, 0, actions)
    assert re.match(r"stale of agent \d is \d, predicted \d, at step 1 of seed 0", fault or "")


# The faults, each a small change of a sound scenario.

entropy = random.Random(3)


def late_noise(self: Any, joint_action: Any) -> Any:
    """Differ from run to run from step 2 on, as nothing that compares one step notices."""
    self.count = getattr(self, "count", 0) + 1
    if self.count >= 2:
        self._places = self._places + 1e-12 * entropy.random()
    return LineUp.step(self, joint_action)


def same_start(self: Any, seed: Any, episode: int = 0) -> Any:
    return LineUp.reset(self, 0, episode)


shared: dict[str, Any] = {}


def shared_state(self: Any, joint_action: Any) -> Any:
    """Keep the speeds in one place for all instances."""
    self._speeds = shared.get("speeds", self._speeds)
    transition = LineUp.step(self, joint_action)
    shared["speeds"] = self._speeds
    return transition


def shared_reset(self: Any, seed: Any, episode: int = 0) -> Any:
    shared.clear()
    return LineUp.reset(self, seed, episode)


def forgets_to_reset(self: Any, seed: Any, episode: int = 0) -> Any:
    before = self._commands
    LineUp.reset(self, seed, episode)
    self._commands = before
    return self._states()


def nan_at(step: int, field: str) -> Callable[..., Any]:
    def changed(self: Any, joint_action: Any) -> Any:
        self.count = getattr(self, "count", 0) + 1
        transition = LineUp.step(self, joint_action)
        if self.count != step:
            return transition
        if field == "info":
            return replace(transition, info={**transition.info, "deep": {"x": np.inf}})
        value = transition.states + np.nan if field == "states" else float("nan")
        return replace(transition, **{field: value})

    return changed


def predict_and_move(self: Any) -> Any:
    self._places = self._places + 1e-9
    return LineUp.predict(self)


def global_numbers(self: Any, seed: Any, episode: int = 0) -> Any:
    np.random.seed(0)  # noqa: NPY002
    random.random()
    return LineUp.reset(self, seed, episode)


def spawning(self: Any, seed: Any, episode: int = 0) -> Any:
    self.other = seed.spawn(1)[0] if isinstance(seed, np.random.SeedSequence) else None
    return LineUp.reset(self, seed, episode)


def one_buffer(self: Any) -> Any:
    if not hasattr(self, "buffer"):
        self.buffer = np.zeros((2, 2))
    self.buffer[:, 0] = self._places
    self.buffer[:, 1] = self._places - self._places.mean()
    return self.buffer


def greedy_hands(self: Any, joint_action: Any) -> Any:
    transition = LineUp.step(self, joint_action)
    joint_action[:] = 0
    return transition


def angle_out_of_range(self: Any, *args: Any) -> None:
    LineUp.__init__(self, LineUpSettings())
    angle = replace(LEAD, low=-0.01, high=0.01, centres=(), periodic=True)
    self.state_space = StateSpace("line-up", (self.state_space.variables[0], angle), n_own=1)


def short_states(self: Any) -> Any:
    return self._places[:, None]


def lengthy_reward(self: Any, joint_action: Any) -> Any:
    return replace(LineUp.step(self, joint_action), reward=np.zeros(3))


def uncertain_end(self: Any, joint_action: Any) -> Any:
    return replace(LineUp.step(self, joint_action), terminated=None)


def twins(self: Any, *args: Any) -> None:
    LineUp.__init__(self, LineUpSettings())
    self.agents = ("cart", "cart")


def crossed(self: Any, *args: Any) -> None:
    LineUp.__init__(self, LineUpSettings())
    self.groups = ((1,), (0,))


def no_prediction(self: Any) -> Any:
    prediction = LineUp.predict(self)
    prediction._places[:] = np.nan
    return prediction


def raising(self: Any, joint_action: Any) -> Any:
    raise KeyError("two\nlines")


def a_tuple(self: Any, joint_action: Any) -> Any:
    transition = LineUp.step(self, joint_action)
    return transition.states, transition.reward


def tables(
    blocks: Callable[[Blocks], Blocks] | None = None, rewards: Callable[[Any], Any] | None = None
) -> Callable[[], Scenario]:
    """Return a factory of line-ups whose predictions have other tables."""

    class Changed(LineUpPrediction):
        def blocks(self, agent: int) -> Blocks:
            sound = super().blocks(agent)
            return blocks(sound) if blocks and agent == 1 else sound

        def reward_table(self) -> Any:
            sound = super().reward_table()
            return rewards(sound) if rewards else sound

    def predict(self: Any) -> Any:
        return Changed(LineUp.predict(self)._places)

    return line(predict=predict)


def rowed(**changes: Any) -> Callable[[], Scenario]:
    """Return a factory of line-ups whose blocks have other fields."""
    return tables(lambda blocks: replace(blocks, **changes))


def declared(**members: Any) -> Callable[[], Scenario]:
    """Return a factory of line-ups that declare other members."""

    def changed(self: Any, *args: Any) -> None:
        LineUp.__init__(self, LineUpSettings())
        for name, value in members.items():
            setattr(self, name, value)

    return line(__init__=changed)


def off_by(distance: float, *, together: bool = False) -> Callable[[], Scenario]:
    """Return a factory of line-ups that predict other places, of all agents at once or of each."""

    class Changed(LineUpPrediction):
        def states_by_group(self, joint_actions: Any) -> Any:
            own, shared = super().states_by_group(joint_actions)
            return own + (distance if together else 0.0), shared

    def predict(self: Any) -> Any:
        return Changed(LineUp.predict(self)._places + (0.0 if together else distance))

    return line(predict=predict)


@state_variable("m", 0.0, 1.1)
def per_period(view: View, robot: int) -> Any:
    """Mean something else where several periods are looked ahead."""
    return view.distance / view.periods


times = count()


@state_variable("1", 0.0, 1000.0)
def stale(view: View, robot: int) -> Any:
    """Depend on how often it was asked for."""
    return np.full(len(view.box), float(next(times) % 7))


@state_variable("m", 0.0, 0.5, common=True)
def not_common(view: View, robot: int) -> Any:
    """Differ between robots, unlike what is said of it."""
    return np.minimum(view.gaps[:, robot], 0.5)


def perceiving(variable: StateVariable, robots: int = 1) -> Callable[[], Scenario]:
    return BoxPushingSettings(robots=robots, state_space=("gap", variable)).build  # type: ignore[arg-type]


def leaving(self: Any, *args: Any) -> Any:
    sys.exit(0)


BLOCKS = "predictions: blocks of agent 1: "
SENSED = "sensed and predicted: "

FAULTS: dict[str, tuple[Callable[[], Scenario], str]] = {
    "late noise": (line(step=late_noise), r"equal seeds: two runs with seed 0 differ at step 2"),
    "ignored seed": (line(reset=same_start), "different seeds: seeds 0, 1 give one and the same"),
    "shared state": (
        line(step=shared_state, reset=shared_reset),
        "two instances: an instance with seed . played in turns with another differs at step",
    ),
    "state left over": (line(reset=forgets_to_reset), "equal seeds: seed . after another episode"),
    "NaN state": (line(step=nan_at(4, "states")), "finite numbers: states is not finite at step 4"),
    "NaN reward": (line(step=nan_at(2, "reward")), "finite numbers: reward is not .* step 2"),
    "infinite info": (line(step=nan_at(1, "info")), "finite numbers: info.deep.x is not finite"),
    "prediction moves": (line(predict=predict_and_move), "predicting: an episode in which"),
    "NaN prediction": (line(predict=no_prediction), "predictions: predicted states of agent 0"),
    "global numbers": (line(reset=global_numbers), "the global state of random and numpy.random"),
    "spawns": (line(reset=spawning), "returned arrays: reset spawns"),
    "one buffer": (line(_states=one_buffer), "returned arrays: states at the start: .* changed"),
    "action changed": (line(step=greedy_hands), "step changes the joint action"),
    "period": (line(__init__=angle_out_of_range), "bounds: lead leaves .* at the start"),
    "shape": (line(_states=short_states), r"form: states of shape \(2, 1\) at the start"),
    "three rewards": (line(step=lengthy_reward), r"form: reward of shape \(3,\)"),
    "end": (line(step=uncertain_end), "form: terminated and truncated must be bool"),
    "twins": (line(__init__=twins), "form: agents .*, of different names"),
    "groups": (line(__init__=crossed), "form: groups .* must hold the 2 agents once each"),
    "raises": (line(step=raising), r"form: KeyError in raising, test_checker.py:\d+: .two.*lines"),
    "tuple": (line(step=a_tuple), "form: step returns tuple, must be Transition: no states"),
    "own reversed": (
        tables(lambda b: replace(b, own=b.own[::-1].copy())),
        BLOCKS + r"distance = \S+ after joint action \[0, 0\], states has",
    ),
    "shared reversed": (
        tables(lambda b: replace(b, shared=b.shared[::-1].copy())),
        BLOCKS + "lead = ",
    ),
    "shared nearly right": (
        tables(lambda b: replace(b, shared=b.shared + 1e-6)),
        BLOCKS + "lead = ",
    ),
    "rewards reversed": (
        tables(rewards=lambda table: table[::-1]),
        "predictions: reward_table: .*, rewards has",
    ),
    "rewards short": (
        tables(rewards=lambda table: table[:5]),
        r"reward_table of shape \(5,\), must be \(16,\)",
    ),
    "divisor": (rowed(divisor=4), BLOCKS + "divisor = 4, must be 1"),
    "shared short": (
        tables(lambda b: replace(b, shared=b.shared[:5].copy())),
        BLOCKS + "shared has 5 rows and no shared_rows, must have 16 rows",
    ),
    "own short": (
        tables(lambda b: replace(b, own=b.own[:1].copy())),
        BLOCKS + "own has 1 rows and no own_rows, must have 4 rows",
    ),
    "own wide": (
        tables(lambda b: replace(b, own=np.hstack([b.own, b.own]))),
        BLOCKS + r"own of shape \(4, 2\), must be \(rows, 1\)",
    ),
    "own rows": (
        rowed(own_rows=np.array([0, 1, 2, 4])),
        BLOCKS + "own_rows names rows 0 to 4, own has 4",
    ),
    "negative rows": (
        rowed(shared_rows=np.arange(16) - 1),
        BLOCKS + "shared_rows names rows -1 to 14",
    ),
    "few rows": (rowed(shared_rows=np.arange(5)), BLOCKS + "shared_rows has 5 .* must have 16"),
    "broken rows": (
        rowed(own_rows=np.zeros(4)),
        "predictions: IndexError in states, .* must be of integer",
    ),
    "listed own": (rowed(own=[[0.0]]), BLOCKS + "own has 1 rows and no own_rows, must"),
    "flat own": (rowed(own=np.zeros(4)), BLOCKS + r"own of shape \(4,\), must be \(rows, 1\)"),
    "NaN own": (rowed(own=np.full((4, 1), np.nan)), BLOCKS + "own is not finite"),
    "equal measures": (declared(measures=(SUCCESS, SUCCESS)), "measures: names .* distinct"),
    "no source": (
        declared(measures=(Measure("speed", "speed", source="velocity"),)),
        "measures: speed: info has no 'velocity', it has: places, distance_m,",
    ),
    "many numbers": (
        declared(measures=(Measure("where", "place", source="places"),)),
        "measures: where: info.'places'. must be one number",
    ),
    "nothing to record": (declared(recorded=("speeds",)), "measures: recorded is 'speeds', which"),
    "few roles": (declared(roles=("cart",)), "form: roles .* one for each of the 2 agents"),
    "predicted elsewhere": (
        off_by(1e-3),
        SENSED + r"distance of agent 0 is \S+, predicted \S+, at step 1 of seed 0",
    ),
    "all together elsewhere": (
        off_by(1e-3, together=True),
        "predictions: states_by_group and states differ in distance of agent 0",
    ),
    "several periods": (
        perceiving(per_period),
        SENSED + r"per_period of agent 0 is \S+, predicted \S+, at step 1 of seed 0, at rest",
    ),
    "not common": (perceiving(not_common, 2), SENSED + "not_common of agent . is"),
    "hidden state": (perceiving(stale), "equal seeds: two runs with seed 0 differ"),
    "leaves in a step": (line(step=leaving), "form: SystemExit in leaving, .*: 0"),
    "leaves at the start": (line(reset=leaving), "form: SystemExit in leaving, .*: 0"),
    "no scenario": (lambda: object(), "form: object lacks agents, .*predict"),  # type: ignore[dict-item,return-value]
}


@pytest.mark.parametrize("name", FAULTS)
def test_every_planted_fault_is_caught_in_one_line(name: str) -> None:
    factory, complaint = FAULTS[name]
    with pytest.raises(ScenarioError, match=complaint) as fault:
        check_scenario(factory)
    assert "\n" not in str(fault.value)
    assert len(str(fault.value)) < 200


def test_the_documentation_counts_the_faults() -> None:
    page = Path(__file__).resolve().parents[3] / "docs" / "tutorials" / "scenario.md"
    text = " ".join(page.read_text(encoding="utf-8").split())
    (told,) = re.findall(r"tests hold (\d+) deliberately broken", text)
    assert int(told) == len(FAULTS)


# Where the command line finds them: ``nested-agents check THIS_FILE:fault_late_noise``.
globals().update(
    {f"fault_{name.replace(' ', '_')}": factory for name, (factory, _) in FAULTS.items()}
)


@pytest.mark.parametrize("name", FAULTS)
def test_the_command_catches_every_planted_fault(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", f"{__file__}:fault_{name.replace(' ', '_')}"]) == 1
    line = capsys.readouterr().out
    assert line.startswith("FAULT   fault_")
    assert re.search(FAULTS[name][1], line)
    assert line.count("\n") == 1


@pytest.mark.parametrize("own", [0.5, np.nan])
def test_own_variables_as_if_alone_may_differ_but_must_be_numbers(own: float) -> None:
    factory = rowed(own=np.full((4, 1), own), alone=True)
    if np.isfinite(own):
        assert check_scenario(factory) == tuple(CHECKS)
    else:
        with pytest.raises(ScenarioError, match="own is not finite"):
            check_scenario(factory)


def test_many_joint_actions_are_drawn_and_too_many_left_out() -> None:
    class Reversed(LineUpPrediction):
        def reward_table(self) -> Any:
            return super().reward_table()[::-1]

    class Many(LineUp):
        def predict(self) -> Any:
            return Reversed(super().predict()._places)

    for n, said in ((6, "reward_table: .* after joint action"), (8, "reward_table: ")):
        scenario = Many(LineUpSettings(carts=n))
        scenario.reset(0)
        fault = fault_of_prediction(scenario, np.zeros((1, n), int), np.random.default_rng(0))
        assert re.match(said, fault or "")
    scenario = Many(LineUpSettings(carts=9))
    scenario.reset(0)
    none = fault_of_prediction(scenario, np.zeros((1, 9), int), np.random.default_rng(0))
    assert none is None


def test_too_little_to_check_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^seeds = \[0\]: must hold at least 2$"):
        check_scenario(lambda: LineUp(LineUpSettings()), seeds=(0,))
    with pytest.raises(ValueError, match=r"^episodes = \[\]: must hold at least 1$"):
        check_scenario(lambda: LineUp(LineUpSettings()), episodes=())
    with pytest.raises(ValueError, match=r"^steps = 1: must be at least 2$"):
        check_scenario(lambda: LineUp(LineUpSettings()), steps=1)
