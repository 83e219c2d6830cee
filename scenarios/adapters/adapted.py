"""Worlds of Gymnasium and PettingZoo as scenarios.

Each number that an action consists of is an agent; it chooses from finitely many levels. A state
consists of numbers of the observation. A limit of time truncates; a terminal state's reward is
received once. What is recorded is the seed and the joint actions, from which an episode is played
again to be drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from copy import copy
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from ...core.interface.measures import NO_SUCCESS, SUCCESS, Measure
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import StateSpace
from ...core.numerics import FloatArray, IntArray
from ...core.plugins.sources import format_error, message
from ..movies import film
from .actuators import Actuators
from .copies import Copies, copies_of, fault_of_copies
from .making import Make, maker_of
from .perception import Numbers, Perception
from .settings import AdaptedSettings, GymnasiumSettings, PettingZooSettings
from .simulators import Environment, Played, Simulator, simulator_of

REHEARSED = 8
"""Steps that are played when a world is built: what does not fit is said then."""
EPISODES = 10
"""Random episodes from which unknown ranges are taken."""
STEPS = 200
"""The most steps of each."""
HELD = 0.7
"""Probability that a random action is held for a further step."""
FRAMES = 20.0
"""Frames per second of an environment that says not how many it has."""
SUCCEEDED = Measure(SUCCESS.name, SUCCESS.title, source="succeeded", better="higher", is_rate=True)
REWARD = Measure("total_reward", "total reward", "1", "env_reward", "sum", "higher")


class AdaptedWorld(Scenario):
    """A world of Gymnasium or PettingZoo; a `Scenario`, which predicts if it is to be copied.

    Parameters
    ----------
    settings
        See `AdaptedSettings`.
    make
        Makes the simulator; None: what the settings name.

    Raises
    ------
    ValueError
        If the settings do not fit the environment, or it cannot be adapted or copied; one line.

    Examples
    --------
    >>> world = GymnasiumSettings(id="CartPole-v1", predictor="copy").build()
    >>> world.agents, [variable.name for variable in world.state_space.variables]
    (('actuator1',), ['o0', 'o1', 'o2', 'o3'])
    >>> _ = world.reset(0)
    >>> ahead = world.predict().states(0, np.array([[0], [1]]))
    >>> bool((ahead[1] == world.step(np.array([1])).states[0]).all())
    True
    """

    recorded = ("joint_action",)
    repeats = True

    def __init__(self, settings: AdaptedSettings, make: Make | None = None) -> None:
        self._make = maker_of(settings) if make is None else make
        self._actuators, self._perception = _survey_in_words(settings, self._make)
        self.settings = settings
        self.measures = (SUCCEEDED if settings.success else NO_SUCCESS, REWARD)
        self._simulator = self._make(settings, None)
        self.agents = self._actuators.names
        self.roles = self._actuators.roles
        self.groups = self._actuators.groups
        self.action_set = self._actuators.action_set
        self._body = np.repeat(np.arange(len(self.groups)), [len(group) for group in self.groups])
        self.state_space = StateSpace(
            "observed", self._perception.variables, common=self._perception.common
        )
        self.bounds = self._perception.bounds
        self.horizon = settings.horizon
        self._seed = 0
        self._return = 0.0
        self._terminated = False
        self._last: IntArray = np.full(len(self.agents), self.action_set.neutral)
        self._states: FloatArray = np.zeros((len(self.agents), self.state_space.n_variables))

    @property
    def predicts(self) -> bool:
        """Whether copies of the simulator are played ahead."""
        return self.settings.predictor == "copy"

    @property
    def lacks_prediction(self) -> str:
        """Why it predicts nothing."""
        return f"scenario.predictor = {self.settings.predictor!r} gives none ('copy' does)"

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Let the environment start an episode; return states ``(n, d)``."""
        sequence = np.random.SeedSequence(seed) if isinstance(seed, int) else seed
        self._seed = int(sequence.generate_state(1)[0])
        self._return = 0.0
        self._terminated = False
        self._last = np.full(len(self.agents), self.action_set.neutral)
        self._states = self.states_of(self._simulator.reset(self._seed))
        return self._states

    def step(self, joint_action: IntArray) -> Transition:
        """Let the environment carry out a joint action ``(n,)`` for as long as it is held."""
        played = self.play(self._simulator, joint_action)
        self._last = np.array(joint_action)
        self._states = self.states_of(played)
        self._terminated = played.terminated
        paid = np.array(list(played.rewards.values()))
        mean = float(paid.mean())
        self._return += mean
        is_joint = self.settings.rewards == "joint" or len(paid) == 1
        return Transition(
            states=self._states,
            reward=mean if is_joint else paid[self._body],
            terminated=played.terminated,
            truncated=played.truncated,
            info={**self.measure(), "env_reward": mean},
            absorbing=False,
        )

    def measure(self) -> Mapping[str, object]:
        """Return the last joint action, and whether the present state is a success."""
        return {"joint_action": self._last, "succeeded": self._has_succeeded()}

    def constants_of_episode(self) -> Mapping[str, object]:
        """Return the seed of the environment."""
        return {"seed": self._seed}

    def play(self, simulator: Simulator, joint_action: IntArray) -> Played:
        """Hold a joint action in a simulator; return what it told last, and all rewards."""
        commands = self._actuators.commands(joint_action)
        paid = dict.fromkeys(simulator.players, 0.0)
        for _ in range(self.settings.hold):
            played = simulator.step(commands)
            for player, reward in played.rewards.items():
                paid[player] += reward
            if played.is_over:
                break
        return played._replace(rewards=paid)

    def states_of(self, played: Played) -> FloatArray:
        """Return the states ``(n, d)`` of all agents."""
        return self._perception.states(played)[self._body]

    def predict(self) -> CopiedPrediction | None:
        """Predict from the present state, if copies are played."""
        return CopiedPrediction(self, self._simulator) if self.predicts else None

    def with_exact_prediction(self) -> AdaptedWorld | None:
        """Return the same world, which predicts one decision ahead, if copies are played."""
        if not self.predicts:
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

    @property
    def draws(self) -> bool:
        """Whether the environment renders pictures."""
        return "rgb_array" in (self._simulator.env.metadata or {}).get("render_modes", ())

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Play a recorded episode again and write it as an animation."""
        try:
            simulator = self._make(self.settings, "rgb_array")
            simulator.reset(int(recording["seed"]))
            frames = [simulator.env.render()]
            for joint_action in recording["joint_action"][1:]:
                self.play(simulator, joint_action)
                frames.append(simulator.env.render())
        except Exception as error:  # an environment may be anybody's, and needs a screen
            raise ValueError(f"animation: {format_error(error)}") from None
        rate = float(simulator.env.metadata.get("render_fps", FRAMES))
        film(frames.__getitem__, len(frames) - 1, self.settings.hold / rate, path)


class CopiedPrediction(Prediction):
    """What copies of the simulator come to; each joint action is played once.

    Parameters
    ----------
    world, simulator
        The scenario, and its simulator in its present state.
    """

    def __init__(self, world: AdaptedWorld, simulator: Simulator) -> None:
        self._world = world
        self._simulator = simulator
        self._copies: Copies | None = None
        self._played: dict[bytes, tuple[FloatArray, float]] = {}

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, d)`` of `agent` for joint actions ``(m, n)``."""
        return np.array([self._ahead(joint)[0][agent] for joint in joint_actions])

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the rewards ``(m,)`` of joint actions ``(m, n)``."""
        return np.array([self._ahead(joint)[1] for joint in joint_actions])

    def _ahead(self, joint_action: IntArray) -> tuple[FloatArray, float]:
        """Return the states ``(n, d)`` that a joint action leads to, and the mean reward."""
        key = np.ascontiguousarray(joint_action, dtype=np.int64).tobytes()
        if key in self._played:
            return self._played[key]
        if self._copies is None:
            self._copies = copies_of(self._simulator)
        paid = 0.0
        with self._copies.lane() as lane:
            for _ in range(self._world.horizon):
                played = self._world.play(lane, joint_action)
                paid += float(np.mean(list(played.rewards.values())))
                if played.is_over:
                    break
        states = self._world.states_of(played)
        self._played[key] = states, paid / self._world.horizon
        return self._played[key]


def _survey_in_words(settings: AdaptedSettings, make: Make) -> tuple[Actuators, Perception]:
    """Return what is found of an environment, or refuse it in one line that names it."""
    try:
        return surveyed(settings, make)
    except (Exception, SystemExit) as error:  # an environment may be anybody's
        is_said = isinstance(error, ValueError)  # what does not fit
        fault = message(error) if is_said else f"cannot be played, {format_error(error)}"
        if fault.startswith("scenario.") or (is_said and not settings.id):
            raise ValueError(fault) from None
        which = f"scenario.id = {settings.id!r}" if settings.id else "the environment"
        raise ValueError(f"{which}: {fault}") from None


@lru_cache(maxsize=32)
def surveyed(settings: AdaptedSettings, make: Make) -> tuple[Actuators, Perception]:
    """Return what is found of an environment once, the same in every process.

    Raises
    ------
    ValueError
        If the settings do not fit the environment, or it cannot be adapted or copied; one line.
    """
    simulator = make(settings, None)
    spaces = simulator.action_spaces
    actuators = Actuators(spaces, settings.actions, settings.neutral, settings.bodies())
    met = partial(_met, simulator, actuators)
    perception = Perception(settings, simulator.observation_spaces, actuators.players, met)
    for played in _play_randomly(simulator, actuators, 0, REHEARSED, np.random.default_rng(0)):
        perception.states(played)
    if settings.predictor == "copy":
        neutral: IntArray = np.full(len(actuators.names), actuators.action_set.neutral)
        if fault := fault_of_copies(simulator, actuators.commands(neutral)):
            raise ValueError(
                f"scenario.predictor = 'copy': the environment cannot be copied, {fault}; use "
                "'none' with learner.predictor.kind = 'learned', or one that needs no prediction"
            )
    return actuators, perception


def _met(simulator: Simulator, actuators: Actuators, numbers_of: Numbers) -> FloatArray:
    """Return what is observed at least and at most in random episodes, ``(players, 2, k)``."""
    rng = np.random.default_rng(0)
    numbers = []
    for episode in range(EPISODES):
        for played in _play_randomly(simulator, actuators, episode, STEPS, rng):
            numbers.append(numbers_of(played))
    return np.stack([np.min(numbers, axis=0), np.max(numbers, axis=0)], axis=1)


def _play_randomly(
    simulator: Simulator, actuators: Actuators, seed: int, steps: int, rng: np.random.Generator
) -> Iterator[Played]:
    """Yield the start and the steps of an episode of random actions, most of them held."""
    yield simulator.reset(seed)
    action = rng.integers(len(actuators.action_set), size=len(actuators.names))
    for _ in range(steps):
        drawn = rng.integers(len(actuators.action_set), size=len(action))
        action = np.where(rng.random(len(action)) < HELD, action, drawn)
        played = simulator.step(actuators.commands(action))
        yield played
        if played.is_over:
            return


def from_gymnasium(env: Environment | Callable[..., Environment], **keys: Any) -> AdaptedWorld:
    """Return an environment of Gymnasium as a scenario.

    Parameters
    ----------
    env
        The environment; or what makes one, given a ``render_mode`` if it is to be drawn.
    keys
        Of the ``[scenario]`` table, see `GymnasiumSettings`.

    Raises
    ------
    ValueError
        As `AdaptedWorld`.

    Examples
    --------
    >>> import gymnasium
    >>> from_gymnasium(gymnasium.make("Pendulum-v1"), actions=3).action_set.names
    ('-2', '0', '2')
    """
    return AdaptedWorld(GymnasiumSettings(id="", **keys), _maker(env))


def from_pettingzoo(env: Environment | Callable[..., Environment], **keys: Any) -> AdaptedWorld:
    """Return an environment of PettingZoo as a scenario.

    Parameters
    ----------
    env
        The environment, parallel or one whose agents act in cycles; or what makes one, given a
        ``render_mode`` if it is to be drawn.
    keys
        Of the ``[scenario]`` table, see `PettingZooSettings`.

    Raises
    ------
    ValueError
        As `AdaptedWorld`.
    """
    return AdaptedWorld(PettingZooSettings(id="", **keys), _maker(env))


def _maker(env: object) -> Make:
    def make(settings: AdaptedSettings, render_mode: str | None) -> Simulator:
        if not callable(env):
            return simulator_of(env)
        return simulator_of(env() if render_mode is None else env(render_mode=render_mode))

    return make
