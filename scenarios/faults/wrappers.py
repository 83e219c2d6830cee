"""Faults of the actuators of any Gymnasium environment and any PettingZoo parallel one.

The kinds are those of `nested_agents.scenarios.faults.settings`; what is added is the field that
names actuators. A fault names them by pattern, ``"0"``, ``"walker_0.*"``, or by number. The policy
is not informed of it.

What an action commands decides what a fault can do to it. An *effort*, such as a torque, is zero at
a free actuator, but none holds a joint; a *velocity* is zero at a seized one, but none lets it
coast; a *position* is held by a seized one, and none gives way. What an action cannot express is
left to a `Mechanism`, or refused.

Actions of any Box or Discrete space are numbers along a scale. Each entry of a Box is an actuator,
whose scale is that of the action. Each discrete choice is one, too: its actions are taken to be in
order along a scale, as left, none, right are, with rest in the middle. What a fault makes of them
may lie between two actions; then one of these is drawn, with the probabilities whose mean is the
place between.

Examples
--------
From episode 3 on, the motor of a pendulum does a third of what it is commanded.

>>> import numpy as np
>>> from nested_agents.scenarios.faults.wrappers import Weak
>>> env = FaultyEnv(gymnasium.make("Pendulum-v1"), [Weak(actuators=0, gain=0.33, episode=3)])
>>> _ = env.reset(seed=0, options={"fault_episode": 3})
>>> env.step(np.array([2.0], dtype=np.float32))[4], env.carried
({}, array([0.66], dtype=float32))
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from numpy.typing import ArrayLike
from pettingzoo.utils import BaseParallelWrapper

from ...core.numerics import BoolArray, FloatArray
from ...core.plugins.settings import Names
from . import settings
from .settings import Failures, FailureSettings, build_kinds


class ActuatorFault(FailureSettings):
    """From when to when actuators are faulty, see `nested_agents.scenarios.faults.settings`."""

    part: ClassVar[str] = "actuators"

    actuators: Names
    """Actuators by name, pattern or number, one or a list."""
    kind: str = ""
    """What is wrong with them."""


KINDS = build_kinds(ActuatorFault, **settings.KINDS)
"""The kinds of fault by name."""
Seized, Free, Weak, Reversed, Stuck, Delayed, Noisy = KINDS.values()


def limits_of(space: gymnasium.Space[Any], name: str) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest value ``(k,)`` of each entry of a space's actions.

    Raises
    ------
    ValueError
        If the space, called by its name, is of another kind or is not bounded; one line.
    """
    if isinstance(space, Box) and space.is_bounded():
        return space.low.ravel(), space.high.ravel()
    if isinstance(space, Discrete | MultiDiscrete):
        counts = space.n if isinstance(space, Discrete) else space.nvec
        return np.ravel(space.start), np.ravel(space.start) + np.ravel(counts) - 1
    raise ValueError(
        f"{name}: {space}, allowed: Box, Discrete or MultiDiscrete, of finite bounds; where it has "
        "none, wrap it in RescaleAction or ClipAction"
    )


class ActionScale:
    """The actuators that an action space has, each with its scale.

    Parameters
    ----------
    space
        The action space: a bounded Box, Discrete or MultiDiscrete.
    rest
        The action in which actuators rest; None: 0 where a Box has it, else the middle.
    name
        What the space is called in complaints.

    Attributes
    ----------
    limits
        ``(k,)`` how far from rest each scale reaches.

    Raises
    ------
    ValueError
        If the space is of another kind, is not bounded or does not hold `rest`; one line.

    Examples
    --------
    >>> scale = ActionScale(Discrete(3))
    >>> [float(scale.place(action)[0]) for action in range(3)]
    [-1.0, 0.0, 1.0]
    >>> int(scale.action(np.array([-0.2]), 2, np.array([True]), np.array([0.1])))
    1
    """

    def __init__(
        self, space: gymnasium.Space[Any], rest: ArrayLike | None = None, name: str = "action space"
    ) -> None:
        self.space = space
        self._low, self._high = (ends.astype(float) for ends in limits_of(space, name))
        if rest is None:
            has_zero = isinstance(space, Box) & (self._low <= 0) & (self._high >= 0)
            self._rest = np.where(has_zero, 0.0, (self._low + self._high) / 2)
        elif space.contains(rest):
            self._rest = np.ravel(rest).astype(float)
        else:
            raise ValueError(f"rest = {rest!r}: no action of {space}")
        self.limits: FloatArray = np.maximum(self._high - self._rest, self._rest - self._low)

    def place(self, action: ArrayLike) -> FloatArray:
        """Return where an action lies from rest, ``(k,)``."""
        return np.ravel(action).astype(float) - self._rest

    def action(
        self, place: FloatArray, chosen: object, changed: BoolArray, drawn: FloatArray
    ) -> Any:
        """Return the action at a place.

        Parameters
        ----------
        place
            ``(k,)`` from rest; what is out of bounds is cut.
        chosen
            The action that was chosen; of its entries remain those that are not `changed`.
        changed
            ``(k,)`` which do not.
        drawn
            ``(k,)`` uniform random numbers for what lies between two actions.
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
        action.ravel()[changed] = values[changed].astype(action.dtype)
        return action[()]  # a number, not an array, of Discrete


Commands = Literal["effort", "velocity", "position"]
"""What actions command."""
Mechanism = Callable[[Any, dict[str, str]], None]
"""Is called before every step with the environment beneath and the faults that no action expresses,
kinds by actuator, as long as there are some, and once more when there are none."""

INEXPRESSIBLE: Mapping[Commands, str] = {"effort": "seized", "velocity": "free", "position": "free"}
"""What no action expresses, by what actions command."""


class _Faulty(ABC):
    """An environment under a schedule of faults; inherited beside a library's wrapper.

    Its actuators are those of one or more action spaces, by the prefix of their names. Noise and
    draws follow from `seed`, the seed of the environment, and the number of the episode.

    Raises
    ------
    ValueError
        If a fault names no actuator, or cannot be expressed.
    """

    env: Any
    """The environment beneath."""

    def __init__(
        self,
        env: Any,
        faults: Sequence[ActuatorFault],
        *,
        seed: int = 0,
        commands: Commands = "effort",
        rest: object = None,
        mechanism: Mechanism | None = None,
        inform: bool = False,
    ) -> None:
        self._wrap(env)
        if commands not in INEXPRESSIBLE:
            raise ValueError(f"commands = {commands!r}, allowed: {', '.join(INEXPRESSIBLE)}")
        for i, fault in enumerate(faults):
            if fault.kind == INEXPRESSIBLE[commands] and mechanism is None:
                raise ValueError(
                    f"faults[{i}]: no {commands} makes an actuator {fault.kind}; give a "
                    f"mechanism that does, or say what else actions command"
                )
        self._parts: dict[str, tuple[ActionScale, slice]] = {}
        names: list[str] = []
        for prefix, scale in self._scales(env, rest).items():
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
        self.carried: Any = None
        self._begin(0, 0)

    @abstractmethod
    def _wrap(self, env: Any) -> None:
        """Let the library's wrapper begin."""

    @abstractmethod
    def _scales(self, env: Any, rest: Any) -> dict[str, ActionScale]:
        """Return the scales of an environment's action spaces by the prefix of their actuators."""

    def reset(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> Any:
        """Start an episode of the environment beneath; a seed starts their count afresh.

        The option ``fault_episode`` sets the number of the episode, by which faults are scheduled.
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

    def _carry(self, actions: Mapping[str, ArrayLike]) -> dict[str, Any]:
        """Return what is carried out of the actions of one step, by prefix.

        Spaces whose action is missing rest.
        """
        self._failures.strike(self._step)
        self._step += 1
        places = np.zeros(len(self.actuators))
        for prefix, action in actions.items():
            scale, span = self._parts[prefix]
            places[span] = scale.place(action)
        drawn = self._rng.random(len(places))  # as many whatever fails: runs stay paired
        driven = self._failures.driven(places, 1)[0]
        changed = self._failures.failed
        for fault, mask in self._failures.active():
            if fault.kind == "free":
                driven[mask] = 0.0
            elif fault.kind == "seized" and self._commands == "position":
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
        """Return the kind of the fault of every actuator that has one; of several, the last."""
        return {
            self.actuators[i]: fault.kind
            for fault, mask in self._failures.active()
            for i in np.flatnonzero(mask)
        }


class FaultyEnv(_Faulty, gymnasium.Wrapper):
    """A Gymnasium environment whose actuators fail as scheduled, without the policy being informed.

    Its worlds are those of the environment beneath, seed by seed, whatever fails. Steps and
    episodes are counted from 0; `reset` with a seed counts episodes afresh, and its option
    ``fault_episode`` sets their number.

    Parameters
    ----------
    env
        With bounded Box, Discrete or MultiDiscrete actions. Its actuators are called ``0``, ``1``
        and so on.
    faults
        When which actuator fails, and how.
    seed
        Of the noise of faults, beside the seed of the environment.
    commands
        What actions command; see `Commands`.
    rest
        The action in which actuators rest; None: 0 where they can, else the middle of their range.
    mechanism
        What does to the environment what no action can.
    inform
        Whether ``info`` has the kinds of fault by actuator under ``faults``, and what was done
        under ``carried``.

    Attributes
    ----------
    actuators
        Names of the actuators.
    carried
        The last action that was done.

    Raises
    ------
    ValueError
        If a fault names no actuator or cannot be expressed, or the actions are of another kind.
    """

    def _wrap(self, env: Any) -> None:
        gymnasium.Wrapper.__init__(self, env)

    def _scales(self, env: Any, rest: Any) -> dict[str, ActionScale]:
        return {"": ActionScale(env.action_space, rest)}

    def step(self, action: ArrayLike) -> tuple[Any, Any, bool, bool, dict[str, object]]:
        """Do what faulty actuators make of an action."""
        self.carried = self._carry({"": action})[""]
        seen, reward, terminated, truncated, info = self.env.step(self.carried)
        if self._inform:
            info = {**info, "faults": self._now(), "carried": self.carried}
        return seen, reward, terminated, truncated, info


class FaultyParallelEnv(_Faulty, BaseParallelWrapper):
    """A PettingZoo parallel environment whose actuators fail as scheduled; see `FaultyEnv`.

    Parameters
    ----------
    env
        Its actuators are called ``AGENT.0``, ``AGENT.1`` and so on; ``AGENT.*`` names all of one.
    faults, seed, commands, mechanism, inform
        As of `FaultyEnv`; an agent's ``info`` has its own alone.
    rest
        By agent, the action in which its actuators rest.

    Attributes
    ----------
    actuators
        Names of the actuators.
    carried
        The last actions that were done, by agent.
    """

    def _wrap(self, env: Any) -> None:
        BaseParallelWrapper.__init__(self, env)

    def _scales(self, env: Any, rest: Any) -> dict[str, ActionScale]:
        rests = rest or {}
        return {
            agent: ActionScale(env.action_space(agent), rests.get(agent), f"action space {agent}")
            for agent in env.possible_agents
        }

    def step(self, actions: Mapping[str, ArrayLike]) -> tuple[dict[str, Any], ...]:
        """Do what faulty actuators make of the agents' actions."""
        self.carried = self._carry(actions)
        *given, infos = self.env.step(self.carried)
        if self._inform:
            now = self._now()
            infos = dict(infos)
            for agent, info in infos.items():
                own = {name: kind for name, kind in now.items() if name.rpartition(".")[0] == agent}
                infos[agent] = {**info, "faults": own, "carried": self.carried.get(agent)}
        return (*given, infos)
