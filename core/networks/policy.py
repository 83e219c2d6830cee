"""Actor and critic of agents that share weights, with their rollout and its PPO update.

The clipped loss (Schulman et al. 2017) of a minibatch of m transitions is::

    -mean(min(r a, clip(r, 1 - c, 1 + c) a)) - e mean(H) + mean((v - g)^2) / 2

with probability ratios r, advantages a (normalized to mean 0 and standard deviation 1),
entropies H, values v, and returns g. An action has one or several *heads*, which are independent
choices: their log probabilities and entropies add up. Axes are T steps of a rollout, E
environments, k agents, h heads and A choices of a head.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..interface.agents import StateDict, add_prefix, select_prefix
from ..numerics import AnyArray, BoolArray, FloatArray
from .mlp import MLP, Adam, RunningMoments
from .rollout import Batch, Choices, PolicyShape, Rollout, generalized_advantages
from .settings import NetworkSettings

MAX_GRAD_NORM = 0.5
"""Norm to which longer gradients are scaled."""
MAX_REWARD = 10.0
"""Bound of normalized rewards."""
ACTOR_OUTPUT_GAIN = 0.01
CRITIC_OUTPUT_GAIN = 1.0


InputNames = tuple[list[str], list[str]]
"""Names of the inputs of actors, and of critics."""


class Policy:
    """Actor and critic of agents that share weights.

    Parameters
    ----------
    settings
        Settings of PPO.
    n_agents
        Number of agents that share the weights, k.
    shape
        Sizes of inputs and actions.
    rng
        Source of initial weights and of the order of minibatches.
    """

    def __init__(
        self, settings: NetworkSettings, n_agents: int, shape: PolicyShape, rng: np.random.Generator
    ) -> None:
        self.settings = settings
        self.shape = shape
        self._n_agents = n_agents
        self._rng = rng
        n_actor = shape.n_told + shape.n_own
        self.actor = MLP((n_actor, *settings.hidden, shape.n_heads * shape.n_actions))
        self.critic = MLP((shape.n_own + shape.n_joint, *settings.hidden, 1))
        split = self.actor.n_weights
        self.weights = np.zeros(split + self.critic.n_weights, np.float32)
        self.gradient = np.zeros_like(self.weights)
        self.actor.bind_storage(self.weights[:split], self.gradient[:split])
        self.critic.bind_storage(self.weights[split:], self.gradient[split:])
        self.actor.initialize(rng, ACTOR_OUTPUT_GAIN)
        self.critic.initialize(rng, CRITIC_OUTPUT_GAIN)
        self._adam = Adam(self.weights, self.gradient)
        self._moments = RunningMoments()
        self._returns: FloatArray = np.zeros((settings.environments, n_agents))
        """Discounted returns of the running episodes, for the normalization of rewards."""
        self._decisions = 0
        self.rollout = Rollout(settings.rollout, settings.environments, n_agents, shape)

    def logits(self, actor_inputs: FloatArray) -> FloatArray:
        """Return the logits ``(m, h, A)`` for inputs of the actor ``(m, n_told + n_own)``."""
        return self.actor(actor_inputs).reshape(-1, self.shape.n_heads, self.shape.n_actions)

    def values(self, own: FloatArray, joint: FloatArray) -> FloatArray:
        """Return the values ``(..., k)`` of inputs ``(..., k, n_own)`` and ``(..., n_joint)``."""
        return self.critic(self._critic_inputs(own, joint)).reshape(own.shape[:-1])

    def _critic_inputs(self, own: FloatArray, joint: FloatArray) -> FloatArray:
        """Return the inputs of the critic ``(m, n_own + n_joint)``, a row for every agent."""
        inputs = np.empty((*own.shape[:-1], own.shape[-1] + joint.shape[-1]), np.float32)
        inputs[..., : own.shape[-1]] = own
        inputs[..., own.shape[-1] :] = joint[..., None, :]
        return inputs.reshape(-1, inputs.shape[-1])

    def append(
        self, inputs: tuple[FloatArray, FloatArray], choices: Choices,
        rewards: FloatArray, last: BoolArray,
    ) -> None:  # fmt: skip
        """Append a step of all environments to the rollout.

        Parameters
        ----------
        inputs
            Inputs of the actor ``(E, k, n_told + n_own)``, and of all agents ``(E, n_joint)``.
        choices
            Logits, actions, and who decided.
        rewards
            ``(E, k)``.
        last
            ``(E,)`` whether episodes end with this step.

        Raises
        ------
        ValueError
            If the number of environments is not that of the settings.
        """
        if len(last) != self.settings.environments:
            raise ValueError(
                f"learner.environments = {self.settings.environments}: the step has "
                f"{len(last)} environments, allowed: {self.settings.environments}"
            )
        rollout = self.rollout
        t = rollout.steps
        logits, actions, decided = choices
        chosen = np.take_along_axis(logits, actions[..., None], axis=-1)[..., 0]
        rollout.actor_inputs[t], rollout.joint_inputs[t] = inputs
        rollout.actions[t] = actions
        rollout.decided[t] = decided
        rollout.log_probs[t] = ((chosen - log_sum_exp(logits)) * decided).sum(axis=-1)
        rollout.last[t] = last
        rollout.rewards[t] = self._normalize(rewards, last, np.logical_or.reduce(decided, axis=-1))
        rollout.steps += 1
        self._decisions += len(last)

    def _normalize(self, rewards: FloatArray, last: BoolArray, decided: BoolArray) -> FloatArray:
        """Return rewards ``(E, k)`` divided by the standard deviation of discounted returns.

        The return of an agent that has not `decided` ``(k,)`` is left out and begins again.
        """
        self._returns = (self.settings.discount * self._returns + rewards) * decided
        if decided.any():
            self._moments.add(self._returns[:, decided])
        self._returns[last] = 0.0
        return np.clip(rewards / self._moments.deviation, -MAX_REWARD, MAX_REWARD)

    def bootstrap(self, truncated: BoolArray, own: FloatArray, joint: FloatArray) -> None:
        """Add the discounted values of next states to the rewards of the step appended last.

        A time limit is no terminal state (Pardo et al. 2018).

        Parameters
        ----------
        truncated
            ``(E,)`` environments that end an episode without a terminal state, t of them.
        own, joint
            Inputs ``(t, k, n_own)`` and ``(t, n_joint)`` in their next states.
        """
        values = self.values(own, joint)
        self.rollout.rewards[self.rollout.steps - 1][truncated] += self.settings.discount * values

    def update(self, own: FloatArray, joint: FloatArray) -> None:
        """Learn from the rollout and empty it.

        Parameters
        ----------
        own, joint
            Inputs ``(E, k, n_own)`` and ``(E, n_joint)`` in the states after the rollout.
        """
        s = self.settings
        next_values = self.values(own, joint)
        batch = self._batch(next_values)
        learning_rate = s.learning_rate * linear_decay(self._decisions, s.learning_rate_decisions)
        entropy = s.entropy * linear_decay(self._decisions, s.entropy_decisions)
        m = len(batch.actions)
        for _ in range(s.epochs):
            order = self._rng.permutation(m)
            for start in range(0, m, s.batch_size):
                self.loss_and_grad(batch.take(order[start : start + s.batch_size]), entropy)
                self._adam.step(learning_rate, MAX_GRAD_NORM)
        self.rollout.steps = 0

    def _batch(self, next_values: FloatArray) -> Batch:
        """Return the transitions of the rollout that were decided.

        Values after the rollout are ``(E, k)``.
        """
        rollout = self.rollout
        critic_inputs = self._critic_inputs(
            rollout.actor_inputs[..., self.shape.n_told :], rollout.joint_inputs
        )
        values = self.critic(critic_inputs).reshape(rollout.rewards.shape)
        advantages = generalized_advantages(rollout, values, next_values, self.settings)
        batch = Batch(
            actor_inputs=rollout.actor_inputs.reshape(-1, rollout.actor_inputs.shape[-1]),
            critic_inputs=critic_inputs,
            actions=rollout.actions.reshape(-1, self.shape.n_heads),
            decided=rollout.decided.reshape(-1, self.shape.n_heads),
            log_probs=rollout.log_probs.ravel(),
            advantages=advantages.ravel().astype(np.float32),
            returns=(advantages + values).ravel().astype(np.float32),
        )
        decided = batch.decided.any(axis=1)
        return batch if decided.all() else batch.take(np.flatnonzero(decided))

    def loss_and_grad(self, batch: Batch, entropy: float) -> float:
        """Return the loss of a minibatch and write its gradient to `gradient`.

        Parameters
        ----------
        batch
            The minibatch.
        entropy
            Weight of the entropy bonus.
        """
        m = np.float32(len(batch.actions))
        bonus = np.float32(entropy) / m
        clip = np.float32(self.settings.clip)
        a = (batch.advantages - batch.advantages.mean()) / (
            batch.advantages.std() + np.float32(1e-8)
        )
        activations = self.actor.forward(batch.actor_inputs)
        logits = activations[-1].reshape(-1, self.shape.n_heads, self.shape.n_actions)
        log_probs = logits - log_sum_exp(logits)[..., None]
        probs = np.exp(log_probs)
        chosen = np.take_along_axis(log_probs, batch.actions[..., None], axis=-1)[..., 0]
        ratio = np.exp((chosen * batch.decided).sum(axis=1) - batch.log_probs)
        is_clipped = np.where(a > 0, ratio > 1 + clip, ratio < 1 - clip)
        gain = (np.where(is_clipped, np.float32(0), ratio * a) / m)[:, None, None]
        entropies = -(probs * log_probs).sum(axis=-1) * batch.decided
        gradient = probs * (gain + bonus * entropies[..., None]) + bonus * probs * log_probs
        by_choice = gradient.reshape(-1, self.shape.n_actions)
        by_choice[np.arange(len(by_choice)), batch.actions.ravel()] -= gain.repeat(
            self.shape.n_heads
        )
        gradient *= batch.decided[..., None]
        self.actor.backward(activations, gradient.reshape(len(gradient), -1))
        activations = self.critic.forward(batch.critic_inputs)
        errors = activations[-1][:, 0] - batch.returns
        self.critic.backward(activations, (errors / m)[:, None])
        clipped = np.minimum(ratio * a, np.clip(ratio, 1 - clip, 1 + clip) * a)
        bonuses = entropy * entropies.sum(axis=-1).mean()
        return float(-clipped.mean() - bonuses + 0.5 * (errors**2).mean())

    def state_dict(self) -> StateDict:
        """Return weights, moments, and the unfinished rollout."""
        steps = self.rollout.steps
        rollout = {name: array[:steps].copy() for name, array in self.rollout.arrays().items()}
        return {
            **add_prefix("rollout.", rollout),
            **add_prefix("adam.", self._adam.state_dict()),
            "weights": self.weights.copy(),
            "moments": self._moments.memory.copy(),
            "returns": self._returns.copy(),
            "decisions": np.array(self._decisions),
        }

    def load_state_dict(self, state: Mapping[str, AnyArray]) -> None:
        """Continue from a `state_dict`.

        Raises
        ------
        ValueError
            If it is that of another policy; one line.
        """
        own = self.state_dict()
        for name, array in own.items():
            first = int(name.startswith("rollout."))  # the number of steps may differ
            shape = state[name].shape[first:] if name in state else "missing"
            if shape != array.shape[first:]:
                raise ValueError(f"team: saved {name}: {shape}, this team's: {array.shape[first:]}")
        self.weights[:] = state["weights"]
        self._adam.load_state_dict(select_prefix("adam.", state))
        self._moments.memory[:] = state["moments"]
        self._returns = state["returns"].copy()
        self._decisions = int(state["decisions"])
        rollout = select_prefix("rollout.", state)
        self.rollout.steps = len(rollout["rewards"])
        for name, array in self.rollout.arrays().items():
            array[: self.rollout.steps] = rollout[name]

    def warm_start(self, former: Policy, names: InputNames, former_names: InputNames) -> None:
        """Start with the weights of another policy, which may have other inputs.

        Weights belong to the names of inputs. Inputs that the other policy does not have get zero
        weights. Moments of Adam and the rollout start empty.
        """
        networks = (self.actor, former.actor), (self.critic, former.critic)
        for (network, other), own, known in zip(networks, names, former_names, strict=True):
            row_of = {name: row for row, name in enumerate(known)}
            network.warm_start(other, [row_of.get(name) for name in own])
        self._moments.memory[:] = former._moments.memory


def log_sum_exp(logits: FloatArray) -> FloatArray:
    """Return the logarithms ``(...,)`` of sums of exponentials of logits ``(..., A)``."""
    highest = logits.max(axis=-1)
    return highest + np.log(np.exp(logits - highest[..., None]).sum(axis=-1))


def linear_decay(decisions: int, horizon: int | None) -> float:
    """Return a factor that falls linearly from 1 to 0 at `horizon`; without a horizon it is 1.

    >>> linear_decay(250, 1000), linear_decay(2000, 1000), linear_decay(5, None)
    (0.75, 0.0, 1.0)
    """
    return 1.0 if horizon is None else max(0.0, 1.0 - decisions / horizon)
