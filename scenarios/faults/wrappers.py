"""Faults of actuators for any Gymnasium environment and any parallel PettingZoo environment.

A fault is a kind, an onset and an end, as for the wheels of robots, see
`nested_agents.scenarios.faults.settings`, and names actuators by pattern or number: ``"0"``,
``"walker_0.*"``. The policy is not informed of it.

What an action commands determines which faults it can express. A free actuator has zero *effort*,
such as torque, but no effort holds a seized joint. A seized actuator has zero *velocity*, or holds
its *position*, but neither lets a free joint move. Faults that an action cannot express need a
`Mechanism`.

Each entry of a Box is an actuator. Each discrete choice is an actuator, too; its actions are taken
as ordered along a scale with rest in the middle, such as left, none, right. If a fault places a
command between two discrete actions, one of them is drawn with the probabilities that preserve the
mean.

Examples
--------
From episode 3 on, the motor of a pendulum executes a third of its command.

>>> import numpy as np
>>> from nested_agents.scenarios.faults.wrappers import Weak
>>> env = FaultyEnv(gymnasium.make("Pendulum-v1"), [Weak(actuators=0, gain=0.33, episode=3)])
>>> _ = env.reset(seed=0, options={"fault_episode": 3})
>>> env.step(np.array([2.0], dtype=np.float32))[4], env.carried
({}, array([0.66], dtype=float32))
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from numpy.typing import ArrayLike
from pettingzoo.utils import BaseParallelWrapper

from ...core.numerics import BoolArray, FloatArray
from ...core.plugins.settings import Names
from ..library_types import Data, Environment, Options, Space
from .settings import Failures, FailureSettings, build_kinds


class ActuatorFault(FailureSettings):
    """A fault of actuators with its schedule, see `nested_agents.scenarios.faults.settings`."""

    part: ClassVar[str] = "actuators"

    actuators: Names
    """Names, patterns or numbers of actuators."""
    kind: str = ""
    """Kind of the fault."""


KINDS = build_kinds(ActuatorFault)
"""The kinds of fault by name."""
Seized, Free, Weak, Reversed, Stuck, Delayed, Noisy = KINDS.values()


def action_bounds(space: Space, name: str) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper bounds ``(k,)`` of the entries of an action.

    Raises
    ------
    ValueError
        If the space is of another kind or is not bounded.
    """
    if isinstance(space, Box) and space.is_bounded():
        return space.low.ravel(), space.high.ravel()
    if isinstance(space, Discrete | MultiDiscrete):
        counts = space.n if isinstance(space, Discrete) else space.nvec
        return np.ravel(space.start), np.ravel(space.start) + np.ravel(counts) - 1
    raise ValueError(
        f"{name}: {space}, allowed: Discrete, MultiDiscrete, or Box with finite bounds; "
        "otherwise wrap it in RescaleAction or ClipAction"
    )


class ActionScale:
    """The actuators of an action space, as deviations from rest.

    At rest an entry of a Box is 0 if that is possible, others are in the middle of their range.

    Parameters
    ----------
    space
        The action space: a bounded Box, Discrete or MultiDiscrete.
    name
        Name of the space in error messages.

    Attributes
    ----------
    limits
        ``(k,)`` maximum deviations from rest.

    Raises
    ------
    ValueError
        If the space is of another kind or unbounded.

    Examples
    --------
    >>> scale = ActionScale(Discrete(3))
    >>> [float(scale.place(action)[0]) for action in range(3)]
    [-1.0, 0.0, 1.0]
    >>> int(scale.action(np.array([-0.2]), 2, np.array([True]), np.array([0.1])))
    1
    """

    def __init__(self, space: Space, name: str = "action space") -> None:
        self.space = space
        self._low, self._high = (ends.astype(float) for ends in action_bounds(space, name))
        has_zero = isinstance(space, Box) & (self._low <= 0) & (self._high >= 0)
        self._rest = np.where(has_zero, 0.0, (self._low + self._high) / 2)
        self.limits: FloatArray = np.maximum(self._high - self._rest, self._rest - self._low)

    def place(self, action: ArrayLike) -> FloatArray:
        """Return the deviations of an action from rest ``(k,)``."""
        return np.ravel(action).astype(float) - self._rest

    def action(
        self, place: FloatArray, chosen: object, changed: BoolArray, drawn: FloatArray
    ) -> Data:
        """Return the action with given deviations from rest.

        Parameters
        ----------
        place
            ``(k,)`` deviations, clipped to the bounds.
        chosen
            The chosen action, from which unchanged entries are taken.
        changed
            ``(k,)`` mask of the entries that a fault changes.
        drawn
            ``(k,)`` uniform random numbers that decide between two discrete actions.
        """
        if not changed.any():
            return chosen
        values = np.clip(self._rest + place, self._low, self._high)
        if not isinstance(self.space, Box):
            below = np.floor(values + 1e-12)
            values = below + (drawn < values - below)
        elif np.issubdtype(self.space.dtype, np.integer):
            values = np.rint(values)
        action = np.array(chosen, dtype=self.space.dtype)
        action.flat[np.flatnonzero(changed)] = values[changed].astype(action.dtype)
        return action[()]  # Discrete actions are numbers, not arrays


Commands = Literal["effort", "velocity", "position"]
"""Physical meaning of actions."""
Mechanism = Callable[[Environment, dict[str, str]], None]
"""Function that applies the faults that no action can express. It is called before each step with
the wrapped environment and the kinds of these faults by actuator, and once when the last ends."""

INEXPRESSIBLE: Mapping[Commands, str] = {"effort": "seized", "velocity": "free", "position": "free"}
"""Kind of fault that no action can express, by the meaning of actions."""


class _Faulty:
    """Base class of the wrappers: an environment with scheduled faults.

    Names of actuators begin with the prefix of their action space. Random numbers follow from
    `seed`, the seed of the environment, and the number of the episode.

    Raises
    ------
    ValueError
        If a fault names no actuator, or cannot be expressed.
    """

    env: Environment
    """The wrapped environment."""

    def __init__(
        self,
        scales: Mapping[str, ActionScale],
        faults: Sequence[ActuatorFault],
        *,
        seed: int = 0,
        commands: Commands = "effort",
        mechanism: Mechanism | None = None,
        inform: bool = False,
    ) -> None:
        if commands not in INEXPRESSIBLE:
            raise ValueError(f"commands = {commands!r}, allowed: {', '.join(INEXPRESSIBLE)}")
        for i, fault in enumerate(faults):
            if fault.kind == INEXPRESSIBLE[commands] and mechanism is None:
                raise ValueError(
                    f"faults[{i}].kind = {fault.kind!r}: no {commands} can express it; give "
                    "a mechanism, or other commands"
                )
        self._parts: dict[str, tuple[ActionScale, slice]] = {}
        names: list[str] = []
        for prefix, scale in scales.items():
            self._parts[prefix] = scale, slice(len(names), len(names) + len(scale.limits))
            names += [f"{prefix}.{i}" if prefix else str(i) for i in range(len(scale.limits))]
        self.actuators = tuple(names)
        limits = np.concatenate([scale.limits for scale, _ in self._parts.values()])
        self._failures = Failures(faults, self.actuators, limits, "faults")
        self._commands = commands
        self._mechanism = mechanism
        self._seed = seed
        self._inform = inform
        self._hooked = False
        self.carried: Data = None
        self._begin(0, 0)

    def reset(self, seed: int | None = None, options: Options = None) -> Data:
        """Start an episode; a seed resets the episode count.

        The option ``fault_episode`` sets the number of the episode, which schedules faults.
        """
        left = dict(options or {})
        if seed is not None:
            self._world = seed
            self._episode = -1
        self._begin(self._world, int(left.pop("fault_episode", self._episode + 1)))
        return self.env.reset(seed=seed, options=left or None)

    def _begin(self, world: int, episode: int) -> None:
        self._world = world
        self._episode = episode
        self._step = 0
        root = np.random.SeedSequence([self._seed, world, episode])
        self._failures.begin(root, episode)
        self._rng = np.random.default_rng(root)
        self._held = np.zeros(len(self.actuators))

    def _carry(self, actions: Mapping[str, ArrayLike]) -> dict[str, Data]:
        """Return the executed actions of one step by prefix; missing actions are at rest."""
        self._failures.strike(self._step)
        self._step += 1
        places = np.zeros(len(self.actuators))
        for prefix, action in actions.items():
            scale, span = self._parts[prefix]
            places[span] = scale.place(action)
        # The count of draws does not depend on faults, so that runs stay paired.
        drawn = self._rng.random(len(places))
        driven = self._failures.driven(places, 1)[0]
        changed = self._failures.failed
        for fault, mask in self._failures.active():
            if fault.effect == "free":
                driven[mask] = 0.0
            elif fault.effect == "seized" and self._commands == "position":
                driven[mask] = self._held[mask]
        self._held = np.where(changed, driven, places)
        beyond = INEXPRESSIBLE[self._commands]
        unexpressed = {name: kind for name, kind in self._now().items() if kind == beyond}
        if self._mechanism is not None and (unexpressed or self._hooked):
            self._mechanism(self.env, unexpressed)
        self._hooked = bool(unexpressed)
        carried = {}
        for prefix, action in actions.items():
            scale, span = self._parts[prefix]
            carried[prefix] = scale.action(driven[span], action, changed[span], drawn[span])
        return carried

    def _now(self) -> dict[str, str]:
        """Return the kind of fault of every failed actuator; the last one of several."""
        return {
            self.actuators[i]: fault.effect
            for fault, mask in self._failures.active()
            for i in np.flatnonzero(mask)
        }


class FaultyEnv(_Faulty, gymnasium.Wrapper):
    """Wrapper of a Gymnasium environment with scheduled faults of its actuators.

    Faults do not change the initial states that a seed gives. Steps and episodes are counted from
    0; `reset` with a seed resets the episode count, and its option ``fault_episode`` sets it.

    Parameters
    ----------
    env
        Environment with bounded Box, Discrete or MultiDiscrete actions. Its actuators are named
        ``0``, ``1`` and so on.
    faults
        The faults and their schedule.
    seed
        Seed of the noise of faults, in addition to that of the environment.
    commands
        Physical meaning of actions, see `Commands`.
    mechanism
        Function that applies the faults that no action can express.
    inform
        Whether ``info`` has the kind of fault by actuator under ``faults`` (of several, the last
        one), and the executed action under ``carried``.

    Attributes
    ----------
    actuators
        Names of the actuators.
    carried
        The last executed action.

    Raises
    ------
    ValueError
        If a fault names no actuator or cannot be expressed, or the action space is not supported.
    """

    def __init__(
        self,
        env: Environment,
        faults: Sequence[ActuatorFault],
        **options: Any,
    ) -> None:
        gymnasium.Wrapper.__init__(self, env)
        _Faulty.__init__(self, {"": ActionScale(env.action_space)}, faults, **options)

    def step(self, action: ArrayLike) -> tuple[Data, Data, bool, bool, dict[str, object]]:
        """Execute an action with faulty actuators."""
        self.carried = self._carry({"": action})[""]
        seen, reward, terminated, truncated, info = self.env.step(self.carried)
        if self._inform:
            info = {**info, "faults": self._now(), "carried": self.carried}
        return seen, reward, terminated, truncated, info


class FaultyParallelEnv(_Faulty, BaseParallelWrapper):
    """Wrapper of a parallel PettingZoo environment with scheduled faults, see `FaultyEnv`.

    Parameters
    ----------
    env
        Environment. Its actuators are named ``AGENT.0``, ``AGENT.1`` and so on; ``AGENT.*`` matches
        all actuators of an agent.
    faults, seed, commands, mechanism, inform
        As in `FaultyEnv`; the ``info`` of an agent has only its own faults.

    Attributes
    ----------
    actuators
        Names of the actuators.
    carried
        The last executed actions, by agent.
    """

    def __init__(
        self,
        env: Environment,
        faults: Sequence[ActuatorFault],
        **options: Any,
    ) -> None:
        BaseParallelWrapper.__init__(self, env)
        scales = {
            agent: ActionScale(env.action_space(agent), f"action space {agent}")
            for agent in env.possible_agents
        }
        _Faulty.__init__(self, scales, faults, **options)

    def step(self, actions: Mapping[str, ArrayLike]) -> tuple[dict[str, Data], ...]:
        """Execute the agents' actions with faulty actuators."""
        self.carried = self._carry(actions)
        *given, infos = self.env.step(self.carried)
        if self._inform:
            now = self._now()
            infos = dict(infos)
            for agent, info in infos.items():
                own = {name: kind for name, kind in now.items() if name.rpartition(".")[0] == agent}
                infos[agent] = {**info, "faults": own, "carried": self.carried.get(agent)}
        return (*given, infos)
