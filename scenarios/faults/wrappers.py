"""Wrappers that put faults into any Gymnasium environment and any PettingZoo parallel one.

Examples
--------
From episode 3 on, the motor of a pendulum does a third of what it is commanded.

>>> import numpy as np
>>> from nested_agents.scenarios.faults.actuators import Weak
>>> env = FaultyEnv(gymnasium.make("Pendulum-v1"), [Weak(actuators=0, gain=0.33, episode=3)])
>>> _ = env.reset(seed=0, options={"fault_episode": 3})
>>> env.step(np.array([2.0], dtype=np.float32))[4], env.carried
({}, array([0.66], dtype=float32))
"""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
from pettingzoo.utils import BaseParallelWrapper

from .actuators import ActuatorFault
from .carried import Carried, Commands, Mechanism


class FaultyEnv(gymnasium.Wrapper):
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
        What actions command; see `nested_agents.scenarios.faults.carried`.
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

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        faults: Sequence[ActuatorFault],
        *,
        seed: int = 0,
        commands: Commands = "effort",
        rest: Any = None,
        mechanism: Mechanism | None = None,
        inform: bool = False,
    ) -> None:
        super().__init__(env)
        spaces = {"": env.action_space}
        self._carrier = Carried(spaces, faults, seed, commands, {"": rest}, mechanism)
        self.actuators = self._carrier.names
        self._inform = inform
        self.carried: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode of the environment beneath."""
        left = self._carrier.reset(seed, options)
        return self.env.reset(seed=seed, options=left)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Do what faulty actuators make of an action."""
        self.carried = self._carrier.carry({"": action}, self.env)[""]
        seen, reward, terminated, truncated, info = self.env.step(self.carried)
        if self._inform:
            info = {**info, "faults": self._carrier.now(), "carried": self.carried}
        return seen, reward, terminated, truncated, info


class FaultyParallelEnv(BaseParallelWrapper):
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

    def __init__(
        self,
        env: Any,
        faults: Sequence[ActuatorFault],
        *,
        seed: int = 0,
        commands: Commands = "effort",
        rest: Mapping[str, Any] | None = None,
        mechanism: Mechanism | None = None,
        inform: bool = False,
    ) -> None:
        super().__init__(env)
        spaces = {agent: env.action_space(agent) for agent in env.possible_agents}
        self._carrier = Carried(spaces, faults, seed, commands, rest or {}, mechanism)
        self.actuators = self._carrier.names
        self._inform = inform
        self.carried: dict[str, Any] = {}

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Start an episode of the environment beneath."""
        left = self._carrier.reset(seed, options)
        seen, infos = self.env.reset(seed=seed, options=left)
        return seen, infos

    def step(self, actions: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
        """Do what faulty actuators make of the agents' actions."""
        self.carried = self._carrier.carry(actions, self.env)
        *given, infos = self.env.step(self.carried)
        if self._inform:
            now = self._carrier.now()
            infos = {
                agent: {
                    **info,
                    "faults": {n: k for n, k in now.items() if n.rpartition(".")[0] == agent},
                    "carried": self.carried.get(agent),
                }
                for agent, info in infos.items()
            }
        return (*given, infos)
