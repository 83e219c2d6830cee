"""Networks of stable-baselines3: made without an environment, acted by as arrays, remembered.

The policy, its buffers and its update are stable-baselines3's; here is what its own loop does in
between. Several agents with shared weights are to it as many environments side by side. A time
limit is no end: the last reward of an episode that did not terminate is added the discounted value
of the state that it broke off in (Pardo et al. 2018).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor

from ..interface.agents import Memory, under
from ..numerics import AnyArray, FloatArray, IntArray
from .acting import InputNames, SharedPolicy
from .inputs import RewardScale
from .settings import PolicyGradientSettings

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


def weights_of(policy: torch.nn.Module) -> Memory:
    """Return all weights of a network by name."""
    return {name: value.numpy().copy() for name, value in policy.state_dict().items()}


def bytes_of(policy: torch.nn.Module) -> int:
    """Return how much memory the weights of a network take."""
    return sum(array.nbytes for array in weights_of(policy).values())


def set_weights(policy: torch.nn.Module, weights: Mapping[str, AnyArray]) -> None:
    """Set all weights of a network, in place.

    Raises
    ------
    ValueError
        If they are those of another network; one line.
    """
    for name, own in weights_of(policy).items():
        saved = weights[name].shape if name in weights else "missing"
        if saved != own.shape:
            raise ValueError(f"team: saved weights {name}: {saved}, this team's: {own.shape}")
    policy.load_state_dict({name: torch.as_tensor(array) for name, array in weights.items()})


def moments_of(optimizer: torch.optim.Optimizer) -> Memory:
    """Return what Adam remembers of each parameter, by its number and name."""
    states = optimizer.state_dict()["state"]
    return {
        f"{number}.{name}": value.numpy().copy()
        for number, state in states.items()
        for name, value in state.items()
    }


def set_moments(optimizer: torch.optim.Optimizer, moments: Mapping[str, AnyArray]) -> None:
    """Set what Adam remembers."""
    states: dict[int, dict[str, torch.Tensor]] = {}
    for key, array in moments.items():
        number, _, name = key.partition(".")
        states.setdefault(int(number), {})[name] = torch.as_tensor(array)
    groups = optimizer.state_dict()["param_groups"]
    optimizer.load_state_dict({"state": states, "param_groups": groups})


class SplitExtractor(MlpExtractor):
    """Hidden layers: the actor's on the leading features, the critic's on the trailing ones."""

    def __init__(
        self, actor: int, critic: int, hidden: list[int], activation: type[torch.nn.Module]
    ) -> None:
        super().__init__(critic, hidden, activation)
        self.actor = actor
        self.critic = critic
        self.policy_net = MlpExtractor(actor, hidden, activation).policy_net

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return what the actor makes of features ``(m, features)``."""
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


class ActorCritic(SharedPolicy):
    """SharedPolicy and critic with their buffer and update, for agents that share these weights.

    Parameters
    ----------
    settings
        Of PPO.
    agents
        Which agents they are: rows of what is seen, of actions and of rewards.
    actions
        Space of what one of them does.
    widths
        How many inputs, in this order, the actor sees, both see, and the critic sees.
    rng
        Source of everything random in it.
    """

    def __init__(
        self,
        settings: PolicyGradientSettings,
        agents: IntArray,
        actions: spaces.Space[Any],
        widths: tuple[int, int, int],
        rng: np.random.Generator,
    ) -> None:
        of_actor, of_both, of_critic = widths
        split = {"actor": of_actor + of_both, "critic": of_both + of_critic}
        is_split = of_actor > 0 or of_critic > 0
        options = {"net_arch": list(settings.hidden)} | (split if is_split else {})
        model = PPO(
            SplitPolicy if is_split else "MlpPolicy",
            None,
            learning_rate=settings.learning_rate,
            n_steps=settings.rollout,
            batch_size=settings.batch_size,
            n_epochs=settings.epochs,
            gamma=settings.discount,
            gae_lambda=settings.gae_lambda,
            clip_range=settings.clip,
            ent_coef=settings.entropy,
            policy_kwargs=options,
            device="cpu",
            _init_setup_model=False,
        )
        prepare(model, sum(widths), actions, len(agents), rng)
        model.policy.set_training_mode(False)
        hidden = model.policy.mlp_extractor
        self.model = model
        self.agents = agents
        self._rng = rng
        self.actor = Layers([hidden.policy_net, model.policy.action_net], np.tanh)
        self.critic = Layers([hidden.value_net, model.policy.value_net], np.tanh)
        self._of_actor = of_actor
        self._discount = settings.discount
        self._rewards = RewardScale(settings.discount, len(agents))
        self._starts: FloatArray = np.ones(len(agents))

    def learn(
        self, seen: FloatArray, actions: IntArray, logs: FloatArray, reward: FloatArray
    ) -> None:
        """Keep a step of all agents; if the buffer was full before it, update the policy first."""
        seen = seen[self.agents]
        values = torch.as_tensor(self._values(seen))
        if self.model.rollout_buffer.full:
            self._update(values, done=False)
        self.model.rollout_buffer.add(
            seen,
            actions[self.agents],
            self._rewards.scaled(reward[self.agents]),
            self._starts,
            values,
            torch.as_tensor(logs[self.agents]),
        )
        self._starts = np.zeros(len(seen))

    def end_episode(self, seen: FloatArray, *, terminated: bool) -> None:
        """Bootstrap from where the episode broke off; update the policy if the buffer is full."""
        buffer, values = self.model.rollout_buffer, self._values(seen[self.agents])
        if not terminated:
            buffer.rewards[buffer.pos - 1] += self._discount * values
        self._starts = np.ones(len(values))
        self._rewards.end_episode()
        if buffer.full:
            self._update(torch.as_tensor(values), done=True)

    def _values(self, seen: FloatArray) -> FloatArray:
        return self.critic(seen[:, self._of_actor :]).ravel()

    def _update(self, values: torch.Tensor, *, done: bool) -> None:
        buffer = self.model.rollout_buffer
        ends = np.full(len(self._starts), done)
        buffer.compute_returns_and_advantage(last_values=values, dones=ends)
        with drawing_from(self._rng):
            self.model.train()
        buffer.reset()

    @property
    def weight_bytes(self) -> int:
        """How much memory the weights take."""
        return bytes_of(self.model.policy)

    def memory(self) -> Memory:
        """Return all that is remembered: weights, Adam's moments, what the buffer holds."""
        buffer = self.model.rollout_buffer
        held = buffer.buffer_size if buffer.full else buffer.pos
        kept = {name: vars(buffer)[name][:held] for name in BUFFERED}
        parts = {
            "weights": weights_of(self.model.policy),
            "adam": moments_of(self.model.policy.optimizer),
            "scale": self._rewards.memory(),
            "buffer": {**kept, "starts": self._starts},
        }
        return {f"{part}.{name}": a for part, arrays in parts.items() for name, a in arrays.items()}

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned."""
        set_weights(self.model.policy, under("weights.", memory))
        set_moments(self.model.policy.optimizer, under("adam.", memory))
        self._rewards.restore(under("scale.", memory))
        buffer = self.model.rollout_buffer
        buffer.reset()
        kept = under("buffer.", memory)
        self._starts = kept["starts"].copy()
        held = len(kept["rewards"])
        for name in BUFFERED:
            vars(buffer)[name][:held] = kept[name]
        buffer.full = held == buffer.buffer_size
        buffer.pos = held

    def continue_from(
        self, former: ActorCritic, names: InputNames, former_names: InputNames
    ) -> None:
        """Begin with the weights of another one, whose inputs may be others."""
        weights = weights_of(self.model.policy)
        for name, array in weights_of(former.model.policy).items():
            net = next((n for n in names if name == f"mlp_extractor.{n}.0.weight"), None)
            if net is None:
                weights[name] = array
                continue
            weights[name] = np.zeros_like(weights[name])
            places = {input_: column for column, input_ in enumerate(former_names[net])}
            for column, input_ in enumerate(names[net]):
                if input_ in places:
                    weights[name][:, column] = array[:, places[input_]]
        set_weights(self.model.policy, weights)
        self._rewards.restore(former._rewards.memory())


BUFFERED = (
    "observations",
    "actions",
    "rewards",
    "episode_starts",
    "values",
    "log_probs",
)
"""Arrays of a rollout buffer, step by step."""
