"""
Islands that share a radio channel
==================================

The task Aloha of the benchmark MACO (T. Wang et al. 2022) as a parallel environment of PettingZoo,
written anew from its rules. The last function makes it a scenario of specs, see ``aloha.toml``.

Islands stand in two rows. In every step each switches its radio on or leaves it off. A message is
sent if no neighbor's radio is on; else it collides, stays in the backlog, and costs a hundred
times what it would have brought. A radio disturbs the neighbors also where there is nothing to be
sent. All islands receive the team's reward, and see their own backlog alone.

Departures. In the benchmark's public code islands 5 and 6, at opposite ends of the two rows, are
neighbors, too; here they are not. An episode is truncated by its limit; there it is terminated.
Its agents remember what they saw (recurrent networks); what agents here see is this observation.
"""

import numpy as np
from gymnasium.spaces import Discrete
from pettingzoo import ParallelEnv

import nested_agents as na


class Aloha(ParallelEnv):
    """Islands that have messages to send; actions are 0, off, and 1, on."""

    metadata = {"name": "aloha_v0", "render_modes": ()}  # noqa: RUF012 - as PettingZoo has it

    def __init__(self, rows=2, columns=5, steps=20, most=5, arrival=0.6, sent=0.1, collided=-10.0):
        places = np.array([(row, column) for row in range(rows) for column in range(columns)])
        self.near = np.abs(places[:, None] - places).sum(-1) == 1  # above, below, left, right
        self.steps, self.most, self.arrival = steps, most, arrival
        self.sent, self.collided = sent, collided
        self.possible_agents = [f"island{i + 1}" for i in range(len(places))]
        self._backlogs, self._radio = Discrete(most + 1), Discrete(2)

    def observation_space(self, agent):
        """Return that an island sees its backlog."""
        return self._backlogs

    def action_space(self, agent):
        """Return the two states of a radio."""
        return self._radio

    def reset(self, seed=None, options=None):
        """Give every island one message."""
        if seed is not None or not hasattr(self, "rng"):
            self.rng = np.random.default_rng(seed)
        self.agents, self.step_count = self.possible_agents[:], 0
        self.backlog = np.ones(len(self.agents), dtype=int)
        return self._observed(), {agent: {} for agent in self.agents}

    def step(self, actions):
        """Send what does not collide; then new messages arrive."""
        on = np.array([actions[agent] for agent in self.agents], dtype=bool)
        trying, disturbed = on & (self.backlog > 0), (self.near & on).any(axis=1)
        sends, collides = trying & ~disturbed, trying & disturbed
        reward = float(self.sent * sends.sum() + self.collided * collides.sum())
        arriving = self.rng.random(len(on)) < self.arrival
        self.backlog = np.minimum(self.backlog - sends + arriving, self.most)
        self.step_count += 1
        agents, is_over = self.agents, self.step_count >= self.steps
        told = (
            self._observed(),
            dict.fromkeys(agents, reward),
            dict.fromkeys(agents, False),
            dict.fromkeys(agents, is_over),
            {agent: {} for agent in agents},
        )
        self.agents = [] if is_over else agents
        return told

    def _observed(self):
        return {a: int(n) for a, n in zip(self.agents, self.backlog, strict=True)}


def aloha(*, predictor: str = "none"):
    """Return the scenario; a success is more than 90 messages sent, and none collided."""
    return na.from_pettingzoo(Aloha, predictor=predictor, success={"return": 9.05})
