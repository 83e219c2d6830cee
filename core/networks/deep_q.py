"""DQN of one agent (Mnih et al. 2015), decision by decision."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Self

import numpy as np
from gymnasium.spaces import Discrete
from stable_baselines3 import DQN

from ..hierarchy.turns import Turn
from ..interface.agents import Agents, Counts, Memory, Placement, under
from ..interface.experience import Experience, Observation
from ..interface.scenario import Scenario
from ..numerics import AnyArray, FloatArray, IntArray, set_words, words_of
from .inputs import Inputs, RewardScale
from .settings import DQNSettings
from .training import (
    Layers,
    bytes_of,
    drawing_from,
    moments_of,
    prepare,
    set_moments,
    set_weights,
    weights_of,
)

REPLAYED = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer, step by step."""


class ValueInputs(NamedTuple):
    """What it decides by."""

    seen: FloatArray
    """``(1, k)`` all states."""
    explore: bool


class DeepQ(Agents[ValueInputs]):
    """One agent that learns the value of each of its actions.

    Parameters
    ----------
    settings
        Of DQN.
    placement
        Of one agent.

    Raises
    ------
    ValueError
        If there are more agents.
    """

    def __init__(self, settings: DQNSettings, placement: Placement) -> None:
        scenario = placement.scenario
        if len(placement.members) > 1:
            raise ValueError(
                f"learner.kind = 'dqn': acts for one agent, there are {len(placement.members)}; "
                "use agents = 'team'"
            )
        self.rng = np.random.Generator(np.random.PCG64(placement.seed))
        self._settings = settings
        self._scenario = scenario
        self._members = placement.members
        self._inputs = Inputs(scenario)
        self._n_actions = len(scenario.action_set)
        model = DQN(
            "MlpPolicy",
            None,
            learning_rate=settings.learning_rate,
            buffer_size=settings.memory,
            batch_size=settings.batch_size,
            gamma=settings.discount,
            policy_kwargs={"net_arch": list(settings.hidden)},
            device="cpu",
            _init_setup_model=False,
        )
        prepare(model, self._inputs.n_joint, Discrete(self._n_actions), 1, self.rng)
        self._model = model
        self._decisions = 0
        self._counts = Counts()
        self._q = Layers([model.q_net], lambda sums: np.maximum(sums, 0.0))
        self._rewards = RewardScale(settings.discount, 1)

    @property
    def exploration_rate(self) -> float:
        """Probability of a random action at the present decision."""
        s = self._settings
        share = min(1.0, self._decisions / s.exploration_decisions)
        return s.exploration_begin + share * (s.exploration_end - s.exploration_begin)

    @property
    def counts(self) -> Counts:
        """What it has evaluated so far: all its actions, unless one was drawn."""
        return self._counts

    @property
    def weight_bytes(self) -> int:
        """How much memory the weights of the network and its target take."""
        return bytes_of(self._model.policy)

    def perceive(self, seen: Observation, *, explore: bool) -> ValueInputs:
        """Return all states."""
        return ValueInputs(self._inputs.joint(seen.present)[None].astype(np.float32), explore)

    def decide(self, inputs: ValueInputs, turn: Turn) -> IntArray:
        """Return the action ``(1,)`` of the greatest value, or a random one."""
        if inputs.explore and self.rng.random() < self.exploration_rate:
            return np.array([int(self.rng.integers(self._n_actions))])
        self._counts.joint_actions += self._n_actions
        return np.array([int(self._q(inputs.seen).argmax())])

    def learn(self, experience: Experience, inputs: ValueInputs) -> None:
        """Keep the step; update the network and its target when they are due."""
        transition = experience.transition
        entered = self._inputs.joint(transition.states)[None].astype(np.float32)
        own = np.asarray(transition.reward)
        own = own[self._members] if own.ndim else own
        reward = self._rewards.scaled(np.array([np.mean(own)]))
        done = np.array([float(transition.terminated)])
        action = experience.decision.joint_action[self._members][None]
        self._model.replay_buffer.add(inputs.seen, entered, action, reward, done, [{}])
        self._decisions += 1
        s = self._settings
        if self._decisions >= s.begin and self._decisions % s.interval == 0:
            with drawing_from(self.rng):
                self._model.train(gradient_steps=1, batch_size=s.batch_size)
        if self._decisions % s.target_interval == 0:
            self._model.q_net_target.load_state_dict(self._model.q_net.state_dict())
        if experience.last:
            self._rewards.end_episode()

    def memory(self) -> Memory:
        """Return all that it remembers: weights, Adam's moments, the replay buffer."""
        buffer = self._model.replay_buffer
        held = buffer.buffer_size if buffer.full else buffer.pos
        replay = {name: vars(buffer)[name][:held] for name in REPLAYED}
        parts = {
            "weights": weights_of(self._model.policy),
            "adam": moments_of(self._model.policy.optimizer),
            "scale": self._rewards.memory(),
            "replay": {**replay, "place": np.array([buffer.pos, self._decisions])},
        }
        memory = {f"{part}.{name}": a for part, own in parts.items() for name, a in own.items()}
        return memory | {"generator": words_of(self.rng)}

    def restore(self, memory: Mapping[str, AnyArray]) -> None:
        """Continue from what `memory` returned."""
        set_weights(self._model.policy, under("weights.", memory))
        set_moments(self._model.policy.optimizer, under("adam.", memory))
        self._rewards.restore(under("scale.", memory))
        replay = under("replay.", memory)
        buffer = self._model.replay_buffer
        held = len(replay["rewards"])
        for name in REPLAYED:
            vars(buffer)[name][:held] = replay[name]
        buffer.full = held == buffer.buffer_size
        buffer.pos, self._decisions = map(int, replay["place"])
        set_words(self.rng, memory["generator"])

    def check_world(self, scenario: Scenario) -> None:
        """Refuse a world of other states or actions."""
        if scenario.state_space != self._scenario.state_space:
            raise ValueError("learner.kind = 'dqn': trained over another state space")
        if scenario.action_set != self._scenario.action_set:
            raise ValueError("learner.kind = 'dqn': trained with other actions")

    def continue_from(self, former: Self) -> None:
        """Begin with all that another one of the same inputs has learned.

        Raises
        ------
        ValueError
            If its states or actions are others; one line.
        """
        former.check_world(self._scenario)
        self.restore(former.memory())
