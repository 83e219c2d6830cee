"""A policy of stable-baselines3 whose actor sees other inputs than its critic."""

from typing import Any

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor


class SplitExtractor(MlpExtractor):
    """Hidden layers: the actor's on the leading features, the critic's on the trailing ones."""

    def __init__(self, actor: int, critic: int, hidden: list[int], activation: Any) -> None:
        super().__init__(critic, hidden, activation)
        self.actor, self.critic = actor, critic
        self.policy_net = MlpExtractor(actor, hidden, activation).policy_net

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what actor and critic make of features ``(m, features)``."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return what the actor makes of them."""
        return self.policy_net(features[:, : self.actor])

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return what the critic makes of them."""
        return self.value_net(features[:, -self.critic :])


class SplitPolicy(ActorCriticPolicy):
    """An actor on the leading inputs, a critic on the trailing ones; they may overlap.

    Parameters
    ----------
    actor, critic
        How many inputs each sees.
    """

    def __init__(self, *args: Any, actor: int, critic: int, **options: Any) -> None:
        self._seen = actor, critic
        super().__init__(*args, **options)

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = SplitExtractor(*self._seen, self.net_arch, self.activation_fn)
