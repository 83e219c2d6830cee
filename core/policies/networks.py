"""What peers with networks share: acting by their weights, their random numbers, their arrays.

And a policy of stable-baselines3 whose actor sees other inputs than its critic.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor

from ..numerics import FloatArray

# Equal sums on a machine, whatever else runs; small networks are fastest so.
torch.set_num_threads(1)


class Layers:
    """A network as arrays: a decision takes a third of the time that PyTorch takes, or less.

    The arrays are those of the modules, so what these learn is acted by at once.

    Parameters
    ----------
    modules
        In order; their linear layers are taken, and inputs beyond those of the first are left out.
    activation
        After every layer but the last.
    """

    def __init__(
        self, modules: list[torch.nn.Module], activation: Callable[[FloatArray], FloatArray]
    ) -> None:
        layers = [m for part in modules for m in part.modules() if isinstance(m, torch.nn.Linear)]
        self._layers = [(m.weight.detach().numpy().T, m.bias.detach().numpy()) for m in layers]
        self._activation = activation

    def __call__(self, inputs: FloatArray) -> FloatArray:
        """Return the outputs ``(m, k)`` for inputs ``(m, d)``."""
        *hidden, (weights, biases) = self._layers
        outputs = inputs[:, : len(self._layers[0][0])]
        for into, shift in hidden:
            outputs = self._activation(outputs @ into + shift)
        return outputs @ weights + biases


@contextmanager
def drawing_from(rng: np.random.Generator) -> Iterator[None]:
    """Let the global generators of NumPy and PyTorch follow from `rng`, and put them back."""
    before = np.random.get_state(), torch.random.get_rng_state()  # noqa: NPY002
    seed = int(rng.integers(2**32))
    np.random.seed(seed)  # noqa: NPY002
    torch.default_generator.manual_seed(seed)  # torch.manual_seed walks the stack for every GPU
    try:
        yield
    finally:
        np.random.set_state(before[0])  # noqa: NPY002
        torch.random.set_rng_state(before[1])


def prepare(
    model: Any, inputs: int, actions: spaces.Space[Any], n_envs: int, rng: np.random.Generator
) -> None:
    """Give a model its spaces, and make its networks without an environment and without a log."""
    model.observation_space = spaces.Box(-np.inf, np.inf, (inputs,), dtype=np.float32)
    model.action_space, model.n_envs = actions, n_envs
    with drawing_from(rng):
        model._setup_model()
    model.set_logger(Logger(None, []))


def weights_of(policy: torch.nn.Module) -> dict[str, FloatArray]:
    """Return all weights of a network by name."""
    return {name: value.numpy().copy() for name, value in policy.state_dict().items()}


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
