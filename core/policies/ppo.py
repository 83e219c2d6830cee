"""PPO of stable-baselines3, decision by decision: centralised, independent, with a central critic.

The policy, its rollout buffer and its update are stable-baselines3's; here is what its own loop
does in between. Actions are drawn by adding Gumbel noise to the logarithms of probabilities.
Several agents with shared weights are to it as many environments side by side. A time limit is no
end: the last reward of an episode that did not terminate is added the discounted value of the state
that it broke off in (Pardo et al. 2018).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Discrete, MultiDiscrete
from scipy.special import logsumexp
from stable_baselines3 import PPO

from ..interface.scenario import Scenario, Transition
from ..numerics.arrays import FloatArray, IntArray
from .central_critic import CentralCriticPolicy
from .inputs import Inputs, RewardScale
from .networks import Layers, drawing_from, prepare, weights_of
from .peer import Peer, Seen
from .settings import PolicyGradientSettings


class IndependentPPO(Peer):
    """One policy for every agent, which sees its own state alone; all share the weights.

    Parameters
    ----------
    settings
        Of PPO.
    scenario
        Where it acts.
    seed
        Source of everything random in it.
    """

    policy: Any = "MlpPolicy"

    def __init__(
        self, settings: PolicyGradientSettings, scenario: Scenario, seed: np.random.SeedSequence
    ) -> None:
        super().__init__(seed)
        self.inputs, self._n = Inputs(scenario), len(scenario.agents)
        n_envs, n_inputs, actions, options = self._shape(len(scenario.action_set))
        model = PPO(
            self.policy, None, learning_rate=settings.learning_rate,
            n_steps=settings.rollout, batch_size=settings.batch_size, n_epochs=settings.epochs,
            gamma=settings.discount, gae_lambda=settings.gae_lambda, clip_range=settings.clip,
            ent_coef=settings.entropy, policy_kwargs={"net_arch": list(settings.hidden)} | options,
            device="cpu", _init_setup_model=False,
        )  # fmt: skip
        prepare(model, n_inputs, actions, n_envs, self.rng)
        self._model, self._discount = model, settings.discount
        model.policy.set_training_mode(False)
        hidden = model.policy.mlp_extractor
        self._actor = Layers([hidden.policy_net, model.policy.action_net], np.tanh)
        self._critic = Layers([hidden.value_net, model.policy.value_net], np.tanh)
        self._n_actions = len(scenario.action_set)
        self._rewards = RewardScale(settings.discount, n_envs)
        self._starts: FloatArray = np.ones(n_envs)

    def _shape(self, n_actions: int) -> tuple[int, int, Any, dict[str, Any]]:
        """Return how many act side by side, on how many inputs each, the actions, and options."""
        return self._n, self.inputs.n_own, Discrete(n_actions), {}

    def _seen(self, states: FloatArray) -> FloatArray:
        """Return the inputs ``(n_envs, n_inputs)``."""
        return self.inputs.each(states)

    def act(self, prediction: Seen, *, explore: bool = True) -> IntArray:
        """Return a joint action ``(n,)``: drawn from the policy, or the most probable."""
        seen = self._seen(prediction.present).astype(np.float32)
        logits = self._actor(seen).reshape(self._n, self._n_actions)
        if not explore:
            return logits.argmax(axis=1)
        actions = (logits + self.rng.gumbel(size=logits.shape)).argmax(axis=1)
        logs = logits[np.arange(self._n), actions] - logsumexp(logits, axis=1)
        self._decided = seen, actions, logs.reshape(len(seen), -1).sum(axis=1)
        return actions

    def learn(self, transition: Transition) -> None:
        """Keep the step; if the buffer was full before it, update the policy first."""
        seen, actions, logs = self._decided
        values = torch.as_tensor(self._critic(seen).ravel())
        if self._model.rollout_buffer.full:
            self._update(values, done=False)
        rewards = self._rewards.scaled(self._share(transition.reward))
        self._model.rollout_buffer.add(
            seen, actions.reshape(len(seen), -1), rewards, self._starts, values,
            torch.as_tensor(logs),
        )  # fmt: skip
        self._starts = np.zeros(len(seen))
        self._last = transition

    def end_episode(self) -> None:
        """Bootstrap from where the episode broke off; update the policy if the buffer is full."""
        buffer, last = self._model.rollout_buffer, self._last
        values = self._critic(self._seen(last.states).astype(np.float32)).ravel()
        if not last.terminated:
            buffer.rewards[buffer.pos - 1] += self._discount * values
        self._starts = np.ones(len(values))
        self._rewards.end_episode()
        if buffer.full:
            self._update(torch.as_tensor(values), done=True)

    def _update(self, values: torch.Tensor, *, done: bool) -> None:
        buffer = self._model.rollout_buffer
        ends = np.full(len(self._starts), done)
        buffer.compute_returns_and_advantage(last_values=values, dones=ends)
        with drawing_from(self.rng):
            self._model.train()
        buffer.reset()

    def _share(self, reward: float | FloatArray) -> FloatArray:
        """Return the reward of everybody who acts side by side."""
        return np.broadcast_to(np.asarray(reward, dtype=float), (self._n,)).copy()

    def arrays(self) -> dict[str, FloatArray]:
        """Return the weights of policy and critic."""
        return weights_of(self._model.policy)


class CentralPPO(IndependentPPO):
    """One policy that sees all states and acts for all agents."""

    def _shape(self, n_actions: int) -> tuple[int, int, Any, dict[str, Any]]:
        actions = Discrete(n_actions) if self._n == 1 else MultiDiscrete([n_actions] * self._n)
        return 1, self.inputs.n_joint, actions, {}

    def _seen(self, states: FloatArray) -> FloatArray:
        return self.inputs.joint(states)[None]

    def _share(self, reward: float | FloatArray) -> FloatArray:
        return np.array([np.mean(reward)])


class CentralCriticPPO(IndependentPPO):
    """One policy for every agent, with a critic that sees all states beside the agent's own."""

    policy = CentralCriticPolicy

    def _shape(self, n_actions: int) -> tuple[int, int, Any, dict[str, Any]]:
        own = self.inputs.n_own
        return self._n, own + self.inputs.n_joint, Discrete(n_actions), {"own": own}

    def _seen(self, states: FloatArray) -> FloatArray:
        joint = np.tile(self.inputs.joint(states), (self._n, 1))
        return np.hstack([self.inputs.each(states), joint])
