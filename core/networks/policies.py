"""PPO of agents in a hierarchy, and of one that acts for all (Schulman et al. 2017).

In a hierarchy agents decide level by level, and see the actions that they are told as one-hots;
these are kept with a decision, so that an update passes over all agents at once. A step is that of
all agents: it has one value and one advantage for each, whoever decided first. Actions are drawn by
adding Gumbel noise to the logarithms of probabilities.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from gymnasium.spaces import Discrete, MultiDiscrete
from scipy.special import logsumexp

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.turns import Turn
from ..interface.agents import Agents, Counts, Memory, Placement, under
from ..interface.experience import Experience, Observation
from ..interface.scenario import Scenario
from ..numerics import AnyArray, FloatArray, IntArray, set_words, words_of
from .inputs import Inputs
from .settings import MultiAgentPPOSettings, PPOSettings
from .training import ActorCritic, InputNames, bytes_of


@dataclass
class PolicyInputs:
    """What policies decide by, and what they made of it."""

    present: FloatArray
    """``(n, d)`` states of all agents."""
    seen: FloatArray
    """``(n, k)`` inputs of actors: what they are told, one-hot, then each agent's state."""
    noise: FloatArray
    """``(n, A)`` what is added to logits."""
    logits: FloatArray
    """``(n, A)``, filled in turn by turn."""


class HierarchyPPO(Agents[PolicyInputs]):
    """One policy for every agent, on its own state and the actions that it is told.

    Parameters
    ----------
    settings
        Of PPO, whose weights are whose, and what the critic sees.
    placement
        Where they act.

    Attributes
    ----------
    members
        ``(k,)`` the agents for whom they decide.
    policies
        By name, policies that share no weights.

    Raises
    ------
    ValueError
        If some agents are neighbours; one line.
    """

    at_once = True
    is_sampled = True

    def __init__(self, settings: MultiAgentPPOSettings | PPOSettings, placement: Placement) -> None:
        self.rng = np.random.Generator(np.random.PCG64(placement.seed))
        self.settings = settings
        scenario = placement.scenario
        is_told = settings.uses_hierarchy
        hierarchy = placement.hierarchy if is_told else Hierarchy(scenario.agents, [])
        self.scenario = scenario
        self.members = placement.members
        self.inputs = Inputs(scenario, numbered=settings.numbered)
        self.shape = len(scenario.agents), len(scenario.action_set)
        if hierarchy.neighbours:
            raise ValueError(
                f"learner.kind = {settings.kind!r}: neighbours decide at the same time and tell "
                "each other nothing, use a topology without them"
            )
        n, n_actions = self.shape
        heard = self.senders(hierarchy)
        self.width = len(heard) * n_actions
        self._told_names = [
            f"{scenario.agents[sender]} did {action}"
            for sender in heard
            for action in scenario.action_set.names
        ]
        self._column: IntArray = np.zeros(n, dtype=np.int64)
        self._column[heard] = n_actions * np.arange(len(heard))
        owners = {"all": ("all",) * n, "role": scenario.roles, "own": scenario.agents}
        names, rows = np.unique(
            np.take(owners[settings.weights], self.members), return_inverse=True
        )
        self._rows = np.full(n, -1)
        self._rows[self.members] = rows
        self._n_joint = self.inputs.n_joint if settings.critic == "central" else 0
        self.policies = {
            str(name): self.policy_of(self.members[rows == row]) for row, name in enumerate(names)
        }
        self._actors = [policy.actor for policy in self.policies.values()]
        self._by_policy: dict[bytes, list[tuple[int, IntArray]]] = {}
        self._counts = Counts()

    @staticmethod
    def senders(hierarchy: Hierarchy) -> list[int]:
        """Return whose actions somebody may be told, in agent order: for them there are inputs."""
        above = (hierarchy.above(agent) for agent in range(len(hierarchy)))
        return sorted({sender for senders in above for sender in senders})

    @property
    def acting(self) -> IntArray:
        """Agents whose actions are kept with a step: all, each in its row."""
        return np.arange(self.shape[0])

    @property
    def counts(self) -> Counts:
        """What they have evaluated so far: each its own actions."""
        return self._counts

    @property
    def weight_bytes(self) -> int:
        """How much memory the weights of policies and critics take."""
        return sum(bytes_of(policy.model.policy) for policy in self.policies.values())

    def policy_of(self, agents: IntArray) -> ActorCritic:
        """Return the policy and critic of agents that share weights."""
        widths = self.width, self.inputs.n_own, self._n_joint
        return ActorCritic(self.settings, agents, Discrete(self.shape[1]), widths, self.rng)

    @property
    def input_names(self) -> InputNames:
        """What the inputs of actors and critics are."""
        joint = self.inputs.joint_names if self._n_joint else []
        actor = [*self._told_names, *self.inputs.own_names]
        is_split = self.width > 0 or self._n_joint > 0
        critic = [*self.inputs.own_names, *joint] if is_split else actor
        return {"policy_net": actor, "value_net": critic}

    def of_actors(self, states: FloatArray) -> FloatArray:
        """Return inputs of actors ``(rows, k)``: nothing is told yet, and each agent's state."""
        own = self.inputs.each(states).astype(np.float32)
        return np.hstack([np.zeros((len(own), self.width), dtype=np.float32), own])

    def with_critics(self, seen: FloatArray, states: FloatArray) -> FloatArray:
        """Return inputs of actors, and after them all states if critics see these."""
        if not self._n_joint:
            return seen
        joint = np.tile(self.inputs.joint(states).astype(np.float32), (len(seen), 1))
        return np.hstack([seen, joint])

    def perceive(self, seen: Observation, *, explore: bool) -> PolicyInputs:
        """Return inputs of actors, and noise for all if they explore."""
        noise = self.rng.gumbel(size=self.shape) if explore else np.zeros(self.shape)
        logits = np.zeros(self.shape, np.float32)
        return PolicyInputs(seen.present, self.of_actors(seen.present), noise, logits)

    def decide(self, inputs: PolicyInputs, turn: Turn) -> IntArray:
        """Return the actions ``(k,)`` of agents whose turn it is: drawn, or the most probable."""
        if self.width and len(turn.senders):
            inputs.seen[turn.receivers, self._column[turn.senders] + turn.actions] = 1.0
        self._counts.joint_actions += len(turn.agents) * self.shape[1]
        chosen = np.empty(len(turn.agents), np.int64)
        for policy, places in self._policies_of(turn.agents):
            agents = turn.agents[places]
            own = self._actors[policy](inputs.seen[agents]).reshape(-1, self.shape[1])
            inputs.logits[agents] = own
            chosen[places] = (own + inputs.noise[agents]).argmax(axis=1)
        return chosen

    def _policies_of(self, agents: IntArray) -> list[tuple[int, IntArray]]:
        """Return the policies of some agents, and at which places these act by each."""
        key = agents.tobytes()
        if key not in self._by_policy:
            rows = self._rows[agents]
            self._by_policy[key] = [
                (int(row), np.flatnonzero(rows == row)) for row in np.unique(rows)
            ]
        return self._by_policy[key]

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

    def check_world(self, scenario: Scenario) -> None:
        """Refuse a world of other states or actions."""
        if scenario.state_space != self.scenario.state_space:
            raise ValueError(f"{self._trained(scenario)}: the state spaces differ")
        if scenario.action_set != self.scenario.action_set:
            raise ValueError(f"{self._trained(scenario)}: the actions differ")

    def _trained(self, scenario: Scenario) -> str:
        there, here = (
            f"{len(s.agents)} agents over {s.state_space.name!r}" for s in (self.scenario, scenario)
        )
        return f"a team trained with {there} cannot act with {here}"

    def continue_from(self, former: HierarchyPPO) -> None:
        """Begin with the weights that agents of the same settings have learned elsewhere.

        What an input weighs goes with its name, see `ActorCritic.continue_from`.

        Raises
        ------
        ValueError
            If states, actions, or whose weights there are differ; one line.
        """
        former.check_world(self.scenario)
        if self.policies.keys() != former.policies.keys():
            raise ValueError(
                f"{former._trained(self.scenario)}: learner.weights = {self.settings.weights!r}; "
                "with 'all', all agents share theirs"
            )
        for name, policy in self.policies.items():
            policy.continue_from(former.policies[name], self.input_names, former.input_names)
        self.rng.bit_generator.state = former.rng.bit_generator.state

    def memory(self) -> Memory:
        """Return all that they remember."""
        memory: Memory = {"generator": words_of(self.rng)}
        for name, policy in self.policies.items():
            memory |= {f"{name}.{key}": array for key, array in policy.memory().items()}
        return memory

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned.

        Raises
        ------
        ValueError
            If it is that of other agents.
        """
        saved = {name: under(f"{name}.", memory) for name in self.policies}
        missing = [name for name, own in saved.items() if not own]
        if missing:
            raise ValueError(f"team: no weights of {missing[0]!r} have been saved")
        if sum(len(own) for own in saved.values()) < len(memory) - 1:
            raise ValueError(f"team: more has been saved than of {', '.join(saved)}")
        for name, policy in self.policies.items():
            policy.restore(saved[name])
        set_words(self.rng, memory["generator"])


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
