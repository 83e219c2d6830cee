"""Box pushing for other people's learners: PettingZoo and Gymnasium environments.

Three views of one scenario: `WheelsEnv` (every wheel an agent), `RobotsEnv` (every robot an agent)
and `BoxPushingEnv` (one agent for all). Observations are the states of the paper's agents, what
wheels of a robot share being given once; only angles have bounds. An agent gets the mean reward of
its wheels. Episodes end when the box is at the goal (terminated), when it is farther away than the
termination radius or after `steps` steps (truncated).

Importing this module registers ``NestedAgents/BoxPushing-v0`` with Gymnasium::

    module = "nested_agents.scenarios.box_pushing.environments"
    gymnasium.make(f"{module}:NestedAgents/BoxPushing-v0", steps=200)
    gymnasium.make_vec(f"{module}:NestedAgents/BoxPushing-v0", 8, "async", steps=200)
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from ...core.interface.recording import EpisodeRecorder
from ...core.interface.scenario import Transition
from ...core.numerics import FloatArray, IntArray
from .config import BoxPushingSettings
from .scenario import BoxPushing

ENV_ID = "NestedAgents/BoxPushing-v0"
RENDER_MODES = ["rgb_array"]
Observations = dict[str, FloatArray]
"""By agent."""
Infos = dict[str, dict[str, object]]
"""Measurements by name, by agent."""


class Player:
    """The wheels that one outside agent drives, and what it observes.

    Parameters
    ----------
    scenario
        What is played.
    wheels
        Indices of the wheels.
    by_wheel
        Whether it observes the state of every wheel in a row of its own.
    """

    def __init__(
        self, scenario: BoxPushing, wheels: Sequence[int], *, by_wheel: bool = False
    ) -> None:
        self.wheels = list(wheels)
        space = scenario.state_space
        d = space.n_variables
        own = space.n_own
        every = np.arange(len(scenario.agents) * d).reshape(-1, d)
        parts = []
        for group in scenario.groups:
            mine = [wheel for wheel in group if wheel in self.wheels]
            parts += [every[mine, :own].ravel(), every[mine[:1], own:].ravel()]
        self.places: IntArray = every[self.wheels] if by_wheel else np.concatenate(parts)
        low, high = np.moveaxis(space.bounds[self.places % d].astype(np.float32), -1, 0)
        self.observation_space = Box(low, high, dtype=np.float32)
        actions = len(scenario.action_set)
        n = len(self.wheels)
        self.action_space = Discrete(actions) if n == 1 else MultiDiscrete([actions] * n)

    def observe(self, states: FloatArray) -> FloatArray:
        """Return the observation in the states ``(n, d)`` of all wheels."""
        return states.ravel()[self.places].astype(np.float32)

    def mean_reward(self, reward: float | FloatArray) -> float:
        """Return the mean reward of the wheels; `reward` is one, or ``(n,)`` of all wheels."""
        return float(reward if np.ndim(reward) == 0 else np.mean(np.take(reward, self.wheels)))


class Environment(ABC):
    """A scenario with players, a clock, a stream of seeds and pictures; inherit it beside an API.

    Parameters
    ----------
    settings
        Of the scenario; a mapping is read as a ``[scenario]`` table, none as the default ones.
    steps
        Most steps of an episode.
    render_mode
        ``None`` or ``"rgb_array"``, of which `gymnasium.wrappers.HumanRendering` makes a window.
    sensors
        Whether pictures show the rays of the infrared sensors.
    by_wheel
        Whether an agent observes the state of every wheel in a row of its own.

    Raises
    ------
    ValueError
        If one of them is out of range.
    """

    def __init__(
        self,
        settings: BoxPushingSettings | Mapping[str, Any] | None = None,
        *,
        steps: int = 450,
        render_mode: str | None = None,
        sensors: bool = False,
        by_wheel: bool = False,
    ) -> None:
        if steps < 1:
            raise ValueError(f"steps = {steps}, must be at least 1")
        if render_mode not in (None, *RENDER_MODES):
            raise ValueError(f"render_mode = {render_mode!r}, allowed None, {RENDER_MODES}")
        if not isinstance(settings, BoxPushingSettings):
            settings = BoxPushingSettings(**(settings or {}))
        self.scenario = BoxPushing(settings)
        self.steps = steps
        self.render_mode = render_mode
        self.sensors = sensors
        self._recorder: EpisodeRecorder | None = None
        self.players = {
            name: Player(self.scenario, wheels, by_wheel=by_wheel)
            for name, wheels in self._teams().items()
        }
        self.possible_agents = list(self.players)
        self.agents: list[str] = []
        self._seeds = np.random.default_rng()
        self._episode = -1
        self._step = 0

    @abstractmethod
    def _teams(self) -> dict[str, Sequence[int]]:
        """Return the wheels that each agent drives, by its name."""

    def begin(self, seed: int | None, options: Mapping[str, Any] | None) -> FloatArray:
        """Start the next episode; a seed starts the stream of worlds and their count afresh.

        The option ``episode`` sets the number of the episode, by which failures are scheduled, and
        ``world`` the seed of its world, in place of the next one of the stream.
        """
        if seed is not None:
            self._seeds = np.random.default_rng(seed)
            self._episode = -1
        options = options or {}
        self._episode = int(options.get("episode", self._episode + 1))
        self._step = 0
        self.agents = list(self.possible_agents)
        world = options.get("world")
        if world is None:
            world = int(self._seeds.integers(2**63))
        states = self.scenario.reset(world, self._episode)
        self._recorder = EpisodeRecorder(self.scenario) if self.render_mode else None
        return states

    def advance(self, joint_action: IntArray) -> tuple[Transition, bool]:
        """Return what a joint action ``(n,)`` leads to, and whether the episode is truncated."""
        transition = self.scenario.step(joint_action)
        self._step += 1
        if self._recorder is not None:
            self._recorder.add(transition)
        late = self._step >= self.steps and not transition.terminated
        return transition, transition.truncated or late

    def info(self, measured: Mapping[str, object]) -> dict[str, object]:
        """Return a copy of measurements, without the times, which differ from run to run."""
        return {
            name: value.copy() if isinstance(value, np.ndarray) else value
            for name, value in measured.items()
            if name != "seconds"
        }

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture ``(height, width, 3)`` of the present; None without a render mode.

        Raises
        ------
        RuntimeError
            If no episode has begun.
        """
        if self.render_mode is None:
            return None
        if self._recorder is None:
            raise RuntimeError("render: no episode has begun, call reset first")
        from .pictures.rendering import picture

        recording = self._recorder.recording()
        return picture(recording, len(recording["box_pose"]) - 1, sensors=self.sensors)


class WheelsEnv(Environment, ParallelEnv):
    """Box pushing as a PettingZoo environment whose agents are the wheels; see `Environment`.

    Examples
    --------
    >>> env = WheelsEnv({"robots": 1}, steps=3)
    >>> observations, _ = env.reset(seed=0)
    >>> sorted(observations), env.action_space("robot1.left")
    (['robot1.left', 'robot1.right'], Discrete(4))
    """

    metadata: ClassVar[dict[str, object]] = {
        "name": "box_pushing_wheels_v0",
        "render_modes": RENDER_MODES,
        "render_fps": 2,
        "is_parallelizable": True,
    }

    def _teams(self) -> dict[str, Sequence[int]]:
        return {name: [i] for i, name in enumerate(self.scenario.agents)}

    def observation_space(self, agent: str) -> Box:
        """Return the space of an agent's observations."""
        return self.players[agent].observation_space

    def action_space(self, agent: str) -> Discrete | MultiDiscrete:
        """Return the space of an agent's actions."""
        return self.players[agent].action_space

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observations, Infos]:
        """Start an episode, see `Environment.begin`; return observations and infos by agent."""
        return self._observe(self.begin(seed, options), self.scenario.measure())

    def step(
        self, actions: Mapping[str, int | IntArray]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Carry out one action of every agent.

        Returns
        -------
        tuple
            Observations, rewards, terminations, truncations and infos by agent; all empty when the
            episode is over, as PettingZoo has it.
        """
        if not self.agents:
            return {}, {}, {}, {}, {}
        if set(actions) != set(self.agents):
            missing = [name for name in self.agents if name not in actions]
            problem = f"{missing[0]!r} is missing" if missing else "some of these do not act"
            raise ValueError(f"step: actions of {list(actions)}: {problem}; agents: {self.agents}")
        joint = np.empty(len(self.scenario.agents), dtype=np.int64)
        for name in self.agents:
            joint[self.players[name].wheels] = actions[name]
        transition, truncated = self.advance(joint)
        observations, infos = self._observe(transition.states, transition.info)
        rewards = {name: self.players[name].mean_reward(transition.reward) for name in self.agents}
        ends = dict.fromkeys(self.agents, transition.terminated)
        breaks = dict.fromkeys(self.agents, truncated)
        if transition.terminated or truncated:
            self.agents = []
        return observations, rewards, ends, breaks, infos

    def _observe(
        self, states: FloatArray, measured: Mapping[str, object]
    ) -> tuple[Observations, Infos]:
        """Return what those who are still there observe, and are informed of."""
        observations = {name: self.players[name].observe(states) for name in self.agents}
        infos = {name: self.info(measured) for name in self.agents}
        return observations, infos


class RobotsEnv(WheelsEnv):
    """Box pushing as a PettingZoo environment whose agents are the robots; see `Environment`.

    Examples
    --------
    >>> env = RobotsEnv(steps=3)
    >>> env.possible_agents, env.action_space("robot1")
    (['robot1', 'robot2'], MultiDiscrete([4 4]))
    """

    metadata: ClassVar[dict[str, object]] = WheelsEnv.metadata | {"name": "box_pushing_robots_v0"}

    def _teams(self) -> dict[str, Sequence[int]]:
        return {f"robot{r + 1}": group for r, group in enumerate(self.scenario.groups)}


class BoxPushingEnv(Environment, gymnasium.Env):
    """Box pushing as a Gymnasium environment: one agent drives all wheels; see `Environment`.

    Examples
    --------
    >>> env = BoxPushingEnv(steps=3)
    >>> env.action_space, env.observation_space.shape
    (MultiDiscrete([4 4 4 4]), (18,))
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": 2}  # noqa: RUF012

    def __init__(
        self,
        settings: BoxPushingSettings | Mapping[str, Any] | None = None,
        *,
        steps: int = 450,
        render_mode: str | None = None,
        sensors: bool = False,
        by_wheel: bool = False,
    ) -> None:
        super().__init__(
            settings, steps=steps, render_mode=render_mode, sensors=sensors, by_wheel=by_wheel
        )
        self._player = self.players["single"]
        self.observation_space = self._player.observation_space
        self.action_space = self._player.action_space

    def _teams(self) -> dict[str, Sequence[int]]:
        return {"single": range(len(self.scenario.agents))}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, object]]:
        """Start an episode, see `Environment.begin`; return observation and info."""
        super().reset(seed=seed)
        states = self.begin(seed, options)
        return self._player.observe(states), self.info(self.scenario.measure())

    def step(self, action: ArrayLike) -> tuple[FloatArray, float, bool, bool, dict[str, object]]:
        """Return observation, reward, terminated, truncated and info after an action ``(n,)``."""
        transition, truncated = self.advance(np.asarray(action, dtype=np.int64))
        observation = self._player.observe(transition.states)
        reward = self._player.mean_reward(transition.reward)
        info = self.info(transition.info)
        return observation, reward, transition.terminated, truncated, info


if ENV_ID not in gymnasium.registry:
    gymnasium.register(ENV_ID, entry_point=f"{__name__}:BoxPushingEnv")
