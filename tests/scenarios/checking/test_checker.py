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

from nested_agents import Situation, state_variable
from nested_agents.core.agents.joint import join_agents
from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.states.situations import Robot
from nested_agents.scenarios.box_pushing.world.settings import (
    WheelFailure,
)
from nested_agents.scenarios.checking.checker import (
    CHECKS,
    ScenarioError,
    check_scenario,
)
from nested_agents.scenarios.checking.episodes import CheckPlan
from nested_agents.scenarios.checking.sensing import faults_of_sensing, predicted_steps
from nested_agents.scenarios.line_up import (
    DISTANCE,
    LEAD,
    LineUp,
    LineUpPrediction,
    LineUpSettings,
    advance,
)
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
    report = check_scenario(factory, steps=20)
    assert {*report.passed, *report.skipped} - {"roles"} == set(CHECKS)


def test_a_made_up_scenario_passes(line_world: Any) -> None:
    report = check_scenario(lambda: line_world(2, 2))
    assert {*report.passed, *report.skipped} - {"roles"} == set(CHECKS)


class Bare(Scenario):
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


class Unmeasured(Bare):
    """Names what it records, and measures nothing."""

    recorded = ("places",)


class BarePrediction(Prediction):
    def __init__(self, places: Any) -> None:
        self.places = places

    def states(self, agent: int, joint_actions: Any) -> Any:
        return self.places[agent] + 0.1 * joint_actions[:, agent, None]


def test_what_a_scenario_need_not_have_is_not_asked_for() -> None:
    report = check_scenario(Bare)
    assert set(CHECKS) - set(report.passed) == {"sensed and predicted"} == {*report.skipped}
    assert str(report).startswith("passed  form, measures, ")
    assert "\nnot checked  sensed and predicted: " in str(report)


def test_the_report_hold_what_was_met_beside_what_is_said() -> None:
    distance, lead, reward = check_scenario(LineUpSettings().build).variables
    assert distance[:4] == ("distance", "m", -1.0, 1.0)
    assert distance.min < -1 < 1 < distance.max
    assert max(distance.error, lead.error, reward.error) < 1e-12 < 0.02 < lead.persistence
    assert np.isnan(reward.low)
    (place, paid) = check_scenario(Bare).variables
    assert place.persistence == pytest.approx(
        np.sqrt(np.mean(np.square([0, 1, 2, 3]))) / 10, rel=0.2
    )
    assert np.isnan(paid.error)


def test_predictions_are_held_against_the_time_that_they_look_ahead() -> None:
    """Three steps of a cart whose command is kept."""

    class Ahead(LineUp):
        horizon = 3

        def predict(self) -> Any:
            every = np.tile(np.arange(4)[:, None], len(self.agents))
            commands, places, speeds = self._commanded(every), self._places, self._speeds
            for _ in range(self.horizon):
                places, speeds = advance(places, speeds, commands)
            return LineUpPrediction(places.T.copy())

        def with_exact_prediction(self) -> None:
            return None

    distance, lead, _ = check_scenario(lambda: Ahead(LineUpSettings()), steps=12).variables
    assert max(distance.error, lead.error) < 1e-12 < 0.05 < distance.persistence


def test_a_variable_with_a_hidden_state_is_sensed_otherwise_than_predicted() -> None:
    scenario: Any = perceiving(stale)()
    exact = scenario.with_exact_prediction()
    actions = CheckPlan(perceiving(stale), 5, (0, 1), (0,)).actions(scenario, 0)
    steps = predicted_steps(exact, 0, 0, actions)
    fault = next(faults_of_sensing(exact, steps), None)
    assert re.match(r"stale of agent \d is \d, predicted \d, at step 1", fault or "")


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
    angle = replace(LEAD, low=-0.01, high=0.01, centers=(), periodic=True)
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
def per_period(situation: Situation, robot: Robot) -> Any:
    """Mean something else where several periods are looked ahead."""
    return situation.distance / situation.periods


times = count()


@state_variable("1", 0.0, 1000.0)
def stale(situation: Situation, robot: Robot) -> Any:
    """Depend on how often it was asked for."""
    return np.full(np.shape(situation.distance), float(next(times) % 7))


@state_variable("m", 0.0, 0.5, common=True)
def not_common(situation: Situation, robot: Robot) -> Any:
    """Differ between robots, unlike what is said of it."""
    return np.minimum(robot.gap, 0.5)


def perceiving(variable: StateVariable, robots: int = 1) -> Callable[[], Scenario]:
    return BoxPushingSettings(robots=robots, state_space=("gap", variable)).build  # type: ignore[arg-type]


def space(*variables: Variable, **claims: Any) -> Callable[[], Scenario]:
    """Return a factory of line-ups that claim something else of their variables."""
    return declared(state_space=StateSpace("line-up", variables or (DISTANCE, LEAD), **claims))


class Plain(Prediction):
    """The states of a line-up's prediction, and nothing else."""

    def __init__(self, scenario: Any, change: Callable[..., Any] | None = None) -> None:
        self.of, self.change = LineUp.predict(scenario), change

    def states(self, agent: int, joint_actions: Any) -> Any:
        if self.change is None:
            return self.of.states(agent, joint_actions)
        return self.change(self.of, agent, joint_actions)


def inexact(change: Callable[..., Any] | None = None, **changes: Any) -> Callable[[], Scenario]:
    """Return a factory of line-ups that cannot predict exactly, their predictions changed."""
    changes = {"with_exact_prediction": lambda self: None, "n_own": 1, "common": ()} | changes
    own, common = changes.pop("n_own"), changes.pop("common")

    def changed(self: Any, *args: Any) -> None:
        LineUp.__init__(self, LineUpSettings())
        self.state_space = StateSpace("line-up", (DISTANCE, LEAD), own, common)
        self.groups = changes.get("bodies", self.groups)

    return line(**{"__init__": changed, "predict": lambda self: Plain(self, change)} | changes)


def level(self: Any) -> Any:
    """Perceive the mean place in place of the lead."""
    return np.stack([self._places, np.full(2, self._places.mean())], axis=1)


def uneven(prediction: Any, agent: int, joint_actions: Any) -> Any:
    """Predict the mean place, but of one agent something else."""
    places = prediction._after(joint_actions)
    return np.stack([places[:, agent], places.mean(axis=1) + agent], axis=1)


def altering(prediction: Any, agent: int, joint_actions: Any) -> Any:
    states = prediction.states(agent, joint_actions)
    joint_actions[:] = 0
    return states


def crowded(prediction: Any, agent: int, joint_actions: Any) -> Any:
    """Let one joint action's prediction depend on the others predicted with it."""
    states = prediction.states(agent, joint_actions)
    return states - states.mean(axis=0)


buffers = np.zeros((40, 2))


def reusing(prediction: Any, agent: int, joint_actions: Any) -> Any:
    """Return the same array for every agent."""
    into = buffers[: len(joint_actions)]
    into[:] = prediction.states(agent, joint_actions)
    return into


def guessing(prediction: Any, agent: int, joint_actions: Any) -> Any:
    return prediction.states(agent, joint_actions) + entropy.random()


def backwards(self: Any, joint_action: Any) -> Any:
    """Carry out the actions in another order than they are predicted in."""
    return LineUp.step(self, joint_action[::-1])


def shifted(self: Any, joint_action: Any) -> Any:
    return LineUp.step(self, (joint_action + 1) % 4)


def stepping(**changes: Callable[[Any], Any]) -> Callable[[], Scenario]:
    """Return a factory of line-ups whose transitions have other fields."""

    def changed(self: Any, joint_action: Any) -> Any:
        transition = LineUp.step(self, joint_action)
        return replace(transition, **{k: change(transition) for k, change in changes.items()})

    return line(step=changed)


def leaving(self: Any, *args: Any) -> Any:
    sys.exit(0)


def late_measure(self: Any) -> Any:
    """Tell between steps what was so before the last one."""
    return getattr(self, "before", None) or LineUp.measure(self)


def late_step(self: Any, joint_action: Any) -> Any:
    self.before = None
    before = LineUp.measure(self)
    transition = replace(LineUp.step(self, joint_action), info=LineUp.measure(self))
    self.before = before
    return transition


def late_reset(self: Any, seed: Any, episode: int = 0) -> Any:
    self.before = None
    return LineUp.reset(self, seed, episode)


def looking_moves(self: Any) -> Any:
    self._speeds = self._speeds + 1e-9
    return LineUp.measure(self)


def drawing(self: Any) -> Any:
    np.random.random()  # noqa: NPY002
    return LineUp.predict(self)


def counting_resets(self: Any, seed: Any, episode: int = 0) -> Any:
    LineUp.reset(self, seed, episode)
    self.resets = getattr(self, "resets", 0) + 1
    self._places = self._places + 0.01 * self.resets
    return self._states()


def wrong_way(prediction: Any, agent: int, joint_actions: Any) -> Any:
    return -prediction.states(agent, joint_actions)


def in_millimeters(prediction: Any, agent: int, joint_actions: Any) -> Any:
    return 1000 * prediction.states(agent, joint_actions)


def nothing_moves(self: Any) -> Any:
    """Predict that all stays as it is."""
    return LineUpPrediction(np.repeat(self._places[:, None], 4, axis=1))


def millimeters(self: Any) -> Any:
    return 1000 * np.stack([self._places, self._places - self._places.mean()], axis=1)


def predicting(**members: Any) -> Callable[[], Scenario]:
    """Return a factory of line-ups whose predictions have other methods."""

    def predict(self: Any) -> Any:
        return type("Changed", (LineUpPrediction,), members)(LineUp.predict(self)._places)

    return line(predict=predict)


def far_reward(self: Any, joint_actions: Any) -> Any:
    return 10 * LineUpPrediction.rewards(self, joint_actions)


def opposite_reward(self: Any, joint_actions: Any) -> Any:
    return -LineUpPrediction.rewards(self, joint_actions)


SENSED = "sensed and predicted: "

FAULTS: dict[str, tuple[Callable[[], Scenario], str]] = {
    "late noise": (line(step=late_noise), r"equal seeds: two runs with seed 0 differ at step 2"),
    "ignored seed": (line(reset=same_start), "different seeds: seeds 0, 1 give one and the same"),
    "shared state": (
        line(step=shared_state, reset=shared_reset),
        "two instances: an instance with seed . played in turns with another differs at step",
    ),
    "state left over": (line(reset=forgets_to_reset), "equal seeds: seed . after another episode"),
    "NaN state": (line(step=nan_at(4, "states")), "values: states is not finite at step 4"),
    "NaN reward": (line(step=nan_at(2, "reward")), "values: reward is not .* step 2"),
    "infinite info": (line(step=nan_at(1, "info")), "values: info.deep.x is not finite"),
    "prediction moves": (line(predict=predict_and_move), "predicting: an episode in which"),
    "NaN prediction": (line(predict=no_prediction), "predictions: predicted states of agent 0"),
    "global numbers": (line(reset=global_numbers), "the global state of random and numpy.random"),
    "spawns": (line(reset=spawning), "returned arrays: reset spawns"),
    "one buffer": (line(_states=one_buffer), "returned arrays: states at the start: .* changed"),
    "action changed": (line(step=greedy_hands), "step changes the joint action"),
    "period": (line(__init__=angle_out_of_range), "values: lead leaves .* at the start"),
    "shape": (line(_states=short_states), r"form: states of shape \(2, 1\) at the start"),
    "three rewards": (line(step=lengthy_reward), r"form: reward of shape \(3,\)"),
    "end": (line(step=uncertain_end), "form: terminated and truncated must be bool"),
    "twins": (line(__init__=twins), "form: agents .*, of different names"),
    "groups": (line(__init__=crossed), "form: groups .* must hold the 2 agents once each"),
    "raises": (line(step=raising), r"form: KeyError in raising, test_checker.py:\d+: .two.*lines"),
    "tuple": (line(step=a_tuple), r"form: ValueError in .*: step = .*, allowed: a Transition"),
    "all alike": (
        predicting(alike=np.zeros((2, 4), dtype=int)),
        r"predictions: distance of agent . differs after joint actions \[.*\] and \[.*\], which",
    ),
    "alike of one": (
        predicting(alike=np.arange(4)[None]),
        r"predictions: alike of shape \(1, 4\), must be \(2, 4\)",
    ),
    "alike a later one": (
        predicting(alike=np.array([[0, 1, 3, 3]] * 2)),
        "predictions: alike must hold the first equivalent robot-action index",
    ),
    "equal measures": (declared(measures=(SUCCESS, SUCCESS)), "measures: names .* distinct"),
    "no source": (
        declared(measures=(Measure("speed", "speed", source="velocity"),)),
        "measures: speed: info has no 'velocity' at step 1, has places, distance_m,",
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
    "not common": (
        perceiving(not_common, 2),
        "values: not_common, said to be common, is .* of agent 2 and .* of agent 0",
    ),
    "lead not common": (
        space(n_own=1, common=("lead",)),
        "values: lead, said to be common, is .* of agent 1 and .* of agent 0 at the",
    ),
    "lead not of a group": (
        declared(groups=((0, 1),)),
        "values: lead, said to be shared by a group, is",
    ),
    "predicted not common": (
        inexact(uneven, _states=level, common=("lead",)),
        "predictions: lead, said to be common, is .* of agent 1 and .* of agent 0",
    ),
    "predicted not of a group": (
        inexact(uneven, _states=level, bodies=((0, 1),)),
        "predictions: lead, said to be shared by a group, is",
    ),
    "not own": (
        inexact(n_own=2),
        "predictions: lead of agent 0 changes with the actions of others, n_own = 2 .* lower n_own",
    ),
    "own of another": (
        inexact(lambda p, i, a: p.states(i, a[:, ::-1]), step=backwards),
        "predictions: distance of agent 0 changes with the actions of others, n_own = 1",
    ),
    "another order": (line(step=backwards), SENSED),
    "another action": (line(step=shifted), SENSED),
    "nothing moves": (line(predict=nothing_moves), SENSED + "distance of agent"),
    "input changed": (inexact(altering), "predictions: the joint actions that .* are changed"),
    "depends on company": (
        inexact(crowded),
        "predictions: states of agent 0 after a joint action depend on those predicted with it",
    ),
    "one array for all": (inexact(reusing), "predictions: "),
    "random prediction": (inexact(guessing), "predictions: states of agent 0"),
    "transposed": (
        line(_states=lambda self: np.zeros((2, 3))),
        r"form: states of shape \(2, 3\) at the start, must be numbers of \(2, 2\)",
    ),
    "no states": (line(_states=lambda self: None), "form: states of shape .. at the start"),
    "no reward": (
        stepping(reward=lambda t: None),
        r"form: reward of shape \(\) at step 1, must be",
    ),
    "text for reward": (
        stepping(reward=lambda t: "1"),
        r"form: reward of shape \(\) at step 1, must be numbers",
    ),
    "random reward": (
        stepping(reward=lambda t: t.reward + entropy.random()),
        "equal seeds: two runs with seed 0 differ at step 1: reward",
    ),
    "random info": (
        stepping(info=lambda t: {**t.info, "luck": entropy.random()}),
        "equal seeds: two runs with seed 0 differ at step 1: info.luck",
    ),
    "random end": (stepping(terminated=lambda t: entropy.random() < 0.3), "equal seeds: .* differ"),
    "end of NumPy": (
        stepping(terminated=lambda t: np.bool_(t.terminated)),
        "form: terminated and truncated must be bool",
    ),
    "flat twists": (stepping(twists=lambda t: np.zeros(3)), r"form: twists of shape \(3,\)"),
    "few twists": (stepping(twists=lambda t: np.zeros((1, 3))), r"form: twists of shape \(1, 3\)"),
    "leaves in a step": (line(step=leaving), "form: SystemExit in leaving, .*: 0"),
    "leaves at the start": (line(reset=leaving), "form: SystemExit in leaving, .*: 0"),
    "recorder lies": (
        line(measure=late_measure, step=late_step, reset=late_reset),
        "measures: recorded is 'places', of which info and measure differ at step",
    ),
    "measuring moves": (
        line(measure=looking_moves),
        "predicting: an episode in which predictions are asked for differs",
    ),
    "predicts by global numbers": (line(predict=drawing), "the global state of numpy.random is"),
    "counts resets": (line(reset=counting_resets), "equal seeds: seed . after another episode"),
    "bounds": (space(DISTANCE, replace(LEAD, bounds=(-0.1, 0.1)), n_own=1), "values: lead leaves"),
    "recorded without measure": (Unmeasured, "form: Unmeasured has recorded, and lacks measure"),
    "a group missing": (declared(groups=((0,),)), "form: groups .* must hold the 2 agents once"),
    "rewards of each": (
        predicting(rewards=lambda self, actions: np.zeros((len(actions), 2))),
        r"predictions: predicted rewards of shape \(12, 2\), must be \(12,\)",
    ),
    "agents swapped": (
        predicting(
            states_by_group=lambda self, actions: tuple(
                part[::-1] for part in LineUpPrediction.states_by_group(self, actions)
            )
        ),
        "predictions: states_by_group and states differ in distance of agent 0",
    ),
    "rewards of opposite sign": (
        predicting(rewards=opposite_reward),
        r"predictions: predicted and received rewards have the correlation -\d\.\d\d over 48 steps",
    ),
    "hidden state": (perceiving(stale), "equal seeds: .*seed 0 .*differ"),
    "plain prediction": (
        line(predict=lambda self: object()),
        "form: predict returns object, must inherit Prediction",
    ),
    "no scenario": (lambda: object(), "form: .*object must inherit nested_agents.Scenario"),  # type: ignore[dict-item,return-value]
}


WARNED: dict[str, tuple[Callable[[], Scenario], str]] = {
    "several periods": (perceiving(per_period), "per_period is predicted no better than by"),
    "predicted the wrong way": (inexact(wrong_way), "distance is predicted no better than by"),
    "predicted in millimeters": (inexact(in_millimeters), "lead is predicted no better than"),
    "predicted as it is": (
        inexact(predict=nothing_moves),
        "distance is predicted no better than by persistence",
    ),
    "variables in millimeters": (
        inexact(lambda p, i, a: 1000 * p.states(i, a), _states=millimeters),
        "distance exceeds its range by more than 10 times its width",
    ),
    "rewards of something else": (
        predicting(rewards=far_reward, tables=lambda self: None),
        "reward is predicted no better than",
    ),
}
"""What may be sound, and is warned of."""


def later(since: int, change: Callable[..., Any]) -> Callable[[], Scenario]:
    """Return a factory of line-ups that take their steps otherwise from a step of episodes on."""

    def reset(self: Any, seed: Any, episode: int = 0) -> Any:
        self.count = 0
        return LineUp.reset(self, seed, episode)

    def step(self: Any, joint_action: Any) -> Any:
        self.count += 1
        return (change if self.count >= since else LineUp.step)(self, joint_action)

    return line(step=step, reset=reset)


def odd_world(self: Any, seed: Any, episode: int = 0) -> Any:
    """Put the carts far away in one world of many."""
    states = LineUp.reset(self, seed, episode)
    return states + 100 * (getattr(seed, "entropy", 0) == 7)


def paying_the_opposite(self: Any, joint_action: Any) -> Any:
    transition = LineUp.step(self, joint_action)
    return replace(transition, reward=-transition.reward)


def without_info(self: Any, joint_action: Any) -> Any:
    return replace(LineUp.step(self, joint_action), info={})


BLIND: dict[str, Callable[[], Scenario]] = {
    "what is solved": stepping(terminated=lambda t: bool(np.abs(t.states[:, 0]).min() > 2)),
    "what is paid": inexact(step=paying_the_opposite),
    "a unit": declared(state_space=StateSpace("line-up", (replace(DISTANCE, unit="kg"), LEAD), 1)),
    "roles": stepping(reward=lambda t: t.reward * np.array([1.0, -1.0])),
    "after the steps played": later(50, backwards),
    "in other worlds": line(reset=odd_world),
    "a measurement missing later": later(9, without_info),
    "rewards and company": predicting(
        rewards=lambda self, actions: (
            LineUpPrediction.rewards(self, actions) + 1e-3 * (len(actions) - 1)
        ),
    ),
    "predictions a little off": inexact(lambda p, i, a: p.states(i, a) + 1e-3),
    "after": predicting(after=lambda self, joint_action: self),
    "partners": line(partners=lambda self: (0, 0)),
    "animate": line(
        animate=lambda self, recording, path: None, constants_of_episode=lambda self: {}
    ),
}
"""What is wrong and not noticed."""


@pytest.mark.parametrize("name", FAULTS)
def test_every_planted_fault_is_caught_in_one_line(name: str) -> None:
    factory, complaint = FAULTS[name]
    with pytest.raises(ScenarioError, match=complaint) as fault:
        check_scenario(factory, steps=12)
    assert "\n" not in str(fault.value)
    assert len(str(fault.value)) < 200


@pytest.mark.parametrize("name", WARNED)
def test_what_looks_wrong_is_warned_of(name: str) -> None:
    factory, warning = WARNED[name]
    assert any(line.startswith(warning) for line in check_scenario(factory, steps=12).warnings())


@pytest.mark.parametrize("name", BLIND)
def test_what_the_documentation_calls_blind_is_not_noticed(name: str) -> None:
    assert not [*check_scenario(BLIND[name], steps=12).warnings()]


@pytest.mark.parametrize("heads", [0.5, 0.9])
def test_a_world_may_have_few_starts(heads: float) -> None:
    """Only a coin differs between seeds."""

    class Coin(Bare):
        def reset(self, seed: Any, episode: int = 0) -> Any:
            side = float(np.random.default_rng(seed).random() < heads)
            self.places = np.full((2, 1), side)
            return self.places

    assert {check_scenario(Coin, seeds=(k, k + 1)).passed for k in range(4)}


def test_what_could_not_be_checked_is_told_with_the_reason() -> None:
    unchecked = check_scenario(inexact(), steps=6).skipped
    assert unchecked["sensed and predicted"].startswith("without with_exact_prediction")
    assert list(unchecked) == ["roles", "sensed and predicted"]


def test_the_documentation_counts_the_faults() -> None:
    page = Path(__file__).resolve().parents[3] / "docs" / "tutorials" / "scenario.md"
    text = " ".join(page.read_text(encoding="utf-8").split())
    counts = re.findall(
        r"inject (\d+) faults: the checker finds (\d+), warns of (\d+), and misses (\d+)",
        text,
    )
    planted = len(FAULTS), len(WARNED), len(BLIND)
    assert counts == [tuple(map(str, (sum(planted), *planted)))]
    assert sum(planted) >= 60


# Where the command line finds them: ``nested-agents check THIS_FILE:fault_late_noise``.
globals().update(
    {f"fault_{name.replace(' ', '_')}": factory for name, (factory, _) in FAULTS.items()}
)


@pytest.mark.parametrize("name", ["late noise", "lead not common", "not own", "leaves in a step"])
def test_the_command_catches_planted_faults(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", f"{__file__}:fault_{name.replace(' ', '_')}"]) == 1
    line = capsys.readouterr().out
    assert line.startswith("FAULT   fault_")
    assert re.search(FAULTS[name][1], line)
    assert line.count("\n") == 1


def test_too_little_to_check_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^seeds = \[0\]: must hold at least 2$"):
        check_scenario(lambda: LineUp(LineUpSettings()), seeds=(0,))
    with pytest.raises(ValueError, match=r"^episodes = \[\]: must hold at least 1$"):
        check_scenario(lambda: LineUp(LineUpSettings()), episodes=())
    with pytest.raises(ValueError, match=r"^steps = 1: must be at least 2$"):
        check_scenario(lambda: LineUp(LineUpSettings()), steps=1)
