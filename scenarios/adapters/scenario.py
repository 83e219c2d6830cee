"""Gymnasium and PettingZoo environments as scenarios.

Each number of an action is an agent that chooses from a finite set of levels. State variables are
numbers of the observation. The reward of a terminal state is received once. An episode is recorded
as its seed and joint actions, from which it is replayed to be drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from copy import copy
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...core.interface.measures import NO_SUCCESS, SUCCESS, Measure
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import StateSpace
from ...core.numerics import FloatArray, IntArray
from ...core.plugins.sources import format_error, message
from ..library_types import Environment
from ..movies import film, save_picture
from .actions import ActionMap
from .copies import Copies, copy_simulator, find_copy_fault
from .loading import Maker, find_maker
from .observations import StateReader
from .settings import EnvironmentSettings, GymnasiumSettings, PettingZooSettings
from .simulators import EnvironmentStep, Simulator, make_simulator

TRIAL_STEPS = 8
"""Steps played when a scenario is built, so that faults are reported before anything runs."""
EXPLORED_EPISODES = 10
"""Random episodes that determine unknown ranges."""
EXPLORED_STEPS = 200
"""Maximum number of steps of a random episode."""
HOLD_PROBABILITY = 0.7
"""Probability that a random action is repeated."""
DEFAULT_FPS = 20.0
"""Frame rate of environments that declare none [1/s]."""
SUCCEEDED = Measure(SUCCESS.name, SUCCESS.title, source="succeeded", better="higher", is_rate=True)
REWARD = Measure("total_reward", "total reward", "1", "env_reward", "sum", "higher")


class EnvironmentScenario(Scenario):
    """A Gymnasium or PettingZoo environment as a scenario.

    Parameters
    ----------
    settings
        See `EnvironmentSettings`.
    make
        Makes the simulator. By default, the environment that the settings name.

    Raises
    ------
    ValueError
        If the settings do not fit the environment, or the environment is not supported.

    Examples
    --------
    >>> scenario = GymnasiumSettings(id="CartPole-v1", predictor="copy").build()
    >>> scenario.agents, [variable.name for variable in scenario.state_space.variables]
    (('actuator1',), ['o0', 'o1', 'o2', 'o3'])
    >>> _ = scenario.reset(0)
    >>> predicted = scenario.predict().states(0, np.array([[0], [1]]))
    >>> bool((predicted[1] == scenario.step(np.array([1])).states[0]).all())
    True
    """

    recorded = ("joint_action",)

    def __init__(self, settings: EnvironmentSettings, make: Maker | None = None) -> None:
        self._make = find_maker(settings) if make is None else make
        self._actions, self._reader = _inspect(settings, self._make)
        self.settings = settings
        self.measures = (SUCCEEDED if settings.success else NO_SUCCESS, REWARD)
        self._simulator = self._make(settings, None)
        self.agents = self._actions.names
        self.roles = self._actions.roles
        self.groups = self._actions.groups
        self.action_set = self._actions.action_set
        self._body = np.repeat(np.arange(len(self.groups)), [len(group) for group in self.groups])
        self.state_space = StateSpace(
            "observed", self._reader.variables, common=self._reader.common
        )
        self.horizon = settings.horizon
        self._start(0)
        self._states: FloatArray = np.zeros((len(self.agents), self.state_space.n_variables))

    def _start(self, seed: int) -> None:
        self._seed = seed
        self._return = 0.0
        self._terminated = False
        self._joint_action: IntArray = np.full(len(self.agents), self.action_set.neutral)

    @property
    def lacks_prediction(self) -> str:
        """Reason why there is no prediction; empty if copies of the simulator predict."""
        predictor = self.settings.predictor
        missing = f"scenario.predictor = {predictor!r} gives none ('copy' does)"
        return "" if predictor == "copy" else missing

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Start an episode and return the states ``(n, d)``."""
        sequence = np.random.SeedSequence(seed) if isinstance(seed, int) else seed
        self._start(int(sequence.generate_state(1)[0]))
        self._states = self.states_of(self._simulator.reset(self._seed))
        return self._states

    def step(self, joint_action: IntArray) -> Transition:
        """Execute a joint action ``(n,)`` for the number of steps that it is held."""
        result = self.play(self._simulator, joint_action)
        self._joint_action = np.array(joint_action)
        self._states = self.states_of(result)
        self._terminated = result.terminated
        rewards = np.array(list(result.rewards.values()))
        mean = float(rewards.mean())
        self._return += mean
        is_joint = self.settings.rewards == "joint" or len(rewards) == 1
        return Transition(
            states=self._states,
            reward=mean if is_joint else rewards[self._body],
            terminated=result.terminated,
            truncated=result.truncated,
            info={**self.measure(), "env_reward": mean},
            absorbing=False,
        )

    def measure(self) -> Mapping[str, object]:
        """Return the last joint action, and whether the present state is a success."""
        return {"joint_action": self._joint_action, "succeeded": self._has_succeeded()}

    def constants_of_episode(self) -> Mapping[str, object]:
        """Return the seed of the environment."""
        return {"seed": self._seed}

    def play(self, simulator: Simulator, joint_action: IntArray) -> EnvironmentStep:
        """Hold a joint action in a simulator; return the last step with the sums of rewards."""
        actions = self._actions.environment_actions(joint_action)
        totals = dict.fromkeys(simulator.players, 0.0)
        for _ in range(self.settings.hold):
            result = simulator.step(actions)
            for player, reward in result.rewards.items():
                totals[player] += reward
            if result.is_over:
                break
        return result._replace(rewards=totals)

    def states_of(self, result: EnvironmentStep) -> FloatArray:
        """Return the states ``(n, d)`` of all agents."""
        return self._reader.states(result)[self._body]

    def predict(self) -> CopyPrediction | None:
        """Return a prediction by copies of the simulator, if the settings ask for one."""
        return None if self.lacks_prediction else CopyPrediction(self, self._simulator)

    def with_exact_prediction(self) -> EnvironmentScenario | None:
        """Return the scenario with predictions of one decision, if copies predict."""
        if self.lacks_prediction:
            return None
        exact = copy(self)
        exact.horizon = 1
        return exact

    def _has_succeeded(self) -> bool:
        success = self.settings.success
        if not isinstance(success, dict):
            return self._terminated
        names = [variable.name for variable in self.state_space.variables]
        for name, ends in success.items():
            if isinstance(ends, tuple):
                values = self._states[:, names.index(name)]
                reached = bool(((ends[0] <= values) & (values <= ends[1])).all())
            else:
                reached = self._return >= ends
            if not reached:
                return False
        return bool(success)

    def draw(self, path: Path | str) -> None:
        """Draw the start of the episode, as the environment renders it, to a picture file."""
        self._check_rendering()
        simulator = self._make(self.settings, "rgb_array")
        simulator.reset(self._seed)
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        axes.imshow(simulator.env.render())
        axes.axis("off")
        save_picture(figure, path)

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Replay a recorded episode and write it as an animation."""
        self._check_rendering()
        try:
            simulator = self._make(self.settings, "rgb_array")
            simulator.reset(int(recording["seed"]))
            frames = [simulator.env.render()]
            for joint_action in recording["joint_action"][1:]:
                self.play(simulator, joint_action)
                frames.append(simulator.env.render())
        except Exception as error:  # raised by the environment, for example without a display
            raise ValueError(f"animation: {format_error(error)}") from None
        fps = float(simulator.env.metadata.get("render_fps", DEFAULT_FPS))
        film(frames.__getitem__, len(frames) - 1, self.settings.hold / fps, path)

    def _check_rendering(self) -> None:
        """Refuse to draw an environment that renders no pictures."""
        if "rgb_array" not in (self._simulator.env.metadata or {}).get("render_modes", ()):
            raise ValueError(f"{self.settings.id}: renders no pictures")


class CopyPrediction(Prediction):
    """Predicts by stepping copies of a simulator, once for each joint action."""

    repeats = True

    def __init__(self, scenario: EnvironmentScenario, simulator: Simulator) -> None:
        self._scenario = scenario
        self._simulator = simulator
        self._copies: Copies | None = None
        self._results: dict[bytes, tuple[FloatArray, float]] = {}

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        return np.array([self._simulate(joint)[0][agent] for joint in joint_actions])

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the rewards ``(m,)`` of joint actions ``(m, n)``."""
        return np.array([self._simulate(joint)[1] for joint in joint_actions])

    def _simulate(self, joint_action: IntArray) -> tuple[FloatArray, float]:
        """Return the next states ``(n, d)`` and the mean reward of a joint action."""
        key = np.ascontiguousarray(joint_action, dtype=np.int64).tobytes()
        if key not in self._results:
            if self._copies is None:
                self._copies = copy_simulator(self._simulator)
            total = 0.0
            with self._copies() as simulator:
                for _ in range(self._scenario.horizon):
                    result = self._scenario.play(simulator, joint_action)
                    total += float(np.mean(list(result.rewards.values())))
                    if result.is_over:
                        break
            states = self._scenario.states_of(result)
            self._results[key] = states, total / self._scenario.horizon
        return self._results[key]


def _inspect(settings: EnvironmentSettings, make: Maker) -> tuple[ActionMap, StateReader]:
    """Return actions and state variables of an environment; report any fault in one line."""
    try:
        return inspect_environment(settings, make)
    except (Exception, SystemExit) as error:  # raised by the environment
        is_refusal = isinstance(error, ValueError)
        fault = message(error) if is_refusal else f"cannot be played, {format_error(error)}"
        if fault.startswith("scenario.") or (is_refusal and not settings.id):
            raise ValueError(fault) from None
        name = f"scenario.id = {settings.id!r}" if settings.id else "the environment"
        raise ValueError(f"{name}: {fault}") from None


@lru_cache(maxsize=32)
def inspect_environment(
    settings: EnvironmentSettings, make: Maker
) -> tuple[ActionMap, StateReader]:
    """Return actions and state variables of an environment, the same in every process.

    Raises
    ------
    ValueError
        If the settings do not fit the environment, or the environment is not supported.
    """
    simulator = make(settings, None)
    actions = ActionMap(
        simulator.action_spaces, settings.actions, settings.neutral, settings.bodies()
    )

    def explore(numbers: Callable[[EnvironmentStep], FloatArray]) -> FloatArray:
        rng = np.random.default_rng(0)
        samples = [
            numbers(result)
            for episode in range(EXPLORED_EPISODES)
            for result in _play_randomly(simulator, actions, episode, EXPLORED_STEPS, rng)
        ]
        return np.stack([np.min(samples, axis=0), np.max(samples, axis=0)], axis=1)

    reader = StateReader(settings, simulator.observation_spaces, actions.players, explore)
    for result in _play_randomly(simulator, actions, 0, TRIAL_STEPS, np.random.default_rng(0)):
        reader.states(result)
    if settings.predictor == "copy":
        neutral: IntArray = np.full(len(actions.names), actions.action_set.neutral)
        if fault := find_copy_fault(simulator, actions.environment_actions(neutral)):
            raise ValueError(
                f"scenario.predictor = 'copy': the environment cannot be copied, {fault}; use "
                "'none' with learner.predictor.kind = 'learned' or with a model-free learner"
            )
    return actions, reader


def _play_randomly(
    simulator: Simulator, actions: ActionMap, seed: int, steps: int, rng: np.random.Generator
) -> Iterator[EnvironmentStep]:
    """Yield the reset and the steps of an episode of random actions."""
    yield simulator.reset(seed)
    joint_action = rng.integers(len(actions.action_set), size=len(actions.names))
    for _ in range(steps):
        drawn = rng.integers(len(actions.action_set), size=len(joint_action))
        is_held = rng.random(len(joint_action)) < HOLD_PROBABILITY
        joint_action = np.where(is_held, joint_action, drawn)
        result = simulator.step(actions.environment_actions(joint_action))
        yield result
        if result.is_over:
            return


def from_gymnasium(
    env: Environment | Callable[..., Environment], **keys: Any
) -> EnvironmentScenario:
    """Return a Gymnasium environment as a scenario.

    Parameters
    ----------
    env
        The environment, or a function that makes it. The function is called with a ``render_mode``
        if an episode is to be drawn.
    keys
        Keys of the ``[scenario]`` table, see `GymnasiumSettings`.

    Raises
    ------
    ValueError
        If the settings do not fit the environment, or the environment is not supported.

    Examples
    --------
    >>> import gymnasium
    >>> from_gymnasium(gymnasium.make("Pendulum-v1"), actions=3).action_set.names
    ('-2', '0', '2')
    """
    return EnvironmentScenario(GymnasiumSettings(id="", **keys), _maker_of(env))


def from_pettingzoo(
    env: Environment | Callable[..., Environment], **keys: Any
) -> EnvironmentScenario:
    """Return a PettingZoo environment as a scenario.

    Parameters
    ----------
    env
        The environment, or a function that makes it, as in `from_gymnasium`. It is parallel, or an
        AEC environment that is parallelizable.
    keys
        Keys of the ``[scenario]`` table, see `PettingZooSettings`.

    Raises
    ------
    ValueError
        If the settings do not fit the environment, or the environment is not supported.
    """
    return EnvironmentScenario(PettingZooSettings(id="", **keys), _maker_of(env))


def _maker_of(env: object) -> Maker:
    def make(settings: EnvironmentSettings, render_mode: str | None) -> Simulator:
        if not callable(env):
            return make_simulator(env)
        return make_simulator(env() if render_mode is None else env(render_mode=render_mode))

    return make
