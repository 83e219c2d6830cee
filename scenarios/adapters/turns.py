"""A parallel PettingZoo environment in which agents act one after another along a hierarchy.

In a parallel environment all agents act at once, and none knows the actions of the others. Here
agents take turns from the top of a hierarchy down (Section II-D): each observes its own state and
the actions communicated to it, and the environment steps when the last agent has acted.

A transition of an agent reaches from its turn to its next turn, with the reward that ``last`` then
returns. Between the turns of one step, the environment does not change and pays no reward, so a
learner that treats each turn as a step learns little about the agents above.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import cast

import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete, Tuple
from gymnasium.spaces.utils import flatten_space
from pettingzoo import ParallelEnv
from pettingzoo.utils import AgentSelector
from pettingzoo.utils.conversions import parallel_to_aec_wrapper

from ...core.hierarchy.failures import AbsentAgents, LeftAgents, MessageFailure
from ...core.hierarchy.hierarchy import Hierarchy
from ...core.hierarchy.messages import Messages
from ...core.numerics import FloatArray, IntArray
from ..environments import checked_action
from ..library_types import Data, Options, Space
from .simulators import Player


class TurnBasedEnv(parallel_to_aec_wrapper):
    """A PettingZoo AEC environment in which agents act from the top of a hierarchy down.

    An observation is that of `env`, followed by one entry for every action of every agent in the
    order of ``env.possible_agents``: 1 for the actions that were communicated in this step, else 0.
    Observations of `env` change, and rewards are paid, when the last agent has acted.

    Parameters
    ----------
    env
        Parallel environment with flat Box observations and Discrete or MultiDiscrete actions.
    hierarchy
        Hierarchy of its possible agents. By default a chain in their order.
    failures
        Failures of messages by episode and step, as in a ``[topology]`` table. They require that
        all agents have the same Discrete actions. Their random numbers follow from the seed of
        `reset`.

    Raises
    ------
    ValueError
        If the hierarchy has other agents, a space is not supported, or agents should be absent or
        leave.

    Examples
    --------
    >>> from nested_agents.environments import parallel
    >>> env = TurnBasedEnv(parallel("box-pushing", robots=1))
    >>> env.reset(seed=0)
    >>> env.agent_selection, env.observe("robot1.right")[-8:].tolist()
    ('robot1.left', [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    >>> env.step(2)
    >>> env.agent_selection, env.observe("robot1.right")[-8:].tolist()
    ('robot1.right', [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    """

    terminations: dict[Player, bool]
    truncations: dict[Player, bool]

    def __init__(
        self,
        env: ParallelEnv[str, Data, Data],
        hierarchy: Hierarchy | None = None,
        failures: Sequence[MessageFailure] = (),
    ) -> None:
        names = list(env.possible_agents)
        hierarchy = hierarchy or Hierarchy(names, pairwise(names))
        if set(hierarchy.agents) != set(names):
            raise ValueError(
                f"hierarchy: agents {', '.join(hierarchy.agents)}, allowed: {', '.join(names)}"
            )
        super().__init__(env)
        self.hierarchy = hierarchy
        self._order = [hierarchy.agents[i] for i in hierarchy.order]
        self._index = {name: i for i, name in enumerate(hierarchy.agents)}
        self._n_actions = {name: _action_counts(name, env.action_space(name)) for name in names}
        self._spaces = {name: self._space(name) for name in names}
        counts = {tuple(counts.tolist()) for counts in self._n_actions.values()}
        common = next(iter(counts)) if len(counts) == 1 else ()
        if failures and len(common) != 1:
            raise ValueError("failures: agents have different actions, allowed: the same Discrete")
        for k, failure in enumerate(failures):
            if isinstance(failure, AbsentAgents | LeftAgents):
                raise ValueError(
                    f"failures[{k}].kind = {failure.kind!r}: agents keep their turns, allowed: "
                    "lost, delayed, noisy"
                )
        self._messages = Messages(hierarchy, failures, n_actions=sum(common))
        self._seed = 0
        self._episode = -1

    def _space(self, name: str) -> Box:
        own = self.env.observation_space(name)
        if not isinstance(own, Box) or len(own.shape) != 1:
            raise ValueError(f"observations of {name!r}: {own}, allowed: a Box of one dimension")
        received = sum(int(counts.sum()) for counts in self._n_actions.values())
        return cast(Box, flatten_space(Tuple((own, Box(0, 1, (received,), own.dtype)))))

    def observation_space(self, agent: str) -> Box:
        """Return the space of an agent's observations."""
        return self._spaces[agent]

    def reset(self, seed: int | None = None, options: Options = None) -> None:
        """Start an episode; the agent at the top of the hierarchy acts first."""
        super().reset(seed=seed, options=options)
        if seed is not None:
            self._seed = seed
            self._episode = -1
        self._episode += 1
        self._messages.reset(np.random.SeedSequence([self._seed, self._episode]), self._episode)
        self._begin_step()

    def _begin_step(self) -> None:
        self._actions = dict.fromkeys(self.agents)
        self._inboxes: dict[str, dict[str, Data]] = {}
        waiting = [name for name in self._order if name in self.env.agents]
        if waiting:
            self._agent_selector = AgentSelector(waiting)
            self.agent_selection = self._agent_selector.reset()

    def _deads_step_first(self) -> Data:
        # PettingZoo calls this method after the environment has stepped.
        if self._messages.failures:
            self._messages.advance(self._joint())
        self._begin_step()
        return super()._deads_step_first()

    def observe(self, agent: str) -> FloatArray:
        """Return the observation of an agent and the actions communicated to it so far."""
        own = self._observations[agent]
        received = self._received(agent)
        parts = [own]
        for name, counts in self._n_actions.items():
            part = np.zeros(int(counts.sum()))
            if name in received:
                part[np.cumsum(counts) - counts + received[name]] = 1.0
            parts.append(part)
        return np.concatenate(parts).astype(own.dtype)

    def _joint(self) -> IntArray:
        """Return the actions decided so far in this step ``(n,)``; 0 for undecided agents."""
        actions = [self._actions.get(name) for name in self.hierarchy.agents]
        return np.array([0 if action is None else action for action in actions], dtype=np.int64)

    def _received(self, agent: str) -> dict[str, Data]:
        """Return the actions communicated to an agent, by sender."""
        index = self._index[agent]
        names = self.hierarchy.agents
        if not self._messages.failures:
            above = [names[i] for i in self.hierarchy.senders(index)]
            return {name: a for name in above if (a := self._actions.get(name)) is not None}
        if agent == self.agent_selection and agent not in self._inboxes:
            senders, actions, _ = self._messages.received(index, self._joint())
            inbox = zip(senders.tolist(), actions.tolist(), strict=True)
            self._inboxes[agent] = {names[i]: a for i, a in inbox if names[i] in self._actions}
        return self._inboxes.get(agent, {})

    def step(self, action: Data) -> None:
        """Communicate the action of the selected agent; the last action steps the environment.

        As in PettingZoo, an agent that is done takes the action None and leaves.

        Raises
        ------
        ValueError
            If the action is not in the agent's action space.
        """
        agent = self.agent_selection
        is_done = self.terminations[agent] or self.truncations[agent]
        if not is_done:
            names = [agent] * len(self._n_actions[agent])
            action = checked_action(action, self.action_space(agent), names)
        super().step(action)


def _action_counts(name: str, space: Space) -> IntArray:
    """Return the number of choices of each of an agent's actions ``(k,)``."""
    if isinstance(space, Discrete) and space.start == 0:
        return np.array([space.n])
    if isinstance(space, MultiDiscrete) and space.nvec.ndim == 1 and not space.start.any():
        return space.nvec
    raise ValueError(f"actions of {name!r}: {space}, allowed: Discrete or MultiDiscrete from 0")
