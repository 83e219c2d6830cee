"""The passing down as turns: a PettingZoo AEC environment in the order of a hierarchy.

In a parallel environment all agents act at once, and none knows what another does. In a hierarchy
they decide from the top down, and each is passed the actions decided above (Section II-D). This is
a turn-based environment of the same world, of any parallel environment with flat Box observations
and discrete actions: agents take turns in hierarchy order, each observes its state and the actions
it was passed, and the world goes on when the last has acted.

Turns are not steps. A learner that takes every turn for a step of one process learns little of the
agents above: their turns bring no reward and leave the world as it is, so that a TD error of one
step is 0, and with traces credit falls by (discount * trace decay) ** turns. Let one transition of
an agent span a joint step: from its turn to its next turn, with the reward that `last` then gives,
which is all that came between.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete, Tuple
from gymnasium.spaces.utils import flatten_space
from pettingzoo import ParallelEnv
from pettingzoo.utils import AgentSelector
from pettingzoo.utils.conversions import parallel_to_aec_wrapper

from ...core.hierarchy.failures import MessageFailure
from ...core.hierarchy.hierarchy import Hierarchy
from ...core.hierarchy.messages import Messages
from ...core.numerics import FloatArray, IntArray
from .simulators import Player, flags_by_agent


class PassingDownEnv(parallel_to_aec_wrapper):
    """A parallel environment whose agents take turns from the top of a hierarchy down.

    An observation is what the agent observes in `env`, and after it the actions that it has been
    passed: one entry for every choice of every agent, in the order of ``env.possible_agents``. It
    is 1 for a choice that an agent above has made in this step, else 0, so agents of equal
    observations can share a policy. Observations of `env` change, and rewards come, when the last
    agent has acted. Who is done leaves before the next step, and passes nothing down.

    Parameters
    ----------
    env
        A PettingZoo parallel environment.
    hierarchy
        Over its possible agents; None: a chain in their order.
    failures
        What fails of the messages by which agents hear what was decided above, by episode and step
        as in a ``[topology]`` table; then all agents must have the same Discrete actions. What is
        random of it follows from the seed of `reset`.

    Attributes
    ----------
    env, hierarchy
        As given.

    Raises
    ------
    ValueError
        If the hierarchy has other agents, or observations or actions are of other kinds; one line.

    Examples
    --------
    >>> from nested_agents.scenarios.box_pushing.environments import WheelsEnv
    >>> env = PassingDownEnv(WheelsEnv({"robots": 1}, steps=3))
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
        env: ParallelEnv[str, Any, Any],
        hierarchy: Hierarchy | None = None,
        failures: Sequence[MessageFailure] = (),
    ) -> None:
        names = list(env.possible_agents)
        hierarchy = hierarchy or Hierarchy(names, pairwise(names))
        if set(hierarchy.agents) != set(names):
            raise ValueError(
                f"hierarchy: agents {', '.join(hierarchy.agents)}, those of the environment are "
                f"{', '.join(names)}"
            )
        super().__init__(env)
        self.hierarchy = hierarchy
        team = hierarchy.agents
        self._order = [team[i] for i in hierarchy.order]
        self._place = {name: i for i, name in enumerate(team)}
        self._choices = {name: _choices(name, env.action_space(name)) for name in names}
        self._spaces = {name: self._space(name) for name in names}
        counts = {tuple(choices.tolist()) for choices in self._choices.values()}
        alike = next(iter(counts)) if len(counts) == 1 else ()
        if failures and len(alike) != 1:
            raise ValueError("failures: messages can fail where all agents have equal actions")
        self._messages = Messages(hierarchy, failures, n_actions=int(sum(alike)))
        self._seed = 0
        self._episode = -1

    def _space(self, name: str) -> Box:
        own = self.env.observation_space(name)
        if not isinstance(own, Box) or len(own.shape) != 1:
            raise ValueError(f"observations of {name!r}: {own}, allowed a Box of one dimension")
        passed = sum(int(choices.sum()) for choices in self._choices.values())
        both = Tuple((own, Box(0, 1, (passed,), own.dtype)))
        return cast(Box, flatten_space(both))

    def observation_space(self, agent: str) -> Box:
        """Return the space of an agent's observations."""
        return self._spaces[agent]

    def reset(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> None:
        """Start an episode; the agent at the top of the hierarchy is the first to act."""
        super().reset(seed=seed, options=options)
        if seed is not None:
            self._seed = seed
            self._episode = -1
        self._episode += 1
        self._messages.begin(np.random.SeedSequence([self._seed, self._episode]), self._episode)
        self._begin_step()

    def _begin_step(self) -> None:
        self._actions = dict.fromkeys(self.agents)
        self._arrived: dict[str, dict[str, Any]] = {}
        waiting = [name for name in self._order if name in self.env.agents]
        if waiting:
            self._agent_selector = AgentSelector(waiting)
            self.agent_selection = self._agent_selector.reset()

    def _deads_step_first(self) -> Any:
        if self._messages.failures:  # PettingZoo calls this when the world has gone on
            self._messages.advance(self._joint())
        self._begin_step()
        self.terminations = flags_by_agent(self.terminations, self.agents)
        self.truncations = flags_by_agent(self.truncations, self.agents)
        return super()._deads_step_first()

    def observe(self, agent: str) -> FloatArray:
        """Return what an agent observes, and the actions that it has been passed so far."""
        own = self._observations[agent]
        heard = self._heard(agent)
        parts = [own]
        for name, choices in self._choices.items():
            part = np.zeros(int(choices.sum()))
            if name in heard:
                part[np.cumsum(choices) - choices + heard[name]] = 1.0
            parts.append(part)
        return np.concatenate(parts).astype(own.dtype)

    def _joint(self) -> IntArray:
        """Return what has been decided ``(n,)`` in this step; 0 of those who have not."""
        decided = [self._actions.get(name) for name in self.hierarchy.agents]
        return np.array([0 if action is None else action for action in decided], dtype=np.int64)

    def _heard(self, agent: str) -> dict[str, Any]:
        """Return the actions that an agent hears of, by whose they are; what fails, at its turn."""
        place = self._place[agent]
        team = self.hierarchy.agents
        if not self._messages.failures:
            above = [team[i] for i in self.hierarchy.senders(place)]
            return {name: a for name in above if (a := self._actions.get(name)) is not None}
        if agent == self.agent_selection and agent not in self._arrived:
            senders, actions, _ = self._messages.heard(place, self._joint())
            there = zip(senders.tolist(), actions.tolist(), strict=True)
            self._arrived[agent] = {team[i]: a for i, a in there if team[i] in self._actions}
        return self._arrived.get(agent, {})

    def step(self, action: Any) -> None:
        """Pass the action of the selected agent down; after the last one the world goes on.

        An agent that is done takes the action None and leaves, as PettingZoo has it.

        Raises
        ------
        ValueError
            If the action is none of the agent's; one line.
        """
        agent = self.agent_selection
        is_done = self.terminations[agent] or self.truncations[agent]
        if not is_done and not self.action_space(agent).contains(action):
            raise ValueError(
                f"step: action {action!r} of {agent}, allowed {self.action_space(agent)}"
            )
        super().step(action)


def _choices(name: str, space: Any) -> Any:
    """Return how many choices each of an agent's actions has ``(k,)``."""
    if isinstance(space, Discrete) and space.start == 0:
        return np.array([space.n])
    if isinstance(space, MultiDiscrete) and space.nvec.ndim == 1 and not space.start.any():
        return space.nvec
    raise ValueError(f"actions of {name!r}: {space}, allowed Discrete or MultiDiscrete from 0")
