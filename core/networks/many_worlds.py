"""PPO in many worlds at once (Schulman et al. 2017), in NumPy, with gradients by hand.

All worlds and agents of a turn decide in one call. A rollout holds `rollout` decisions of every
world; an update passes over all its transitions, of all agents that share weights, in minibatches.
Networks begin orthogonal, and values may be normalised by the moments of returns, as Yu et al.
(2022) advise. The clipped loss of a minibatch of m transitions with advantages a, made to have mean
0 and deviation 1, ratios r of probabilities, entropies H, values v and returns g is::

    -mean(min(r a, clip(r, 1 - c, 1 + c) a)) - e mean(H) + 0.5 mean((v - g)^2)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..hierarchy.turns import Turn
from ..interface.agents import Memory, Placement, under
from ..interface.environments import Transitions
from ..interface.experience import Observation
from ..numerics import AnyArray, BoolArray, FloatArray, IntArray
from .acting import InputNames, Policies, PolicyInputs, SharedPolicy
from .perceptron import Adam, Perceptron, RunningMoments
from .settings import MultiAgentPPOSettings

MOST_GRADIENT = 0.5
"""Length to which gradients are cut."""
MOST_REWARD = 10.0
"""Where scaled rewards are cut, either way."""


class Batch(NamedTuple):
    """Transitions that an update learns from."""

    told: FloatArray
    """``(m, k)`` inputs of actors."""
    seen: FloatArray
    """``(m, k)`` inputs of critics."""
    actions: IntArray
    """``(m,)`` what was done."""
    logs: FloatArray
    """``(m,)`` logarithms of the probabilities by which it was done."""
    advantages: FloatArray
    """``(m,)`` by how much it was better than expected."""
    returns: FloatArray
    """``(m,)`` what values should have been."""

    def rows(self, rows: IntArray) -> Batch:
        """Return some of them."""
        return Batch(
            self.told[rows],
            self.seen[rows],
            self.actions[rows],
            self.logs[rows],
            self.advantages[rows],
            self.returns[rows],
        )


class NetworkPolicy(SharedPolicy):
    """SharedPolicy and critic of agents that share these weights, their rollout and update.

    Parameters
    ----------
    settings
        Of PPO.
    agents
        ``(k,)`` which agents they are.
    widths
        How many inputs the actor, the agent's own state, all states have, and how many actions.
    rng
        Source of everything random in it.
    """

    actor: Perceptron

    def __init__(
        self,
        settings: MultiAgentPPOSettings,
        agents: IntArray,
        widths: tuple[int, int, int, int],
        rng: np.random.Generator,
    ) -> None:
        n_actor, n_own, n_joint, n_actions = widths
        self.settings = settings
        self.agents = agents
        self._rng = rng
        self._n_own = n_own
        self._n_joint = n_joint
        self.actor = Perceptron((n_actor, *settings.hidden, n_actions))
        self.critic = Perceptron((n_own + n_joint, *settings.hidden, 1))
        own = self.actor.n_weights
        self.weights = np.zeros(own + self.critic.n_weights, np.float32)
        self.gradient = np.zeros_like(self.weights)
        self.actor.lie_in(self.weights[:own], self.gradient[:own])
        self.critic.lie_in(self.weights[own:], self.gradient[own:])
        self.actor.begin_orthogonal(rng, 0.01)
        self.critic.begin_orthogonal(rng, 1.0)
        self._adam = Adam(self.weights, self.gradient)
        self._moments = RunningMoments()
        self._discounted: FloatArray = np.zeros(0)
        self._held: dict[str, AnyArray] = {}
        self._steps = 0
        self._decisions = 0

    @property
    def weight_bytes(self) -> int:
        """How much memory the weights take."""
        return self.weights.nbytes

    @property
    def _scales_values(self) -> bool:
        return self.settings.normalised == "values"

    def keep(
        self, inputs: PolicyInputs, joint: FloatArray, actions: IntArray, steps: Transitions,
        last: BoolArray, entered: tuple[FloatArray, FloatArray],
    ) -> None:  # fmt: skip
        """Keep a decision of all worlds, and update the policy if the rollout is full.

        Parameters
        ----------
        inputs
            What was decided by.
        joint
            ``(W, n_joint)`` all states as inputs.
        actions
            ``(W, n)`` what was done.
        steps
            What it led to.
        last
            ``(W,)`` whether episodes end.
        entered
            The states entered as inputs of agents ``(W, n, k)``, and of all ``(W, n_joint)``.
        """
        size = self.settings.rollout
        worlds = len(joint)
        if not self._held:
            self._make_room(size, worlds, inputs.seen.shape[-1])
        own = self.agents
        logits = inputs.logits[:, own]
        chosen = np.take_along_axis(logits, actions[:, own, None], axis=2)[..., 0]
        t = self._steps
        self._held["seen"][t] = inputs.seen[:, own]
        self._held["joint"][t] = joint
        self._held["actions"][t] = actions[:, own]
        self._held["logs"][t] = chosen - log_sum(logits)
        self._held["last"][t] = last
        self._held["rewards"][t] = self._scaled(steps.rewards[:, own], last)
        cut = last & ~steps.terminated
        if cut.any():
            values = self._values(entered[0][cut][:, own], entered[1][cut])
            self._held["rewards"][t][cut] += self.settings.discount * values
        self._steps += 1
        self._decisions += worlds
        if self._steps == size:
            self._update(self._values(entered[0][:, own], entered[1]))
            self._steps = 0

    def _make_room(self, size: int, worlds: int, width: int) -> None:
        shape = size, worlds, len(self.agents)
        self._held = {
            "seen": np.zeros((*shape, width), np.float32),
            "joint": np.zeros((size, worlds, self._n_joint), np.float32),
            "actions": np.zeros(shape, np.int64),
            "logs": np.zeros(shape, np.float32),
            "rewards": np.zeros(shape, np.float32),
            "last": np.zeros((size, worlds), bool),
        }
        self._discounted = np.zeros((worlds, len(self.agents)))

    def _scaled(self, rewards: FloatArray, last: BoolArray) -> FloatArray:
        """Return rewards ``(W, k)`` divided by the deviation of discounted returns so far."""
        if self.settings.value_of == "team":
            rewards = np.broadcast_to(rewards.mean(axis=1, keepdims=True), rewards.shape)
        if self._scales_values:
            return rewards
        self._discounted = self.settings.discount * self._discounted + rewards
        self._moments.add(self._discounted)
        self._discounted[last] = 0.0
        return np.clip(rewards / self._moments.deviation, -MOST_REWARD, MOST_REWARD)

    def _critics(self, own: FloatArray, joint: FloatArray) -> FloatArray:
        """Return inputs of critics ``(m k, n)`` of agents ``(m, k, n_own)`` that all see states."""
        m, k = own.shape[:2]
        every = np.broadcast_to(joint[:, None], (m, k, joint.shape[1]))
        return np.concatenate([own, every], axis=2, dtype=np.float32).reshape(m * k, -1)

    def _values(self, own: FloatArray, joint: FloatArray) -> FloatArray:
        """Return the values ``(m, k)`` of states as inputs ``(m, k, n_own)``, ``(m, n_joint)``."""
        return self._valued(self._critics(own, joint)).reshape(own.shape[:2])

    def _valued(self, inputs: FloatArray) -> FloatArray:
        """Return the values ``(m, 1)`` by inputs ``(m, n)`` of critics."""
        values = self.critic(inputs)
        return (
            values * self._moments.deviation + self._moments.mean if self._scales_values else values
        )

    def _update(self, entered: FloatArray) -> None:
        """Learn from the rollout; `entered` are the values ``(W, k)`` of where it broke off."""
        held = self._held
        size, worlds, k = held["rewards"].shape
        own = held["seen"][..., -self._n_own :].reshape(size * worlds, k, -1)
        joint = held["joint"].reshape(size * worlds, -1)
        critics = self._critics(own, joint)
        values = self._valued(critics).reshape(size, worlds, k)
        advantages = estimate(held["rewards"], values, entered, held["last"], self.settings)
        returns = advantages + values
        if self._scales_values:
            self._moments.add(returns)
            returns = (returns - self._moments.mean) / self._moments.deviation
        m = size * worlds * k
        batch = Batch(
            held["seen"].reshape(m, -1), critics, held["actions"].reshape(m),
            held["logs"].reshape(m), advantages.reshape(m).astype(np.float32),
            returns.reshape(m).astype(np.float32),
        )  # fmt: skip
        s = self.settings
        size_of_step = s.learning_rate * share_left(self._decisions, s.learning_rate_decisions)
        entropy = s.entropy * share_left(self._decisions, s.entropy_decisions)
        for _ in range(s.epochs):
            order = self._rng.permutation(m)
            for first in range(0, m, s.batch_size):
                rows = order[first : first + s.batch_size]
                self.slope(batch.rows(rows), entropy)
                self._adam.step(size_of_step, MOST_GRADIENT)

    def slope(self, batch: Batch, entropy: float) -> float:
        """Write the gradient of the loss, and return the loss."""
        m = np.float32(len(batch.actions))
        rows = np.arange(len(batch.actions))
        a = batch.advantages
        a = (a - a.mean()) / (a.std() + np.float32(1e-8))
        passed = self.actor.activations(batch.told)
        logits = passed[-1]
        logs = logits - log_sum(logits)[:, None]
        probabilities = np.exp(logs)
        ratio = np.exp(logs[rows, batch.actions] - batch.logs)
        clip = np.float32(self.settings.clip)
        held = np.where(a > 0, ratio > 1 + clip, ratio < 1 - clip)
        gain = np.where(held, np.float32(0), ratio * a) / m
        spread = -(probabilities * logs).sum(axis=1)
        slopes = probabilities * (gain + np.float32(entropy) / m * spread)[:, None]
        slopes += np.float32(entropy) / m * probabilities * logs
        slopes[rows, batch.actions] -= gain
        self.actor.descend(passed, slopes)
        passed = self.critic.activations(batch.seen)
        errors = passed[-1][:, 0] - batch.returns
        self.critic.descend(passed, (errors / m)[:, None])
        clipped = np.minimum(ratio * a, np.clip(ratio, 1 - clip, 1 + clip) * a)
        return float(-clipped.mean() - entropy * spread.mean() + 0.5 * (errors**2).mean())

    def memory(self) -> Memory:
        """Return all that is remembered: weights, Adam's moments, what the rollout holds."""
        memory = {f"held.{name}": array[: self._steps].copy() for name, array in self._held.items()}
        memory |= {f"adam.{name}": array for name, array in self._adam.memory().items()}
        return memory | {
            "weights": self.weights.copy(),
            "moments": self._moments.memory(),
            "discounted": self._discounted.copy(),
            "decisions": np.array(self._decisions),
        }

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned."""
        saved = memory["weights"].shape if "weights" in memory else "missing"
        if saved != self.weights.shape:
            raise ValueError(f"team: saved weights: {saved}, this team's: {self.weights.shape}")
        self.weights[:] = memory["weights"]
        self._adam.restore(under("adam.", memory))
        self._moments.restore(memory["moments"])
        self._decisions = int(memory["decisions"])
        held = under("held.", memory)
        self._held = {}
        if held:
            self._steps = len(held["seen"])
            self._make_room(self.settings.rollout, held["seen"].shape[1], held["seen"].shape[-1])
            for name, array in held.items():
                self._held[name][: self._steps] = array
        self._discounted = memory["discounted"].copy()

    def continue_from(
        self, former: NetworkPolicy, names: InputNames, former_names: InputNames
    ) -> None:
        """Begin with the weights of another one, whose inputs may be others."""
        pairs: dict[str, tuple[Perceptron, Perceptron]] = {
            "policy_net": (self.actor, former.actor),
            "value_net": (self.critic, former.critic),
        }
        for net, (own, other) in pairs.items():
            own.take_from(other)
            places = {name: row for row, name in enumerate(former_names[net])}
            for row, name in enumerate(names[net]):
                own.first[row] = other.first[places[name]] if name in places else 0.0
        self._moments.restore(former._moments.memory())


def log_sum(logits: FloatArray) -> FloatArray:
    """Return the logarithms ``(...,)`` of sums of exponentials of logits ``(..., A)``."""
    most = logits.max(axis=-1)
    return most + np.log(np.exp(logits - most[..., None]).sum(axis=-1))


def share_left(decisions: int, until: int | None) -> float:
    """Return what is left of what falls to nothing over some decisions, 1 if nothing falls.

    >>> share_left(250, 1000), share_left(2000, 1000), share_left(5, None)
    (0.75, 0.0, 1.0)
    """
    return 1.0 if until is None else max(0.0, 1.0 - decisions / until)


def estimate(
    rewards: FloatArray, values: FloatArray, entered: FloatArray, last: BoolArray,
    settings: MultiAgentPPOSettings,
) -> FloatArray:  # fmt: skip
    """Return generalised advantages ``(T, W, k)`` (Schulman et al. 2016), backward in time.

    Where an episode ends nothing follows::

        d_t = r_t + gamma v_t+1 - v_t,    A_t = d_t + gamma lambda A_t+1

    Parameters
    ----------
    rewards, values
        ``(T, W, k)``; where an episode was cut off, rewards hold what is bootstrapped.
    entered
        ``(W, k)`` values of the states after the last decision.
    last
        ``(T, W)`` where episodes end.
    settings
        With discount and trace decay.
    """
    advantages = np.empty_like(values)
    following = entered
    ahead: FloatArray = np.zeros_like(entered)
    for t in range(len(rewards) - 1, -1, -1):
        goes_on = settings.discount * ~last[t][:, None]
        ahead = rewards[t] + goes_on * (following + settings.gae_lambda * ahead) - values[t]
        advantages[t] = ahead
        following = values[t]
    return advantages


class ManyWorldsPPO(Policies):
    """One policy for every agent, by its own state and what it is told, in many worlds at once.

    Raises
    ------
    ValueError
        If messages may fail, or some agents are neighbours; one line.
    """

    is_vectorized = True
    policies: Mapping[str, NetworkPolicy]

    def __init__(self, settings: MultiAgentPPOSettings, placement: Placement) -> None:
        if placement.messages_fail:
            raise ValueError(
                f"learner.environments = {settings.environments}: messages may "
                "fail in one environment only, use learner.environments = 1 or no topology.failures"
            )
        self._own_settings = settings
        super().__init__(settings, placement)

    def policy_of(self, agents: IntArray) -> NetworkPolicy:
        """Return the policy and critic of agents that share weights."""
        n_own = self.inputs.n_own
        widths = self.width + n_own, n_own, self._n_joint, self.shape[1]
        return NetworkPolicy(self._own_settings, agents, widths, self.rng)

    @property
    def input_names(self) -> InputNames:
        """What the inputs of actors and critics are."""
        joint = self.inputs.joint_names if self._n_joint else []
        own = self.inputs.own_names
        return {"policy_net": [*self._told_names, *own], "value_net": [*own, *joint]}

    def perceive(self, seen: Observation, *, explore: bool) -> PolicyInputs:
        """Return inputs of actors ``(W, n, k)``, and noise for all if they explore."""
        worlds = seen.present.shape[:-2]
        shape = (int(np.prod(worlds)), *self.shape)
        own = self.inputs.each(seen.present).reshape(*shape[:2], -1)
        inputs = np.zeros((*shape[:2], self.width + own.shape[2]), np.float32)
        inputs[..., self.width :] = own
        noise = self.rng.gumbel(size=shape) if explore else np.zeros(shape)
        return PolicyInputs(seen.present, inputs, noise, np.zeros(shape, np.float32))

    def decide(self, inputs: PolicyInputs, turn: Turn) -> IntArray:
        """Return the actions ``(..., k)`` of agents whose turn it is, in all worlds."""
        count = len(inputs.seen)
        if len(turn.senders):
            columns = self._column[turn.senders] + turn.actions.reshape(count, -1)
            inputs.seen[np.arange(count)[:, None], turn.receivers, columns] = 1.0
        self._counts.joint_actions += count * len(turn.agents) * self.shape[1]
        chosen = np.empty((count, len(turn.agents)), np.int64)
        for policy, places in self._policies_of(turn.agents):
            agents = turn.agents[places]
            rows = inputs.seen[:, agents].reshape(count * len(agents), -1)
            logits = self._actors[policy](rows).reshape(count, len(agents), -1)
            inputs.logits[:, agents] = logits
            chosen[:, places] = (logits + inputs.noise[:, agents]).argmax(axis=2)
        return chosen.reshape(*inputs.present.shape[:-2], -1)

    def learn_batch(
        self, joint: IntArray, inputs: PolicyInputs, steps: Transitions, last: BoolArray
    ) -> None:
        """Keep the decision, and update the policies whose rollouts are full."""
        before = self._joint(inputs.present)
        own = self.inputs.each(steps.states).astype(np.float32)
        entered = own, self._joint(steps.states)
        for policy in self.policies.values():
            policy.keep(inputs, before, joint, steps, last, entered)

    def _joint(self, states: FloatArray) -> FloatArray:
        """Return all states ``(W, n_joint)`` if critics see these, else ``(W, 0)``."""
        if not self._n_joint:
            return np.zeros((len(states), 0), np.float32)
        return self.inputs.joint(states).astype(np.float32)
