"""DQN of stable-baselines3, decision by decision, for a scenario of one agent."""

import numpy as np
from gymnasium.spaces import Discrete
from stable_baselines3 import DQN

from ..interface.scenario import Scenario, Transition
from ..numerics import FloatArray, IntArray
from .networks import Layers, drawing_from, prepare, weights_of
from .peer import Inputs, Peer, RewardScale, Seen
from .settings import DQNSettings


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
