"""Worlds of Gymnasium and PettingZoo as scenarios.

Each number that an action consists of is an agent; it chooses from finitely many levels. A state
consists of numbers of the observation. A limit of time truncates; a terminal state's reward is
received once. What is recorded is the seed and the joint actions, from which an episode is played
again to be drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from ...core.interface.measures import SUCCESS, Measure
from ...core.interface.prediction import Prediction
from ...core.interface.scenario import Scenario, Transition
from ...core.interface.spaces import StateSpace
from ...core.numerics import FloatArray, IntArray
from ...core.plugins.sources import format_error
from ..movies import film
from .players import Actuators, Perception
from .settings import AdaptedSettings, GymnasiumSettings, PettingZooSettings
from .simulators import (
    Make,
    Played,
    Simulator,
    copies_of,
    fault_of_copies,
    make_by_id,
    simulator_of,
)

EPISODES, STEPS = 10, 200
"""Random episodes from which unknown ranges are taken, and the most steps of each."""
HELD = 0.7
"""Probability that a random action is held for a further step."""
FRAMES = 20.0
"""Frames per second of an environment that says not how many it has."""
MEASURES = (
    Measure(SUCCESS.name, SUCCESS.title, source="succeeded", better="higher", is_rate=True),
    Measure("total_reward", "total reward", "1", "env_reward", "sum", "higher"),
)


class AdaptedWorld(Scenario):
    """A world of Gymnasium or PettingZoo; a `Scenario`, which predicts if it is to be copied.

    Parameters
    ----------
    settings
        See `AdaptedSettings`.
    make
        Makes the simulator.

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

    measures = MEASURES
    recorded = ("joint_action",)
    repeats = True

    def __init__(self, settings: AdaptedSettings, make: Make = make_by_id) -> None:
        try:
            self._actuators, self._perception = surveyed(settings, make)
        except Exception as error:  # an environment may be anybody's
            is_said = isinstance(error, ValueError)  # what does not fit
            fault = str(error) if is_said else f"cannot be played, {format_error(error)}"
            which = f"scenario.id = {settings.id!r}: " if settings.id else "the environment: "
            is_named = fault.startswith("scenario.") or (is_said and not settings.id)
            raise ValueError(fault if is_named else which + fault) from None
        self.settings, self._make, self._simulator = settings, make, make(settings, None)
        self.agents, self.roles = self._actuators.names, self._actuators.roles
        self.groups, self.action_set = self._actuators.groups, self._actuators.action_set
        self._body = np.repeat(np.arange(len(self.groups)), [len(group) for group in self.groups])
        self.state_space = StateSpace(
            "observed", self._perception.variables, common=self._perception.common
        )
        self.horizon, self._seed, self._return = settings.horizon, 0, 0.0
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
        self._seed, self._return = int(sequence.generate_state(1)[0]), 0.0
        self._last = np.full(len(self.agents), self.action_set.neutral)
        self._states = self.states_of(self._simulator.reset(self._seed))
        return self._states

    def step(self, joint_action: IntArray) -> Transition:
        """Let the environment carry out a joint action ``(n,)`` for as long as it is held."""
        played = self.play(self._simulator, joint_action)
        self._last = np.array(joint_action)
        self._states = self.states_of(played.observations)
        paid = np.array(list(played.rewards.values()))
        mean = float(paid.mean())
        self._return += mean
        is_joint = self.settings.rewards == "joint" or len(paid) == 1
        return Transition(
            self._states, mean if is_joint else paid[self._body], played.terminated,
            played.truncated, {**self.measure(), "env_reward": mean}, absorbing=False,
        )  # fmt: skip

    def measure(self) -> Mapping[str, Any]:
        """Return the last joint action, and whether the present state is a success."""
        return {"joint_action": self._last, "succeeded": self._has_succeeded()}

    def constants_of_episode(self) -> Mapping[str, Any]:
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
            if played.terminated or played.truncated:
                break
        return played._replace(rewards=paid)

    def states_of(self, observations: Mapping[str, Any]) -> FloatArray:
        """Return the states ``(n, d)`` of all agents."""
        return self._perception.states(observations)[self._body]

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
        wanted: dict[str, Any] = dict(self.settings.success)
        least = wanted.pop("return", -np.inf)
        names = [variable.name for variable in self.state_space.variables]
        inside = (
            low <= value <= high
            for name, (low, high) in wanted.items()
            for value in self._states[:, names.index(name)]
        )
        return bool(self.settings.success) and self._return >= least and all(inside)

    @property
    def draws(self) -> bool:
        """Whether the environment renders pictures."""
        return "rgb_array" in (self._simulator.env.metadata or {}).get("render_modes", ())

    def animate(self, recording: Mapping[str, Any], path: Path) -> None:
        """Play a recorded episode again and write it as an animation."""
        try:
            simulator = self._make(self.settings, "rgb_array")
            simulator.reset(int(recording["seed"]))
            frames: list[Any] = [simulator.env.render()]
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
        self._world, self._simulator = world, simulator
        self._copies: Any = None
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
        self._copies, paid = self._copies or copies_of(self._simulator), 0.0
        with self._copies.lane() as lane:
            for _ in range(self._world.horizon):
                played = self._world.play(lane, joint_action)
                paid += float(np.mean(list(played.rewards.values())))
                if played.terminated or played.truncated:
                    break
        states = self._world.states_of(played.observations)
        self._played[key] = states, paid / self._world.horizon
        return self._played[key]


@lru_cache(maxsize=32)
def surveyed(settings: AdaptedSettings, make: Make) -> tuple[Actuators, Perception]:
    """Return what is found of an environment once, the same in every process.

    Raises
    ------
    ValueError
        If the settings do not fit the environment, or it cannot be adapted or copied; one line.
    """
    simulator = make(settings, None)
    bodies = getattr(settings, "groups", ())
    actuators = Actuators(simulator.action_spaces, settings.actions, settings.neutral, bodies)
    met = partial(_met, simulator, actuators)
    perception = Perception(settings, simulator.observation_spaces, actuators.players, met)
    if settings.predictor == "copy":
        neutral: IntArray = np.full(len(actuators.names), actuators.action_set.neutral)
        if fault := fault_of_copies(simulator, actuators.commands(neutral)):
            raise ValueError(
                f"scenario.predictor = 'copy': the environment cannot be copied, {fault}; use "
                "'none' with learner.predictor.kind = 'learned', or one that needs no prediction"
            )
    return actuators, perception


def _met(simulator: Simulator, actuators: Actuators, numbers_of: Any) -> FloatArray:
    """Return the least and greatest numbers ``(2, k)`` of what is observed in random episodes."""
    rng = np.random.default_rng(0)
    numbers = []
    for episode in range(EPISODES):
        numbers.append(numbers_of(simulator.reset(episode)))
        action = rng.integers(len(actuators.action_set), size=len(actuators.names))
        for _ in range(STEPS):
            drawn = rng.integers(len(actuators.action_set), size=len(action))
            action = np.where(rng.random(len(action)) < HELD, action, drawn)
            played = simulator.step(actuators.commands(action))
            numbers.append(numbers_of(played.observations))
            if played.terminated or played.truncated:
                break
    return np.array([np.min(numbers, axis=(0, 1)), np.max(numbers, axis=(0, 1))])


def from_gymnasium(
    env: gymnasium.Env[Any, Any] | Callable[..., gymnasium.Env[Any, Any]], **keys: Any
) -> AdaptedWorld:
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
    >>> from_gymnasium(gymnasium.make("Pendulum-v1"), actions=3).action_set.names
    ('-2', '0', '2')
    """
    return AdaptedWorld(GymnasiumSettings(id="", **keys), _maker(env))


def from_pettingzoo(env: Any, **keys: Any) -> AdaptedWorld:
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


def _maker(env: Any) -> Make:
    def make(settings: AdaptedSettings, render_mode: str | None) -> Simulator:
        if not callable(env):
            return simulator_of(env)
        return simulator_of(env() if render_mode is None else env(render_mode=render_mode))

    return make
