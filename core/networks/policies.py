"""PPO of agents in a hierarchy, and of one that acts for all (Schulman et al. 2017).

In one world; networks, buffers and updates are those of stable-baselines3, see `training`. How
agents act is in `acting`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from gymnasium.spaces import Discrete, MultiDiscrete
from scipy.special import logsumexp

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.turns import Turn
from ..interface.agents import Placement
from ..interface.experience import Experience
from ..interface.scenario import Scenario
from ..numerics import FloatArray, IntArray
from .acting import InputNames, Policies, PolicyInputs
from .settings import MultiAgentPPOSettings
from .training import ActorCritic


class HierarchyPPO(Policies):
    """One policy for every agent, on its own state and the actions that it is told."""

    policies: Mapping[str, ActorCritic]

    def policy_of(self, agents: IntArray) -> ActorCritic:
        """Return the policy and critic of agents that share weights."""
        widths = self.width, self.inputs.n_own, self._n_joint
        return ActorCritic(self.settings, agents, Discrete(self.shape[1]), widths, self.rng)

    def learn(self, experience: Experience, inputs: PolicyInputs) -> None:
        """Keep the step, and update the policies whose buffers were full.

        At the end of an episode what follows is bootstrapped.
        """
        transition = experience.transition
        joint = experience.decision.joint_action
        seen = inputs.seen
        chosen = inputs.logits[np.arange(len(joint)), joint] - logsumexp(inputs.logits, axis=1)
        acting = self.acting
        actions = joint[acting].reshape(len(seen), -1)
        logs = chosen[acting].reshape(len(seen), -1).sum(axis=1)
        reward = np.asarray(transition.reward, dtype=float)
        is_joint = self.settings.value_of == "team"
        reward = np.broadcast_to(reward.mean() if is_joint else reward, len(seen))
        kept = self.with_critics(seen, inputs.present)
        for policy in self.policies.values():
            policy.learn(kept, actions, logs, reward)
        if not experience.last:
            return
        entered = self.with_critics(self.of_actors(transition.states), transition.states)
        for policy in self.policies.values():
            policy.end_episode(entered, terminated=transition.terminated)


class UnreliablyToldPPO(HierarchyPPO):
    """The same where messages fail, so that an agent may be told by any that decided before.

    Agents decide one after the other. Weights and random numbers begin as if no message failed;
    what others tell than those of the hierarchy weighs nothing at first.
    """

    at_once = False

    def __init__(self, settings: MultiAgentPPOSettings, placement: Placement) -> None:
        super().__init__(settings, placement)
        self.continue_from(HierarchyPPO(settings, placement))

    @staticmethod
    def senders(hierarchy: Hierarchy) -> list[int]:
        """Return all who decide before another."""
        return sorted(hierarchy.order[:-1])


def hierarchy_ppo(settings: MultiAgentPPOSettings, placement: Placement) -> HierarchyPPO:
    """Return agents in a hierarchy, whose messages may fail."""
    kind = UnreliablyToldPPO if placement.messages_fail else HierarchyPPO
    return kind(settings, placement)


class CentralPPO(HierarchyPPO):
    """One policy that sees all states, once, and acts for all its members."""

    def policy_of(self, agents: IntArray) -> ActorCritic:
        """Return the policy and critic of all."""
        n = len(agents)
        n_actions = self.shape[1]
        actions = Discrete(n_actions) if n == 1 else MultiDiscrete([n_actions] * n)
        widths = 0, self.inputs.n_joint, 0
        return ActorCritic(self.settings, np.arange(1), actions, widths, self.rng)

    @property
    def acting(self) -> IntArray:
        """Agents whose actions are kept with a step: those of the policy."""
        return self.members

    @property
    def input_names(self) -> InputNames:
        """What its inputs are."""
        names = self.inputs.joint_names
        return {"policy_net": names, "value_net": names}

    def of_actors(self, states: FloatArray) -> FloatArray:
        """Return all states ``(1, k)``."""
        return self.inputs.joint(states)[None].astype(np.float32)

    def decide(self, inputs: PolicyInputs, turn: Turn) -> IntArray:
        """Return the actions ``(k,)`` of agents whose turn it is."""
        logits = self._actors[0](inputs.seen).reshape(len(self.members), -1)
        inputs.logits[self.members] = logits
        self._counts.joint_actions += len(turn.agents) * self.shape[1]
        return (inputs.logits + inputs.noise)[turn.agents].argmax(axis=1)

    def check_world(self, scenario: Scenario) -> None:
        """Refuse a world of other states, actions or agents."""
        super().check_world(scenario)
        if tuple(scenario.agents) != tuple(self.scenario.agents):
            raise ValueError(f"{self._trained(scenario)}: one policy acts for all of them")
