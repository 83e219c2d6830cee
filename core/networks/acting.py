"""Policies of agents in a hierarchy: who shares which, what they see, and how they act.

Agents decide level by level, and see the actions that they are told as one-hots; these are kept
with a decision, so that an update passes over all agents at once. A step is that of all agents: it
has one value and one advantage for each, whoever decided first. Actions are drawn by adding Gumbel
noise to the logarithms of probabilities. How policies are held and learn is another's affair:
stable-baselines3's in one world, see `policies`, and NumPy's in many, see `many_worlds`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.turns import Turn
from ..interface.agents import Agents, Counts, Memory, Placement, under
from ..interface.experience import Observation
from ..interface.scenario import Scenario
from ..numerics import AnyArray, FloatArray, IntArray, set_words, words_of
from .inputs import Inputs
from .settings import MultiAgentPPOSettings, PPOSettings

InputNames = Mapping[str, Sequence[str]]
"""By network, ``policy_net`` and ``value_net``, what each of its inputs is."""


class SharedPolicy(ABC):
    """A policy and its critic, of agents that share their weights."""

    actor: Callable[[FloatArray], FloatArray]
    """Returns the logits ``(m, A)`` for inputs ``(m, k)``."""

    @property
    @abstractmethod
    def weight_bytes(self) -> int:
        """How much memory the weights take."""

    @abstractmethod
    def memory(self) -> Memory:
        """Return all that is remembered: weights, Adam's moments, what the buffer holds."""

    @abstractmethod
    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned."""

    @abstractmethod
    def continue_from(self, former: Any, names: InputNames, former_names: InputNames) -> None:
        """Begin with the weights of another one, whose inputs may be others.

        What an input weighs goes with its name; inputs that the other one has not met weigh nothing
        at first. Adam's moments and the buffer begin anew.

        Parameters
        ----------
        former
            Of the same settings.
        names, former_names
            What the inputs of actor and critic are, here and there.
        """


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


class Policies(Agents[PolicyInputs]):
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
        self.policies: Mapping[str, SharedPolicy] = {
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
        return sum(policy.weight_bytes for policy in self.policies.values())

    @abstractmethod
    def policy_of(self, agents: IntArray) -> SharedPolicy:
        """Return the policy and critic of agents that share weights."""

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

    def continue_from(self, former: Policies) -> None:
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
