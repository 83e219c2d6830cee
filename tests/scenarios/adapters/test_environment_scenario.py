"""Environments of Gymnasium and PettingZoo as scenarios."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiDiscrete, Text
from gymnasium.utils import EzPickle
from made_up_environments import (
    Ambiguous,
    Blind,
    BlindUnsaid,
    Chosen,
    KeyedApart,
    Lacking,
    Late,
    Leaving,
    Masked,
    MaskedBeside,
    MixedEnd,
    Nameless,
    OldCart,
    OldParallel,
    OldParallelStart,
    OldStartCart,
    Ordering,
    PaidNothing,
    PaidTwice,
    Truncating,
    UndecidedCart,
    Uninvited,
    Unpaid,
    Unseeing,
)
from pettingzoo import ParallelEnv

from nested_agents.core.interface.abilities import Animated
from nested_agents.core.learners import check_prediction
from nested_agents.scenarios.adapters.scenario import from_gymnasium, from_pettingzoo
from nested_agents.scenarios.adapters.settings import GymnasiumSettings, PettingZooSettings
from nested_agents.scenarios.adapters.simulators import SINGLE, EnvironmentStep
from nested_agents.scenarios.checking.checker import CHECKS, check_scenario
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import trials_of

WORLDS = Path(__file__).resolve().parents[3] / "examples" / "worlds"
PENDULUM = {"id": "Pendulum-v1", "angles": {"angle": {"cos": 0, "sin": 1}}}


class Carts(gymnasium.Env[Any, Any], EzPickle):
    """Points on a line, each pushed by a number of the action; unbounded, and made anew if copied.

    Observed are the places, a number that never changes, and the mean.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def __init__(self, carts: int = 2, noise: float = 0.0) -> None:
        EzPickle.__init__(self, carts, noise)
        self.noise = noise
        self.observation_space = Box(-np.inf, np.inf, (carts + 2,), np.float64)
        self.action_space = Box(-1.0, 1.0, (carts,), np.float64)

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.places = self.np_random.uniform(-1, 1, self.action_space.shape[0])
        return self._seen(), {}

    def step(self, action: Any) -> Any:
        self.places = self.places + 0.1 * action + self.noise * self.np_random.normal()
        return self._seen(), -float(abs(self.places).mean()), bool(self.places.max() > 2), False, {}

    def _seen(self) -> Any:
        return np.array([*self.places, 7.0, self.places.mean()])


class Walkers(ParallelEnv[str, Any, Any]):
    """Two players of two and of three actions; the first leaves after a step."""

    metadata = {"render_modes": [], "name": "walkers"}  # noqa: RUF012

    def __init__(self) -> None:
        self.possible_agents = ["left_0", "right_0"]

    def observation_space(self, agent: str) -> Any:
        return Box(-5.0, 5.0, (2,), np.float64)

    def action_space(self, agent: str) -> Any:
        return Discrete(2 if agent == "left_0" else 3)

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        self.agents = self.possible_agents[:]
        self.start = np.random.default_rng(seed).uniform(-1, 1)
        self.done: list[dict[str, int]] = []
        return {agent: np.array([self.start, 0.0]) for agent in self.agents}, {}

    def step(self, actions: dict[str, int]) -> Any:
        self.done.append(dict(actions))
        seen = {a: np.array([self.start, float(action)]) for a, action in actions.items()}
        rewards = {agent: 1.0 if agent == "left_0" else 3.0 for agent in actions}
        ends = {agent: agent == "left_0" for agent in actions}
        self.agents = ["right_0"]
        return seen, rewards, ends, dict.fromkeys(actions, False), {a: {} for a in actions}


def test_numbers_of_an_action_are_agents_and_numbers_of_an_observation_variables() -> None:
    world = from_gymnasium(Carts(), actions=3)
    assert world.agents == ("actuator1", "actuator2")
    assert world.groups == ((0,), (1,))
    assert world.action_set.names == ("-1", "0", "1")
    assert world.action_set.neutral == 1
    # What never changes is left out; ranges are those of random episodes, and the same again.
    assert [v.name for v in world.state_space.variables] == ["o0", "o1", "o3"]
    assert world.state_space.common == ("o0", "o1", "o3")
    again = from_gymnasium(Carts(), actions=3)
    assert world.state_space == again.state_space
    before = world.reset(3)
    step = world.step(np.array([0, 2]))
    assert step.states[0] - before[0] == pytest.approx([-0.1, 0.1, 0.0])
    assert step.reward == pytest.approx(-abs(step.states[0, :2]).mean())


def test_bodies_and_variables_of_each() -> None:
    world = from_gymnasium(
        Carts(4), groups=((0, 1), (2, 3)), variables={"first": (0, 2), "mean": 5},
        ranges={"first": (-2.0, 2.0)}, hold=3,
    )  # fmt: skip
    assert world.agents == ("body1.1", "body1.2", "body2.1", "body2.2")
    assert world.roles == ("body.1", "body.2", "body.1", "body.2")
    assert from_gymnasium(Carts()).roles == ("actuator1", "actuator2")
    assert world.state_space.common == ("mean",)
    first, _ = world.state_space.variables
    assert (first.low, first.high) == (-2.0, 2.0)
    states = world.reset(0)
    assert states[0, 0] == states[1, 0] != states[2, 0] == states[3, 0]
    held = world.step(np.array([4, 4, 4, 4])).states
    assert held - states == pytest.approx(np.full((4, 2), 0.3))


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_copies_predict_what_happens_and_change_nothing(noise: float) -> None:
    findings = check_scenario(
        lambda: from_gymnasium(Carts(2, noise), predictor="copy", actions=3), steps=5
    )
    assert findings.passed == tuple(CHECKS)
    world = from_gymnasium(Carts(2, noise), predictor="copy", actions=3, horizon=2)
    world.reset(1)
    joint = np.array([2, 0])
    prediction = world.predict()
    states, reward = prediction.states(1, joint[None])[0], prediction.rewards(joint[None])[0]
    steps = [world.step(joint) for _ in range(2)]
    assert states == pytest.approx(steps[1].states[1], abs=0)
    assert reward == pytest.approx(np.mean([step.reward for step in steps]), abs=0)


def test_the_pendulum() -> None:
    settings = GymnasiumSettings(**PENDULUM, predictor="copy", success={"angle": (-4.0, 4.0)})
    findings = check_scenario(settings.build, steps=6)
    assert findings.passed == tuple(CHECKS)
    world = settings.build()
    speed, angle = world.state_space.variables
    assert (speed.name, speed.low, speed.high) == ("o2", -8.0, 8.0)
    assert (angle.name, angle.periodic) == ("angle", True)
    env = gymnasium.make("Pendulum-v1")
    seed = int(np.random.SeedSequence(5).generate_state(1)[0])
    cos, sin, speed_0 = env.reset(seed=seed)[0]
    assert world.reset(5)[0] == pytest.approx([speed_0, np.arctan2(sin, cos)])
    step = world.step(np.array([4]))
    assert step.reward == env.step(np.array([2.0], dtype=np.float32))[1]
    assert step.info["succeeded"] is True


def test_a_limit_of_time_truncates_and_the_return_can_be_the_success() -> None:
    settings = GymnasiumSettings(
        id="CartPole-v1", options={"max_episode_steps": 3}, success={"return": 3.0}
    )
    world = settings.build()
    assert world.lacks_prediction
    assert world.predict() is None
    world.reset(0)
    steps = [world.step(np.array([k % 2])) for k in range(3)]
    assert [s.truncated for s in steps] == [False, False, True]
    assert not any(s.terminated for s in steps)
    assert [s.info["succeeded"] for s in steps] == [False, False, True]
    assert settings.warnings() == ()
    assert "returns are compared" in GymnasiumSettings(id="CartPole-v1").warnings()[0]


def test_a_terminal_reward_is_received_once() -> None:
    world = from_gymnasium(Carts())
    world.reset(0)
    steps = [world.step(np.array([4, 4])) for _ in range(40)]
    last = next(step for step in steps if step.terminated)
    assert not last.absorbing


def test_players_of_pettingzoo_are_bodies() -> None:
    world = from_pettingzoo(Walkers(), rewards="own")
    assert world.agents == ("left_0", "right_0")
    assert world.roles == ("left", "right")
    assert len(world.action_set) == 3
    world.reset(0)
    # Who has two actions has the first again in place of the third.
    step = world.step(np.array([2, 2]))
    assert step.states[:, 1].tolist() == [0.0, 2.0]
    assert np.asarray(step.reward).tolist() == [1.0, 3.0]
    assert not step.terminated
    later = world.step(np.array([1, 1]))
    assert np.asarray(later.reward).tolist() == [0.0, 3.0]
    assert later.states[:, 1].tolist() == [0.0, 1.0]
    assert from_pettingzoo(Walkers()).step is not None


def test_a_spec_of_ten_lines_runs() -> None:
    spec = Spec.of(
        {
            "seeds": 1, "episodes": 1, "steps": 3, "evaluation": 1, "preset": "own-value",
            "scenario": {"kind": "gymnasium", "predictor": "copy", **PENDULUM},
        }
    )  # fmt: skip
    (trial,) = trials_of(spec)
    result = run_trial(trial)
    assert [measure.name for measure in result.measures] == ["success", "total_reward"]
    assert all(row.measures["total_reward"] < 0 for row in result.rows)


def test_an_episode_is_drawn_by_playing_it_again(tmp_path: Path) -> None:
    pytest.importorskip("pygame", reason="extra [human]")
    world = GymnasiumSettings(**PENDULUM).build()
    assert isinstance(world, Animated)
    world.reset(4)
    first, seed = world.measure()["joint_action"], world.constants_of_episode()["seed"]
    world.step(np.array([4]))
    actions = np.stack([first, world.measure()["joint_action"]])
    world.animate({"joint_action": actions, "seed": seed}, tmp_path / "episode.gif")
    assert (tmp_path / "episode.gif").stat().st_size > 500
    with pytest.raises(ValueError, match="animation: "):
        world.animate({"joint_action": actions}, tmp_path / "none.gif")


class Odd(Carts):
    """Carts whose spaces are others."""

    def __init__(self, observed: Any = None, done: Any = None) -> None:
        super().__init__()
        self.observed = observed
        self.observation_space = observed or self.observation_space
        self.action_space = done or self.action_space

    def _seen(self) -> Any:
        return self.observed.sample() if self.observed else super()._seen()


class Locked(Carts):
    """Carts that hold what cannot be copied."""

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        self.lock = (part for part in ())
        return super().reset(seed=seed)


class Hidden(Carts):
    """Carts whose noise no copy has."""

    noises = np.random.default_rng(0)

    def step(self, action: Any) -> Any:
        self.places = self.places + self.noises.normal(size=2)
        return super().step(action)


class Broken(Odd):
    """It raises as it starts, where random episodes are to show its ranges."""

    def __init__(self) -> None:
        super().__init__(Box(-np.inf, np.inf, (2,)))

    def reset(self, **keys: Any) -> Any:
        raise TypeError("no state")


class Grown(Odd):
    """It observes more numbers than its space has."""

    def reset(self, **keys: Any) -> Any:
        return np.zeros(3), {}


IMAGE = Box(0, 255, (8, 8, 3), np.uint8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GymnasiumSettings(id="Pendulum-v99").build(), "scenario.id = 'Pendulum-v99'"),
        (lambda: GymnasiumSettings(id="Pendulum-v1", actions=1), "actions = 1"),
        (lambda: GymnasiumSettings(id="CartPole").build(), "'CartPole': .* such as CartPole-v1"),
        (lambda: GymnasiumSettings(id="CartPole-v1", centers={"o0": (1, 0)}).build(), "-v1': var"),
        (lambda: PettingZooSettings(id="no/module").build(), "nested-agents has the extras mpe"),
        (lambda: PettingZooSettings(id="json").build(), "scenario.id = 'json'"),
        (lambda: from_gymnasium(Odd(IMAGE)), r"images of shape \(8, 8, 3\)"),
        (lambda: from_gymnasium(Odd(Text(3))), "observation: Text"),
        (lambda: from_gymnasium(Odd(done=Text(3))), "actions: Text"),
        (lambda: from_gymnasium(Odd(done=Discrete(1))), "actions: agents have 1 each"),
        (lambda: from_gymnasium(Odd(done=Box(-np.inf, 1.0, (2,)))), "wrap it in RescaleAction"),
        (lambda: from_gymnasium(Carts(), variables={"a": 2}), r"set scenario\.ranges\.a"),
        (lambda: from_gymnasium(Carts(), variables={"a": 9}), "a = 9, allowed: a numb"),
        (lambda: from_gymnasium(Carts(), variables={"a": "b"}), "0 to 3 or o0, o1, o2, o3"),
        (lambda: from_gymnasium(Carts(), variables={"a": (1, 1, 1)}), "one for each of 2 bodies"),
        (lambda: from_gymnasium(Carts(), ranges={"b": (0.0, 1.0)}), r"ranges\.b: no such"),
        (lambda: from_gymnasium(Carts(), ranges={"o0": (1.0, 0.0)}), "the lower end first"),
        (lambda: from_gymnasium(Carts(), centers={"b": (0.0, 1.0)}), r"centers\.b: no such"),
        (lambda: from_gymnasium(Carts(), centers={"o0": (1.0, 0.0)}), "centers .* must increase"),
        (lambda: from_gymnasium(Carts(), success={"b": (0.0, 1.0)}), r"success\.b: no such"),
        (lambda: from_gymnasium(Carts(), success={"o0": 3.0}), "o0 must be a range"),
        (lambda: from_gymnasium(Carts(), success={"return": (0, 1)}), "return must be a number"),
        (lambda: from_gymnasium(Carts(), angles={"a": {"cos": 1, "sin": 1}}), "two numbers"),
        (lambda: from_gymnasium(Carts(), angles={"o1": 0}), "another state variable has this"),
        (lambda: from_gymnasium(Grown(Box(0.0, 1.0, (2,)))).reset(0), "at reset: 3 numbers"),
        (lambda: from_gymnasium(Broken()), "cannot be played, TypeError: no state"),
        (lambda: from_gymnasium(Carts(), neutral=5), "neutral = 5, allowed: 0 to 4"),
        (lambda: from_gymnasium(Carts(), groups=((1,), (0,))), r"\[\[1\], \[0\]\], allowed: each"),
        (lambda: from_gymnasium(Locked(), predictor="copy"), "cannot be copied, TypeError"),
        (lambda: from_gymnasium(Hidden(), predictor="copy"), "does something else than the orig"),
    ],
)  # fmt: skip
def test_what_cannot_be_adapted_is_refused_in_one_line(make: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("env", "message"),
    [
        (Blind, "observation of agent_1 at step 4: o1 = nan, allowed: finite numbers"),
        (BlindUnsaid, "observation of agent_1 at step 4: o1 = nan, allowed: finite numbers"),
        (KeyedApart, "scenario.variables is missing: players observe different numbers"),
        (Lacking, "observation of agent_0 at step 2: key 'time' is missing"),
        (Leaving, "cannot be played, SystemExit: 0"),
        (Ordering, r"cannot be played, RuntimeError: \\x1b\[2J"),
        (Late, "observations at reset: 'agent_1' is missing, allowed: agents that are present"),
        (Uninvited, "agents at step 1: 'agent_9' is not in possible_agents"),
        (Unseeing, "observations at step 3: 'agent_1' is missing"),
        (Unpaid, "rewards at step 1: 'agent_1' is missing"),
        (Nameless, "possible_agents is missing or empty, allowed: all agents"),
        (Ambiguous, "agents 1, 1: their names must differ"),
        (Masked, "actions of agent_0: observation has action_mask, .* wrap yours so that an"),
        (MaskedBeside, "actions of agent_0: info has action_mask, .* wrap yours so that an"),
        (PaidTwice, r"reward of agent_0 at step 1 = array.*, allowed: one finite number"),
        (PaidNothing, "reward of agent_0 at step 3 = nan, allowed: one finite number"),
        (OldParallel, "step returns 4 values, allowed: 5, .*Gymnasium before 0.26"),
        (OldParallelStart, "reset must return observation and info .Gymnasium before 0.26"),
        (OldCart, "step returns 4 values, allowed: 5, .*Gymnasium before 0.26"),
        (OldStartCart, "reset must return observation and info .Gymnasium before 0.26"),
        (UndecidedCart, "terminated at step 1 = None, allowed: true or false"),
        (Chosen, r"observation of agent_0 at step 3: side: \[-1\], allowed: Discrete"),
        (Truncating, r"observation of agent_0 at reset: .*, allowed: Box\(-1, 1"),
    ],
)
def test_what_an_environment_does_wrong_is_said_when_it_is_built(env: Any, message: str) -> None:
    adapt = from_gymnasium if issubclass(env, gymnasium.Env) else from_pettingzoo
    with pytest.raises(ValueError, match=message) as refused:
        adapt(env)
    assert "\n" not in str(refused.value)


def test_steps_that_are_played_when_a_world_is_built_change_no_episode() -> None:
    env = Carts(2, noise=0.1)
    played = []
    for _ in range(2):
        world = from_gymnasium(env)
        played.append([world.reset(4), *(world.step(np.array([1, 2])).states for _ in range(3))])
    assert np.array_equal(*played)
    plain = Carts(2, noise=0.1)
    plain.reset(seed=int(np.random.SeedSequence(4).generate_state(1)[0]))
    assert played[0][1][0, :2] == pytest.approx(plain.step(np.array([-0.5, 0.0]))[0][:2])


def test_a_mixed_ending_truncates_once_each_has_ended() -> None:
    world = from_pettingzoo(MixedEnd)
    world.reset(0)
    steps = [world.step(np.array([1, 1])) for _ in range(5)]
    assert [step.truncated for step in steps] == [False] * 4 + [True]
    assert not any(step.terminated for step in steps)


def test_a_termination_may_be_the_success() -> None:
    world = from_gymnasium(Carts(), success="terminated")
    world.reset(0)
    steps = [world.step(np.array([4, 4])) for _ in range(40)]
    assert [step.info["succeeded"] for step in steps] == [step.terminated for step in steps]
    assert any(step.terminated for step in steps)
    world.reset(0)
    assert world.measure()["succeeded"] is False


@pytest.mark.parametrize("path", sorted(WORLDS.glob("*.toml")), ids=lambda path: path.stem)
def test_specs_of_worlds_of_others(path: Path) -> None:
    spec = Spec.load(path)
    own = f"{path.stem}.py:{path.stem}"  # an environment in a file beside its spec
    kinds = {c.settings.scenario.kind for c in spec.conditions()}
    assert kinds <= {"gymnasium", "pettingzoo", own}


def test_tables_and_discrete_observations() -> None:
    table = Dict({"goal": Box(-1.0, 1.0, (2,)), "odds": MultiDiscrete([2, 3])})
    world = from_gymnasium(Odd(table), variables={"x": 0, "y": "goal1", "each": ("goal0", 1)})
    assert [v.name for v in world.state_space.variables] == ["x", "y", "each"]
    observed = {"goal": np.array([0.3, -0.4]), "odds": np.array([0, 1])}
    states = world.states_of(EnvironmentStep({SINGLE: observed}, {}, False, False, 0))
    assert states == pytest.approx(np.array([[0.3, -0.4, 0.3], [0.3, -0.4, -0.4]]))
    named = Dict({"height": Box(0.0, 1.0, (1,)), "side": Discrete(2)})
    names = [v.name for v in from_gymnasium(Odd(named)).state_space.variables]
    assert names == ["height", "side0", "side1"]
    (variable,) = from_gymnasium(Odd(Discrete(3))).state_space.variables
    assert variable.centers == (0.0, 1.0, 2.0)


def test_centers_of_membership_functions_are_given_by_name() -> None:
    fine = (-1.0, -0.1, 0.0, 0.1, 1.0)
    world = from_gymnasium(
        Odd(Box(-1.0, 1.0, (2,))), angles={"turn": 1}, centers={"o0": fine, "turn": (-0.1, 0.1)}
    )
    assert [variable.centers for variable in world.state_space.variables] == [fine, (-0.1, 0.1)]


def test_check_and_run_say_it_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "spec.toml"
    path.write_text('scenario = { kind = "gymnasium", id = "CartPole-v1" }\n')
    for command in (["check", str(path)], ["run", str(path), "--out", str(tmp_path / "out")]):
        assert main(command) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "learner.kind = 'batch-td': needs predicted states" in line
        assert "scenario.predictor = 'none' gives none ('copy' does); use" in line
    assert not (tmp_path / "out").exists()


def test_what_presets_decide_by_is_learned_where_the_scenario_says_so() -> None:
    table = {"scenario": {**PENDULUM, "kind": "gymnasium", "predictor": "learned"}}
    kinds = {
        preset: Spec.of({**table, "preset": preset}).conditions()[0].settings.learner
        for preset in ("default", "own-value", "fitted-q", "planner")
    }
    learned = [learner.predictor.kind == "learned" for learner in kinds.values()]
    assert learned == [True, True, False, False]
    own = {"learner": {"predictor": {"kind": "static"}}}
    (condition,) = Spec.of({**table, **own}).conditions()
    assert condition.settings.learner.predictor.kind == "static"
    with pytest.raises(ValueError, match=r"scenario\.predictor = 'learned' gives none"):
        check_prediction(kinds["planner"], GymnasiumSettings(**table["scenario"]).build())


@pytest.mark.parametrize("name", ["mpe2/simple_spread_v3", "mpe2/simple_speaker_listener_v4"])
def test_particles(name: str) -> None:
    pytest.importorskip("mpe2", reason="extra [mpe]")
    variables = {"x": 0, "y": 1}
    settings = PettingZooSettings(id=name, predictor="copy", variables=variables)
    unchecked = set(CHECKS) - set(check_scenario(settings.build, steps=5).passed)
    assert unchecked == set()


def test_mujoco() -> None:
    pytest.importorskip("mujoco", reason="extra [mujoco]")
    settings = GymnasiumSettings(id="Swimmer-v5", predictor="copy", actions=3, horizon=2)
    assert check_scenario(settings.build, steps=4).passed == tuple(CHECKS)
