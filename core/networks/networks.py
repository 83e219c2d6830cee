"""Peers with networks: DQN and PPO of stable-baselines3, decision by decision.

DQN is for a scenario of one agent, PPO for agents in a hierarchy and for one that acts for all. A
network acts by its weights as arrays; a policy may have an actor that sees other inputs than its
critic.

The policy, its rollout buffer and its update are stable-baselines3's; here is what its own loop
does in between. Actions are drawn by adding Gumbel noise to the logarithms of probabilities.
Several agents with shared weights are to it as many environments side by side. In a hierarchy
agents decide level by level, and see the actions that they are told as one-hots; these are kept
with a decision, so that an update passes over all agents at once. A step is that of all agents: it
has one value and one advantage for each, whoever decided first. A time limit is no end: the last
reward of an episode that did not terminate is added the discounted value of the state that it broke
off in (Pardo et al. 2018).
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from gymnasium.spaces import Discrete, MultiDiscrete
from scipy.special import logsumexp
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor

from ..hierarchy.hierarchy import Hierarchy
from ..interface.scenario import Scenario, Transition
from ..numerics import FloatArray, IntArray
from .peer import Inputs, Passing, Peer, RewardScale, Seen
from .settings import DQNSettings, MultiAgentPPOSettings, PolicyGradientSettings, PPOSettings

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


class DeepQ(Peer):
    """One agent that learns the value of each of its actions.

    Parameters
    ----------
    settings
        Of DQN.
    scenario
        Of one agent.
    seed
        Source of everything random in it.

    Raises
    ------
    ValueError
        If there are more agents.
    """

    def __init__(
        self, settings: DQNSettings, scenario: Scenario, seed: np.random.SeedSequence
    ) -> None:
        if len(scenario.agents) > 1:
            raise ValueError(
                f"learner.kind = 'dqn': acts for one agent, there are {len(scenario.agents)}; "
                "use agents = 'team'"
            )
        super().__init__(seed)
        self._settings, self._inputs = settings, Inputs(scenario)
        self._n_actions = len(scenario.action_set)
        model = DQN(
            "MlpPolicy", None, learning_rate=settings.learning_rate, buffer_size=settings.memory,
            batch_size=settings.batch_size, gamma=settings.discount,
            policy_kwargs={"net_arch": list(settings.hidden)},
            device="cpu", _init_setup_model=False,
        )  # fmt: skip
        prepare(model, self._inputs.n_joint, Discrete(self._n_actions), 1, self.rng)
        self._model, self._decisions = model, 0
        self._q = Layers([model.q_net], lambda sums: np.maximum(sums, 0.0))
        self._rewards = RewardScale(settings.discount, 1)

    @property
    def exploration_rate(self) -> float:
        """Probability of a random action at the present decision."""
        s = self._settings
        share = min(1.0, self._decisions / s.exploration_decisions)
        return s.exploration_begin + share * (s.exploration_end - s.exploration_begin)

    def act(self, prediction: Seen, *, explore: bool = True) -> IntArray:
        """Return the action ``(1,)`` of the greatest value, or a random one."""
        seen = self._inputs.joint(prediction.present)[None].astype(np.float32)
        if explore and self.rng.random() < self.exploration_rate:
            action = int(self.rng.integers(self._n_actions))
        else:
            action = int(self._q(seen).argmax())
        if explore:
            self._decided = seen, np.array([[action]])
        return np.array([action])

    def learn(self, transition: Transition) -> None:
        """Keep the step; update the network and its target when they are due."""
        seen, action = self._decided
        entered = self._inputs.joint(transition.states)[None].astype(np.float32)
        reward = self._rewards.scaled(np.array([np.mean(transition.reward)]))
        done = np.array([float(transition.terminated)])
        self._model.replay_buffer.add(seen, entered, action, reward, done, [{}])
        self._decisions += 1
        s = self._settings
        if self._decisions >= s.begin and self._decisions % s.interval == 0:
            with drawing_from(self.rng):
                self._model.train(gradient_steps=1, batch_size=s.batch_size)
        if self._decisions % s.target_interval == 0:
            self._model.q_net_target.load_state_dict(self._model.q_net.state_dict())

    def end_episode(self) -> None:
        """Begin the return anew."""
        self._rewards.end_episode()

    def arrays(self) -> dict[str, FloatArray]:
        """Return the weights of the network and its target."""
        return weights_of(self._model.policy)


class ActorCritic:
    """Policy and critic with their buffer and update, for agents that share these weights.

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
        actions: Any,
        widths: tuple[int, int, int],
        rng: np.random.Generator,
    ) -> None:
        of_actor, of_both, of_critic = widths
        split = {"actor": of_actor + of_both, "critic": of_both + of_critic}
        is_split = of_actor > 0 or of_critic > 0
        policy: Any = SplitPolicy if is_split else "MlpPolicy"
        options = {"net_arch": list(settings.hidden)} | (split if is_split else {})
        model = PPO(
            policy, None, learning_rate=settings.learning_rate,
            n_steps=settings.rollout, batch_size=settings.batch_size, n_epochs=settings.epochs,
            gamma=settings.discount, gae_lambda=settings.gae_lambda, clip_range=settings.clip,
            ent_coef=settings.entropy, policy_kwargs=options,
            device="cpu", _init_setup_model=False,
        )  # fmt: skip
        prepare(model, sum(widths), actions, len(agents), rng)
        model.policy.set_training_mode(False)
        hidden = model.policy.mlp_extractor
        self.model, self.agents, self._rng = model, agents, rng
        self.actor = Layers([hidden.policy_net, model.policy.action_net], np.tanh)
        self.critic = Layers([hidden.value_net, model.policy.value_net], np.tanh)
        self._of_actor, self._discount = of_actor, settings.discount
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
            seen, actions[self.agents], self._rewards.scaled(reward[self.agents]), self._starts,
            values, torch.as_tensor(logs[self.agents]),
        )  # fmt: skip
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


class HierarchyPPO(Peer):
    """One policy for every agent, on its own state and the actions that it is told.

    Parameters
    ----------
    settings
        Of PPO, whose weights are whose, and what the critic sees.
    scenario
        Where they act.
    seed
        Source of everything random in them.
    hierarchy
        Who is told by whom; None: nobody is.

    Attributes
    ----------
    parts
        By name, policies that share no weights.

    Raises
    ------
    ValueError
        If some agents are neighbours; one line.
    """

    is_sampled = True

    def __init__(
        self,
        settings: MultiAgentPPOSettings | PPOSettings,
        scenario: Scenario,
        seed: np.random.SeedSequence,
        hierarchy: Hierarchy | None = None,
    ) -> None:
        super().__init__(seed)
        self.settings, self.inputs = settings, Inputs(scenario, numbered=settings.numbered)
        self.shape = n, n_actions = len(scenario.agents), len(scenario.action_set)
        hierarchy = hierarchy or Hierarchy(scenario.agents, [])
        if hierarchy.neighbours:
            raise ValueError(
                f"learner.kind = {settings.kind!r}: neighbours decide at the same time and tell "
                "each other nothing, use a topology without them"
            )
        owners = {"all": ("all",) * n, "role": scenario.roles, "own": scenario.agents}
        names, rows = np.unique(owners[settings.weights], return_inverse=True)
        self.passing = Passing(hierarchy, n_actions, rows)
        self._n_joint = self.inputs.n_joint if settings.critic == "central" else 0
        self.parts = {
            str(name): self.part_of(np.flatnonzero(rows == row)) for row, name in enumerate(names)
        }
        self._actors = [part.actor for part in self.parts.values()]

    def part_of(self, agents: IntArray) -> ActorCritic:
        """Return the policy and critic of agents that share weights."""
        widths = self.passing.width, self.inputs.n_own, self._n_joint
        return ActorCritic(self.settings, agents, Discrete(self.shape[1]), widths, self.rng)

    def of_actors(self, states: FloatArray) -> FloatArray:
        """Return inputs of actors ``(rows, k)``: nothing is told yet, and each agent's state."""
        own = self.inputs.each(states).astype(np.float32)
        return np.hstack([np.zeros((len(own), self.passing.width), dtype=np.float32), own])

    def with_critics(self, seen: FloatArray, states: FloatArray) -> FloatArray:
        """Return inputs of actors, and after them all states if critics see these."""
        if not self._n_joint:
            return seen
        joint = np.tile(self.inputs.joint(states).astype(np.float32), (len(seen), 1))
        return np.hstack([seen, joint])

    def decide(
        self, states: FloatArray, noise: FloatArray
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return the inputs of actors, logits ``(n, A)``, and the greatest with noise ``(n,)``.

        Agents decide from the top down; what is decided is written into what others see.
        """
        seen = self.of_actors(states)
        logits, joint = np.empty(self.shape, np.float32), np.empty(self.shape[0], np.int64)
        for turn in self.passing.turns:
            agents = turn.agents
            own = self._actors[turn.weights](seen[agents]).reshape(-1, self.shape[1])
            logits[agents] = own
            joint[agents] = (own + noise[agents]).argmax(axis=1)
            self.passing.tell(turn, joint, seen)
        return seen, logits, joint

    def act(self, prediction: Seen, *, explore: bool = True) -> IntArray:
        """Return a joint action ``(n,)``: drawn from the policies, or the most probable."""
        noise = self.rng.gumbel(size=self.shape) if explore else np.zeros(self.shape)
        seen, logits, joint = self.decide(prediction.present, noise)
        if explore:
            self._decided = prediction.present, seen, logits, joint
        return joint

    def learn(self, transition: Transition) -> None:
        """Keep the step, and update the policies whose buffers were full."""
        states, seen, logits, joint = self._decided
        chosen = logits[np.arange(len(joint)), joint] - logsumexp(logits, axis=1)
        actions, logs = joint.reshape(len(seen), -1), chosen.reshape(len(seen), -1).sum(axis=1)
        reward = np.asarray(transition.reward, dtype=float)
        is_joint = self.settings.value_of == "team"
        reward = np.broadcast_to(reward.mean() if is_joint else reward, len(seen))
        seen = self.with_critics(seen, states)
        for part in self.parts.values():
            part.learn(seen, actions, logs, reward)
        self._last = transition

    def end_episode(self) -> None:
        """Bootstrap, and update the policies whose buffers are full."""
        states = self._last.states
        seen = self.with_critics(self.of_actors(states), states)
        for part in self.parts.values():
            part.end_episode(seen, terminated=self._last.terminated)

    def arrays(self) -> dict[str, FloatArray]:
        """Return the weights of policies and critics."""
        weights = {name: weights_of(part.model.policy) for name, part in self.parts.items()}
        return {f"{name}.{key}": w for name, own in weights.items() for key, w in own.items()}


class CentralPPO(HierarchyPPO):
    """One policy that sees all states, once, and acts for all agents."""

    def part_of(self, agents: IntArray) -> ActorCritic:
        """Return the policy and critic of all."""
        n, n_actions = self.shape
        actions = Discrete(n_actions) if n == 1 else MultiDiscrete([n_actions] * n)
        widths = 0, self.inputs.n_joint, 0
        return ActorCritic(self.settings, np.arange(1), actions, widths, self.rng)

    def of_actors(self, states: FloatArray) -> FloatArray:
        """Return all states ``(1, k)``."""
        return self.inputs.joint(states)[None].astype(np.float32)
