"""Agents that act by policies trained with PPO.

Agents act in the order of the hierarchy, and see the actions that superiors tell them as one-hot
inputs. All agents and environments of a turn act in one call. An action is sampled by adding Gumbel
noise to the logits. Axes are E environments, n agents and A actions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..hierarchy.hierarchy import Hierarchy
from ..hierarchy.stages import Inbox
from ..interface.agents import AgentContext, Agents, Counts, StateDict, add_prefix, select_prefix
from ..interface.environments import Transitions
from ..interface.experience import Experience, Observation
from ..interface.scenario import check_transfer, owners_of
from ..numerics import AnyArray, BoolArray, FloatArray, IntArray, set_words, words_of
from .inputs import InputEncoder
from .policy import InputNames, Policy, log_sum_exp
from .rollout import Choices, PolicyShape
from .settings import MultiAgentPPOSettings, PPOSettings


@dataclass
class PolicyInputs:
    """Inputs of a joint decision, and the logits that policies computed from them."""

    batch_shape: tuple[int, ...]
    """Axes of the states before agents: ``(E,)``, or empty for one environment."""
    actor: FloatArray
    """``(E, rows, k)`` inputs of actors: actions told, one-hot, then the agent's state."""
    joint: FloatArray
    """``(E, n_joint)`` states of all agents, for central critics."""
    noise: FloatArray
    """``(E, n, A)`` noise that is added to logits."""
    logits: FloatArray
    """``(E, n, A)``, filled in stage by stage."""
    decided: BoolArray
    """``(n,)`` whether an agent decided: absent agents do not."""


class PPOAgents(Agents[PolicyInputs]):
    """One policy for every agent, by its own state and the actions that it is told.

    Parameters
    ----------
    settings
        Settings of PPO.
    context
        Scenario, hierarchy and members.

    Attributes
    ----------
    members
        ``(k,)`` agents that act by these policies.
    policies
        Policies by name; each has weights of its own.

    Raises
    ------
    ValueError
        If some agents are neighbors, or messages may fail in many environments; one line.
    """

    is_stochastic = True

    def __init__(
        self, settings: MultiAgentPPOSettings | PPOSettings, context: AgentContext
    ) -> None:
        scenario = context.scenario
        hierarchy = context.hierarchy
        if not settings.uses_hierarchy:
            hierarchy = Hierarchy(scenario.agents, [])
        if hierarchy.neighbors:
            raise ValueError(
                f"learner.kind = {settings.kind!r}: neighbors decide at the same time and "
                "send no messages; use a topology without neighbors"
            )
        if context.messages_fail and settings.environments > 1:
            raise ValueError(
                f"learner.environments = {settings.environments}: messages may fail in one "
                "environment only; use learner.environments = 1 or no topology.failures"
            )
        self.rng = np.random.Generator(np.random.PCG64(context.seed))
        self.settings = settings
        self.scenario = scenario
        self.members = context.members
        self.encoder = InputEncoder(
            scenario, numbered=settings.numbered, joins=settings.critic == "central"
        )
        self._n_actions = len(scenario.action_set)
        # Messages that fail may reach an agent from anyone who acts before it, one after the other.
        is_unreliable = context.messages_fail and settings.uses_hierarchy
        self.acts_in_parallel = not is_unreliable
        senders = sorted(hierarchy.order[:-1]) if is_unreliable else senders_of(hierarchy)
        self._told_columns: IntArray = np.zeros(len(scenario.agents), dtype=np.int64)
        self._told_columns[senders] = self._n_actions * np.arange(len(senders))
        self.told_names = [
            f"{scenario.agents[sender]} did {action}"
            for sender in senders
            for action in scenario.action_set.names
        ]
        self._rows = self._rows_by_policy()
        self.policies = {
            name: Policy(settings, len(rows), self._policy_shape(), self.rng)
            for name, rows in self._rows.items()
        }
        self._groups: dict[bytes, list[tuple[Policy, IntArray]]] = {}
        self.counts = Counts()
        """Number of actions evaluated."""
        if is_unreliable:  # initial weights and random numbers as without failures
            self.warm_start(type(self)(settings, replace(context, messages_fail=False)))

    def _rows_by_policy(self) -> dict[str, IntArray]:
        """Return by policy the rows ``(k,)`` of `PolicyInputs.actor` for which it acts."""
        weights = self.settings.weights
        if weights == "all":
            return {"all": self.members}
        names = np.array(owners_of(self.scenario, self.members, shared=weights == "role"))
        return {str(name): self.members[names == name] for name in np.unique(names)}

    def _policy_shape(self) -> PolicyShape:
        """Return the sizes of inputs and actions of every policy."""
        encoder = self.encoder
        widths = len(self.told_names), len(encoder.own_names), len(encoder.joint_names)
        return PolicyShape(*widths, n_heads=1, n_actions=self._n_actions)

    @property
    def weight_bytes(self) -> int:
        """Memory of the weights of all policies and critics [bytes]."""
        return sum(policy.weights.nbytes for policy in self.policies.values())

    @property
    def input_names(self) -> InputNames:
        """Names of the inputs of actors and critics."""
        own = self.encoder.own_names
        return [*self.told_names, *own], [*own, *self.encoder.joint_names]

    def _encode(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return own inputs ``(E, rows, n_own)`` and joint inputs ``(E, n_joint)`` of states."""
        own = self.encoder.own(states)
        return own, self.encoder.joint(own)

    def observe(self, seen: Observation, *, explore: bool) -> PolicyInputs:
        """Return the inputs of a decision, with noise if the agents explore."""
        states = seen.states
        own, joint = self._encode(states.reshape(-1, *states.shape[-2:]))
        n_told = len(self.told_names)
        actor = np.zeros((*own.shape[:2], n_told + own.shape[2]), np.float32)
        actor[..., n_told:] = own
        shape = len(own), len(self.scenario.agents), self._n_actions
        noise = self.rng.gumbel(size=shape) if explore else np.zeros(shape)
        logits, decided = np.zeros(shape, np.float32), np.zeros(shape[1], bool)
        return PolicyInputs(states.shape[:-2], actor, joint, noise, logits, decided)

    def act(self, inputs: PolicyInputs, inbox: Inbox) -> IntArray:
        """Return the actions ``(..., k)`` of a turn: sampled, or the most probable ones."""
        count = len(inputs.actor)
        if self.told_names and len(inbox.senders):
            columns = self._told_columns[inbox.senders] + inbox.actions.reshape(count, -1)
            inputs.actor[np.arange(count)[:, None], inbox.receivers, columns] = 1.0
        for policy, agents in self._grouped(inbox.agents):
            actor = inputs.actor[:, agents].reshape(count * len(agents), -1)
            inputs.logits[:, agents] = policy.logits(actor).reshape(count, len(agents), -1)
        return self._choose(inputs, inbox)

    def _grouped(self, agents: IntArray) -> list[tuple[Policy, IntArray]]:
        """Return the policies by which some agents act, each with its agents."""
        key = agents.tobytes()
        if key not in self._groups:
            groups = [(name, np.intersect1d(agents, rows)) for name, rows in self._rows.items()]
            self._groups[key] = [(self.policies[name], own) for name, own in groups if len(own)]
        return self._groups[key]

    def _choose(self, inputs: PolicyInputs, inbox: Inbox) -> IntArray:
        """Return the actions of a stage, which have the greatest sum of logit and noise."""
        logits = inputs.logits[:, inbox.agents]
        inputs.decided[inbox.agents] = True
        self.counts.joint_actions += logits.size
        chosen: IntArray = (logits + inputs.noise[:, inbox.agents]).argmax(axis=2)
        return chosen.reshape(*inputs.batch_shape, -1)

    def action_values(self, inputs: PolicyInputs) -> Mapping[int, FloatArray]:
        """Return the log probabilities ``(A,)`` of the actions of each member."""
        log_probs = inputs.logits[0] - log_sum_exp(inputs.logits[0])[:, None]
        return {agent: log_probs[agent] for agent in self.members.tolist()}

    def learn(self, experience: Experience, inputs: PolicyInputs) -> None:
        """Learn from a step of one environment."""
        transition = experience.transition
        n = len(self.scenario.agents)
        transitions = Transitions(
            transition.states[None],
            np.broadcast_to(np.asarray(transition.reward, float), n)[None],
            np.array([transition.terminated]),
            np.array([transition.truncated]),
        )
        joint_actions = experience.decision.joint_action[None]
        self.learn_batch(joint_actions, inputs, transitions, np.array([experience.last]))

    def learn_batch(
        self, joint_actions: IntArray, inputs: PolicyInputs, steps: Transitions, last: BoolArray
    ) -> None:
        """Append a step of all environments, and update the policies when rollouts are full."""
        rewards = steps.rewards
        if self.settings.value_of == "team":
            rewards = np.broadcast_to(rewards.mean(axis=1, keepdims=True), rewards.shape)
        for name, policy in self.policies.items():
            rows = self._rows[name]
            choices = self._by_head(inputs, joint_actions, rows)
            policy.append((inputs.actor[:, rows], inputs.joint), choices, rewards[:, rows], last)
        truncated = last & ~steps.terminated
        if truncated.any():
            own, joint_inputs = self._encode(steps.states[truncated])
            for name, policy in self.policies.items():
                policy.bootstrap(truncated, own[:, self._rows[name]], joint_inputs)
        if any(policy.rollout.is_full for policy in self.policies.values()):
            own, joint_inputs = self._encode(steps.states)
            for name, policy in self.policies.items():
                policy.update(own[:, self._rows[name]], joint_inputs)

    def _by_head(self, inputs: PolicyInputs, joint: IntArray, rows: IntArray) -> Choices:
        """Return the choices of the rows of a policy."""
        return Choices(
            inputs.logits[:, rows, None], joint[:, rows, None], inputs.decided[rows, None]
        )

    def _transfer_problem(self, former: Self) -> str:
        """Return why other agents' policies cannot be used here, or nothing."""
        if self.policies.keys() == former.policies.keys():
            return ""
        return f"learner.weights = {self.settings.weights!r}; with 'all', all agents share theirs"

    def warm_start(self, former: Self) -> None:
        """Start with the weights of agents with the same settings elsewhere.

        Raises
        ------
        ValueError
            If states, actions, or the owners of weights differ; one line.
        """
        check_transfer(former.scenario, self.scenario, self._transfer_problem(former))
        for name, policy in self.policies.items():
            policy.warm_start(former.policies[name], self.input_names, former.input_names)
        self.rng.bit_generator.state = former.rng.bit_generator.state

    def state_dict(self) -> StateDict:
        """Return the state of the generator and of all policies."""
        state: StateDict = {"generator": words_of(self.rng)}
        for name, policy in self.policies.items():
            state |= add_prefix(f"{name}.", policy.state_dict())
        return state

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If it is that of other agents; one line.
        """
        saved = {name: select_prefix(f"{name}.", state) for name in self.policies}
        missing = [name for name, own in saved.items() if not own]
        if missing:
            raise ValueError(f"team: the saved state has no weights of {missing[0]!r}")
        if sum(len(own) for own in saved.values()) < len(state) - 1:
            raise ValueError(f"team: the saved state has further policies than {', '.join(saved)}")
        for name, policy in self.policies.items():
            policy.load_state_dict(saved[name])
        set_words(self.rng, state["generator"])


class CentralPPOAgents(PPOAgents):
    """One policy that sees all states and acts for all members, with a head for each."""

    def _rows_by_policy(self) -> dict[str, IntArray]:
        """Return the only row of the only policy."""
        return {"all": np.arange(1)}

    def _policy_shape(self) -> PolicyShape:
        """Return the sizes of inputs and actions."""
        heads = len(self.members)
        return PolicyShape(0, len(self.encoder.joint_names), 0, heads, self._n_actions)

    @property
    def input_names(self) -> InputNames:
        """Names of the inputs of actor and critic."""
        return self.encoder.joint_names, self.encoder.joint_names

    def _encode(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the inputs ``(E, 1, n_own)`` of the policy; there are no others."""
        own = self.encoder.joint(self.encoder.own(states))[:, None]
        return own, np.zeros((len(own), 0), np.float32)

    def observe(self, seen: Observation, *, explore: bool) -> PolicyInputs:
        """Return the inputs of a decision, and the logits of all members."""
        inputs = super().observe(seen, explore=explore)
        inputs.logits[:, self.members] = self.policies["all"].logits(inputs.actor[:, 0])
        return inputs

    def act(self, inputs: PolicyInputs, inbox: Inbox) -> IntArray:
        """Return the actions ``(..., k)`` of the agents of a stage."""
        return self._choose(inputs, inbox)

    def _by_head(self, inputs: PolicyInputs, joint: IntArray, rows: IntArray) -> Choices:
        """Return the choices of the only row, with a head for each member."""
        heads = self.members
        return Choices(
            inputs.logits[:, None, heads], joint[:, None, heads], inputs.decided[None, heads]
        )

    def _transfer_problem(self, former: Self) -> str:
        is_same = tuple(former.scenario.agents) == tuple(self.scenario.agents)
        return "" if is_same else "one policy acts for all of them"


def senders_of(hierarchy: Hierarchy) -> list[int]:
    """Return all agents that send their actions to another agent, in agent order."""
    superiors = (hierarchy.senders(agent) for agent in range(len(hierarchy)))
    return sorted({sender for senders in superiors for sender in senders})
