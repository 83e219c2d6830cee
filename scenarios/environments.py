"""Scenarios as Gymnasium and PettingZoo environments.

In `AgentsEnv` each agent or each body is a player; `JointEnv` has one player for all agents.
Observations are the states of the agents; variables that the agents of a body share occur once, and
only angles have bounds. The reward of a player is the mean of its agents. Episodes end as in the
scenario, and are truncated after `steps` steps.

`nested_agents.environments` makes them by name and registers ids with both libraries.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, Protocol, runtime_checkable

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from ..core.interface.abilities import Recorded, measurements_of, options_of
from ..core.interface.recording import EpisodeRecorder
from ..core.interface.scenario import Scenario
from ..core.numerics import FloatArray, IntArray
from ..core.plugins.words import show
from .library_types import Options

Observations = dict[str, FloatArray]
"""Observations by agent."""
Infos = dict[str, dict[str, object]]
"""Measurements by agent and name."""
Players = Literal["agents", "bodies", "team"]
"""Players of a view: every agent, every body, or one for all agents."""


@runtime_checkable
class Rendered(Recorded, Protocol):
    """Optional part of a scenario: pictures of recordings."""

    def picture(self, recording: Mapping[str, Any]) -> NDArray[np.uint8]:
        """Return a picture ``(height, width, 3)`` of the last step of a recording."""


def players_of(scenario: Scenario, players: Players) -> dict[str, list[int]]:
    """Return the indices of the agents of each player, by name."""
    names = scenario.agents
    if players == "team":
        return {"single": list(range(len(names)))}
    if players == "bodies":
        bodies = [names[body[0]].partition(".")[0] for body in scenario.groups]
        if len(set(bodies)) < len(bodies):  # names of agents need not begin with their body
            bodies = [names[body[0]] for body in scenario.groups]
        return dict(zip(bodies, map(list, scenario.groups), strict=True))
    return {name: [i] for i, name in enumerate(names)}


def observed_places(scenario: Scenario, members: Sequence[int], *, by_agent: bool) -> IntArray:
    """Return the places of a player's numbers in the flat states ``(n d,)`` of all agents.

    With `by_agent` they have a row for each agent of the player.
    """
    space = scenario.state_space
    every = np.arange(len(scenario.agents) * space.n_variables).reshape(-1, space.n_variables)
    if by_agent:
        return every[members]
    parts = []
    for group in scenario.groups:
        controlled = [agent for agent in group if agent in members]
        parts += [every[controlled, : space.n_own].ravel()]
        parts += [every[controlled[:1], space.n_own :].ravel()]
    return np.concatenate(parts)


def checked_action(
    action: object, space: Discrete | MultiDiscrete, agents: Sequence[str]
) -> IntArray:
    """Return an action of a player as whole numbers: ``()``, or ``(k,)`` for k agents.

    Parameters
    ----------
    action
        A whole number, or one for each of several agents; their type may be float.
    space
        A Discrete or MultiDiscrete space from 0.
    agents
        The agents for which the player acts.

    Raises
    ------
    ValueError
        If it is not in the space; one line names the agent, its action and what is allowed.

    Examples
    --------
    >>> checked_action([0, 2.0], MultiDiscrete([4, 3]), ["left", "right"])
    array([0, 2])
    >>> checked_action([0, -1], MultiDiscrete([4, 3]), ["left", "right"])
    Traceback (most recent call last):
    ValueError: step: action -1 of right, allowed: whole numbers from 0 to 2
    """
    numbers = np.asarray(action, dtype=object)
    counts: IntArray = np.asarray(space.n if isinstance(space, Discrete) else space.nvec)
    if numbers.shape != counts.shape:
        raise ValueError(f"step: action {show(action)} of {', '.join(agents)}, allowed: {space}")
    for agent, number, n in zip(agents, numbers.flat, counts.flat, strict=True):
        is_number = isinstance(number, int | float | np.number)
        if not (is_number and 0 <= number < n and number == int(number)):
            raise ValueError(
                f"step: action {show(number)} of {agent}, allowed: whole numbers from 0 to {n - 1}"
            )
    whole: IntArray = numbers.astype(np.int64)[()]
    return whole


class AgentsEnv(ParallelEnv):
    """A scenario as a PettingZoo environment.

    Parameters
    ----------
    scenario
        The scenario.
    steps
        Maximum number of steps of an episode.
    players
        Players of the environment.
    render_mode
        ``None``, or ``"rgb_array"`` for scenarios with pictures.
    by_agent
        Whether observations have a row for the state of each agent.

    Raises
    ------
    ValueError
        If `steps` or `render_mode` is not allowed, or the scenario has a leader.

    Examples
    --------
    >>> from nested_agents.scenarios import SCENARIOS
    >>> env = AgentsEnv(SCENARIOS.parsed("line-up").build(), steps=3)
    >>> observations, _ = env.reset(seed=0)
    >>> sorted(observations), env.action_space("cart1")
    (['cart1', 'cart2'], Discrete(4))
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        steps: int,
        players: Players = "agents",
        render_mode: str | None = None,
        by_agent: bool = False,
    ) -> None:
        modes = ["rgb_array"] if isinstance(scenario, Rendered) else []
        if steps < 1:
            raise ValueError(f"steps = {steps}, must be at least 1")
        if render_mode not in (None, *modes):
            raise ValueError(f"render_mode = {render_mode!r}, allowed None, {modes}")
        if options_of(scenario) is not None:
            raise ValueError("scenario.leader: a leader is part of a team, allowed: none")
        self.metadata = {
            "name": "nested_agents_v0",
            "render_modes": modes,
            "render_fps": 2,
            "is_parallelizable": True,
        }
        self.scenario = scenario
        self.steps = steps
        self.render_mode = render_mode
        self._recorder: EpisodeRecorder | None = None
        self.members = players_of(scenario, players)
        self._places = {
            name: observed_places(scenario, members, by_agent=by_agent)
            for name, members in self.members.items()
        }
        bounds = scenario.state_space.bounds.astype(np.float32)
        n_actions = len(scenario.action_set)
        self.observation_spaces: dict[str, Box] = {}
        self.action_spaces: dict[str, Discrete | MultiDiscrete] = {}
        for name, members in self.members.items():
            low, high = np.moveaxis(bounds[self._places[name] % len(bounds)], -1, 0)
            self.observation_spaces[name] = Box(low, high, dtype=np.float32)
            several = MultiDiscrete([n_actions] * len(members))
            self.action_spaces[name] = Discrete(n_actions) if len(members) == 1 else several
        self.possible_agents = list(self.members)
        self.agents: list[str] = []
        self._seeds = np.random.default_rng()
        self._episode = -1
        self._step = 0

    def observation_space(self, agent: str) -> Box:
        """Return the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Discrete | MultiDiscrete:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: Options = None) -> tuple[Observations, Infos]:
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
        if self.render_mode is not None and isinstance(self.scenario, Rendered):
            self._recorder = EpisodeRecorder(self.scenario)
        return self._observe(states, measurements_of(self.scenario))

    def step(
        self, actions: Mapping[str, int | IntArray]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Execute one action of every agent.

        Returns
        -------
        tuple
            Observations, rewards, terminations, truncations and infos by agent; all empty after the
            end of an episode, as in PettingZoo.

        Raises
        ------
        ValueError
            If an action is missing, unknown or not in its space; one line.
        """
        if not self.agents:
            return {}, {}, {}, {}, {}
        if set(actions) != set(self.agents):
            missing = [name for name in self.agents if name not in actions]
            problem = f"{missing[0]!r} is missing" if missing else "some are unknown"
            raise ValueError(f"step: actions of {list(actions)}: {problem}; agents: {self.agents}")
        joint = np.empty(len(self.scenario.agents), dtype=np.int64)
        for name in self.agents:
            members = self.members[name]
            own = [self.scenario.agents[i] for i in members]
            joint[members] = checked_action(actions[name], self.action_spaces[name], own)
        transition = self.scenario.step(joint)
        self._step += 1
        if self._recorder is not None:
            self._recorder.add(transition)
        is_late = self._step >= self.steps and not transition.terminated
        observations, infos = self._observe(transition.states, transition.info)
        paid = transition.reward
        rewards = {
            name: float(paid if np.ndim(paid) == 0 else np.mean(np.take(paid, self.members[name])))
            for name in self.agents
        }
        ends = dict.fromkeys(self.agents, transition.terminated)
        breaks = dict.fromkeys(self.agents, transition.truncated or is_late)
        if transition.terminated or transition.truncated or is_late:
            self.agents = []
        return observations, rewards, ends, breaks, infos

    def _observe(
        self, states: FloatArray, measured: Mapping[str, object]
    ) -> tuple[Observations, Infos]:
        """Return observations and infos of the present agents, without times."""
        flat = states.astype(np.float32).ravel()
        observations = {name: flat[self._places[name]] for name in self.agents}
        infos = {
            name: {
                key: value.copy() if isinstance(value, np.ndarray) else value
                for key, value in measured.items()
                if key != "seconds"
            }
            for name in self.agents
        }
        return observations, infos

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture ``(height, width, 3)`` of the present state; None without a mode.

        Raises
        ------
        RuntimeError
            If `reset` was not called.
        """
        if self.render_mode is None or not isinstance(self.scenario, Rendered):
            return None
        if self._recorder is None:
            raise RuntimeError("render: call reset first")
        return self.scenario.picture(self._recorder.recording())


class JointEnv(gymnasium.Env):
    """A scenario as a Gymnasium environment for all agents together.

    Parameters
    ----------
    scenario
        The scenario.
    **options
        See `AgentsEnv`.

    Examples
    --------
    >>> from nested_agents.scenarios import SCENARIOS
    >>> env = JointEnv(SCENARIOS.parsed("line-up").build(), steps=3)
    >>> env.action_space, env.observation_space.shape
    (MultiDiscrete([4 4]), (4,))
    """

    def __init__(self, scenario: Scenario, **options: Any) -> None:
        self._env = AgentsEnv(scenario, players="team", **options)
        self.metadata = self._env.metadata
        self.scenario = scenario
        self.render_mode = self._env.render_mode
        self.observation_space = self._env.observation_space("single")
        self.action_space = self._env.action_space("single")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, object]]:
        """Start an episode, see `AgentsEnv.reset`; return observation and info."""
        super().reset(seed=seed)
        observations, infos = self._env.reset(seed, options)
        return observations["single"], infos["single"]

    def step(self, action: ArrayLike) -> tuple[FloatArray, float, bool, bool, dict[str, object]]:
        """Return observation, reward, terminated, truncated and info after an action ``(n,)``."""
        self._env.agents = ["single"]  # Gymnasium lets an episode be continued after its end
        actions = {"single": np.asarray(action, dtype=object)}
        observations, rewards, *flags, infos = self._env.step(actions)
        terminated, truncated = (flag["single"] for flag in flags)
        return observations["single"], rewards["single"], terminated, truncated, infos["single"]

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, see `AgentsEnv.render`."""
        return self._env.render()
