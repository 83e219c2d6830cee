"""Scenarios as Gymnasium and PettingZoo environments.

A scenario has three views: `AgentsEnv` with each agent as a player, `BodiesEnv` with each body as a
player, and `JointEnv` with one player for all agents. Observations are the states of the agents;
variables that the agents of a body share occur once, and only angles have bounds. The reward of a
player is the mean of its agents. Episodes end as in the scenario, and are truncated after `steps`
steps.

`nested_agents.environments` registers ids with both libraries.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from ..core.interface.abilities import Recorded, measurements_of
from ..core.interface.recording import EpisodeRecorder
from ..core.interface.scenario import Scenario, Transition
from ..core.numerics import FloatArray, IntArray
from .library_types import Options

Observations = dict[str, FloatArray]
"""Observations by agent."""
Infos = dict[str, dict[str, object]]
"""Measurements by agent and name."""


class Player:
    """The agents that one player controls, and its observations.

    Parameters
    ----------
    scenario
        The scenario.
    members
        Indices of the agents.
    by_agent
        Whether observations have a row for the state of each agent.
    """

    def __init__(
        self, scenario: Scenario, members: Sequence[int], *, by_agent: bool = False
    ) -> None:
        self.members = list(members)
        space = scenario.state_space
        d = space.n_variables
        own = space.n_own
        every = np.arange(len(scenario.agents) * d).reshape(-1, d)
        parts = []
        for group in scenario.groups:
            controlled = [agent for agent in group if agent in self.members]
            parts += [every[controlled, :own].ravel(), every[controlled[:1], own:].ravel()]
        self.places: IntArray = every[self.members] if by_agent else np.concatenate(parts)
        low, high = np.moveaxis(space.bounds[self.places % d].astype(np.float32), -1, 0)
        self.observation_space = Box(low, high, dtype=np.float32)
        actions = len(scenario.action_set)
        n = len(self.members)
        self.action_space = Discrete(actions) if n == 1 else MultiDiscrete([actions] * n)

    def observe(self, states: FloatArray) -> FloatArray:
        """Return the observation in the states ``(n, d)`` of all agents."""
        return states.ravel()[self.places].astype(np.float32)

    def mean_reward(self, reward: float | FloatArray) -> float:
        """Return the mean reward of its agents from a joint reward, or ``(n,)`` of all agents."""
        return float(reward if np.ndim(reward) == 0 else np.mean(np.take(reward, self.members)))


class Environment(ABC):
    """Base class of the views: a scenario with players, a step limit, seeds and rendering.

    Parameters
    ----------
    scenario
        The scenario.
    steps
        Maximum number of steps of an episode.
    render_mode
        ``None`` or ``"rgb_array"``, which `gymnasium.wrappers.HumanRendering` shows in a window.
    by_agent
        Whether observations have a row for the state of each agent.

    Raises
    ------
    ValueError
        If `steps` or `render_mode` is not allowed.
    """

    modes: ClassVar[Sequence[str]] = ()
    """Supported render modes."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        steps: int,
        render_mode: str | None = None,
        by_agent: bool = False,
    ) -> None:
        if steps < 1:
            raise ValueError(f"steps = {steps}, must be at least 1")
        if render_mode not in (None, *self.modes):
            raise ValueError(f"render_mode = {render_mode!r}, allowed None, {list(self.modes)}")
        self.scenario = scenario
        self.steps = steps
        self.render_mode = render_mode
        self._recorder: EpisodeRecorder | None = None
        self.players = {
            name: Player(self.scenario, members, by_agent=by_agent)
            for name, members in self._teams().items()
        }
        self.possible_agents = list(self.players)
        self.agents: list[str] = []
        self._seeds = np.random.default_rng()
        self._episode = -1
        self._step = 0

    @abstractmethod
    def _teams(self) -> Mapping[str, Sequence[int]]:
        """Return the indices of the agents of each player, by name."""

    def begin(self, seed: int | None, options: Options) -> FloatArray:
        """Start the next episode; a seed resets the stream of episode seeds and their count.

        The option ``episode`` sets the number of the episode, which schedules failures. The option
        ``world`` sets the seed of the episode instead of the next one of the stream.
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
        self._recorder = None
        if self.render_mode is not None and isinstance(self.scenario, Recorded):
            self._recorder = EpisodeRecorder(self.scenario)
        return states

    def advance(self, joint_action: IntArray) -> tuple[Transition, bool]:
        """Return the transition of a joint action ``(n,)`` and whether it is truncated."""
        transition = self.scenario.step(joint_action)
        self._step += 1
        if self._recorder is not None:
            self._recorder.add(transition)
        is_last = self._step >= self.steps and not transition.terminated
        return transition, transition.truncated or is_last

    def info(self, measured: Mapping[str, object]) -> dict[str, object]:
        """Return a copy of measurements without times, which differ between runs."""
        return {
            name: value.copy() if isinstance(value, np.ndarray) else value
            for name, value in measured.items()
            if name != "seconds"
        }

    def picture(self, recording: Mapping[str, Any]) -> NDArray[np.uint8]:
        """Return a picture ``(height, width, 3)`` of the last step of a recording."""
        raise NotImplementedError

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture ``(height, width, 3)`` of the present state; None without a mode.

        Raises
        ------
        RuntimeError
            If `reset` was not called.
        """
        if self.render_mode is None:
            return None
        if self._recorder is None:
            raise RuntimeError("render: call reset first")
        return self.picture(self._recorder.recording())


class AgentsEnv(Environment, ParallelEnv):
    """A scenario as a PettingZoo environment with the same agents, see `Environment`.

    Examples
    --------
    >>> from nested_agents.scenarios import SCENARIOS
    >>> env = AgentsEnv(SCENARIOS.parsed("line-up").build(), steps=3)
    >>> observations, _ = env.reset(seed=0)
    >>> sorted(observations), env.action_space("cart1")
    (['cart1', 'cart2'], Discrete(4))
    """

    metadata: ClassVar[dict[str, object]] = {
        "name": "nested_agents_v0",
        "render_modes": [],
        "is_parallelizable": True,
    }

    def _teams(self) -> Mapping[str, Sequence[int]]:
        return {name: [i] for i, name in enumerate(self.scenario.agents)}

    def observation_space(self, agent: str) -> Box:
        """Return the space of an agent's observations."""
        return self.players[agent].observation_space

    def action_space(self, agent: str) -> Discrete | MultiDiscrete:
        """Return the space of an agent's actions."""
        return self.players[agent].action_space

    def reset(self, seed: int | None = None, options: Options = None) -> tuple[Observations, Infos]:
        """Start an episode, see `Environment.begin`; return observations and infos by agent."""
        return self._observe(self.begin(seed, options), measurements_of(self.scenario))

    def step(
        self, actions: Mapping[str, int | IntArray]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Execute one action of every agent.

        Returns
        -------
        tuple
            Observations, rewards, terminations, truncations and infos by agent; all empty after the
            end of an episode, as in PettingZoo.
        """
        if not self.agents:
            return {}, {}, {}, {}, {}
        if set(actions) != set(self.agents):
            missing = [name for name in self.agents if name not in actions]
            problem = f"{missing[0]!r} is missing" if missing else "some are unknown"
            raise ValueError(f"step: actions of {list(actions)}: {problem}; agents: {self.agents}")
        joint = np.empty(len(self.scenario.agents), dtype=np.int64)
        for name in self.agents:
            joint[self.players[name].members] = actions[name]
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
        """Return observations and infos of the present agents."""
        observations = {name: self.players[name].observe(states) for name in self.agents}
        infos = {name: self.info(measured) for name in self.agents}
        return observations, infos


class BodiesEnv(AgentsEnv):
    """A scenario as a PettingZoo environment with one agent per body, see `Environment`."""

    def _teams(self) -> Mapping[str, Sequence[int]]:
        names = self.scenario.agents
        bodies = self.scenario.groups
        return {names[body[0]].partition(".")[0]: body for body in bodies}


class JointEnv(Environment, gymnasium.Env):
    """A scenario as a Gymnasium environment for all agents together, see `Environment`.

    Examples
    --------
    >>> from nested_agents.scenarios import SCENARIOS
    >>> env = JointEnv(SCENARIOS.parsed("line-up").build(), steps=3)
    >>> env.action_space, env.observation_space.shape
    (MultiDiscrete([4 4]), (4,))
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        scenario: Scenario,
        *,
        steps: int,
        render_mode: str | None = None,
        by_agent: bool = False,
    ) -> None:
        super().__init__(scenario, steps=steps, render_mode=render_mode, by_agent=by_agent)
        self._player = self.players["single"]
        self.observation_space = self._player.observation_space
        self.action_space = self._player.action_space

    def _teams(self) -> Mapping[str, Sequence[int]]:
        return {"single": range(len(self.scenario.agents))}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, object]]:
        """Start an episode, see `Environment.begin`; return observation and info."""
        super().reset(seed=seed)
        states = self.begin(seed, options)
        return self._player.observe(states), self.info(measurements_of(self.scenario))

    def step(self, action: ArrayLike) -> tuple[FloatArray, float, bool, bool, dict[str, object]]:
        """Return observation, reward, terminated, truncated and info after an action ``(n,)``."""
        transition, truncated = self.advance(np.asarray(action, dtype=np.int64))
        observation = self._player.observe(transition.states)
        reward = self._player.mean_reward(transition.reward)
        info = self.info(transition.info)
        return observation, reward, transition.terminated, truncated, info
