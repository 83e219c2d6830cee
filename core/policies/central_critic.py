"""A policy of stable-baselines3 whose actor sees a part of what its critic sees."""

from __future__ import annotations

from typing import Any

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor


class SplitExtractor(MlpExtractor):
    """Hidden layers of actor and critic, of which the actor's see the leading features alone."""

    def __init__(self, own: int, features: int, hidden: list[int], activation: Any) -> None:
        super().__init__(features, hidden, activation)
        self.own = own
        self.policy_net = MlpExtractor(own, hidden, activation).policy_net

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what actor and critic make of features ``(m, features)``."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return what the actor makes of them."""
        return self.policy_net(features[:, : self.own])


class CentralCriticPolicy(ActorCriticPolicy):
    """An actor on the `own` leading inputs, a critic on all of them.

    Parameters
    ----------
    own
        How many inputs the actor sees.
    """

    def __init__(self, *args: Any, own: int, **options: Any) -> None:
        self._own = own
        super().__init__(*args, **options)

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = SplitExtractor(
            self._own, self.features_dim, self.net_arch, self.activation_fn
        )
