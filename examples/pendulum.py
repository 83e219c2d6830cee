"""
A task of Gymnasium as a scenario
=================================

``Pendulum-v1`` is stepped by Gymnasium itself; its equation of motion is the prediction. One agent
swings the pendulum up and holds it there. Run it as a study by
``nested-agents run examples/pendulum.toml``, check it by
``nested-agents check examples/pendulum.py:Pendulum``.
"""

import gymnasium
import numpy as np

import nested_agents as na

TORQUES = (-2.0, -0.5, 0.0, 0.5, 2.0)
"""What an action commands [N m]."""
WORST = 16.2736
"""The greatest cost of a step: -16.2736 is Gymnasium's least reward."""


class Pendulum:
    """Gymnasium's pendulum with five torques, each held for `hold` steps of 50 ms."""

    class Settings(na.ScenarioSettings):
        """The ``[scenario]`` table of a spec."""

        hold: int = 2

    measures = (
        na.Measure("success", "upright at the end", source="upright", better="higher",
                   is_rate=True),
        na.Measure("gym_return", "return of Gymnasium", "1", "gym_reward", "sum", "higher"),
    )  # fmt: skip

    def __init__(self, settings=Settings()):  # noqa: B008 - frozen
        self.hold = settings.hold
        self.env = gymnasium.make("Pendulum-v1", max_episode_steps=None).unwrapped
        self.agents = ("motor",)
        self.action_set = na.ActionSet(("--", "-", "0", "+", "++"), (0,) * 5, TORQUES, neutral=2)
        angle = na.Variable("angle", "rad", -np.pi, np.pi, periodic=True)
        speed = na.Variable("speed", "rad/s", -8.0, 8.0)
        self.state_space = na.StateSpace("pendulum", (angle, speed))

    def reset(self, seed, episode=0):
        """Let Gymnasium draw angle and speed."""
        sequence = np.random.SeedSequence(seed) if isinstance(seed, int) else seed
        self.env.reset(seed=int(sequence.generate_state(1)[0]))
        return self.states(self.env.state)

    def step(self, joint_action):
        """Let Gymnasium hold a torque."""
        rewards = [
            self.env.step(np.array([TORQUES[joint_action[0]]], dtype=np.float32))[1]
            for _ in range(self.hold)
        ]
        states = self.states(self.env.state)
        angle, speed = states[0]
        info = {"gym_reward": float(sum(rewards)), "upright": abs(angle) < 0.2 and abs(speed) < 1}
        return na.Transition(states, self.reward(angle, speed), False, False, info)

    def predict(self):
        """Predict from the present state."""
        return PendulumForecast(self)

    def with_exact_prediction(self):
        """Return this pendulum: its predictions are exact."""
        return self

    def states(self, state):
        """Return the states ``(..., 1, 2)`` of the agent, the angle within half a turn."""
        angle, speed = np.moveaxis(np.asarray(state), -1, 0)
        return np.stack([(angle + np.pi) % (2 * np.pi) - np.pi, speed], -1)[..., None, :]

    def reward(self, angle, speed):
        """Return the reward for entering a state, of the order of those of box pushing."""
        return -0.01 * (angle**2 + 0.1 * speed**2) / WORST


class PendulumForecast:
    """What torques would lead to."""

    def __init__(self, pendulum):
        self.pendulum = pendulum

    def states(self, agent, joint_actions):
        """Return the next states ``(m, 2)``."""
        return self.pendulum.states(self.ahead(joint_actions))[:, 0]

    def rewards(self, joint_actions):
        """Return the rewards ``(m,)``; for the planner, who looks one decision ahead."""
        angle, speed = np.moveaxis(self.states(0, joint_actions), -1, 0)
        return self.pendulum.reward(angle, speed)

    def ahead(self, joint_actions):
        """Return angle and speed ``(m, 2)`` by the equation of Gymnasium's documentation."""
        env = self.pendulum.env
        torque = np.array(TORQUES)[joint_actions[:, 0]]
        angle, speed = (np.full(len(torque), value) for value in env.state)
        for _ in range(self.pendulum.hold):
            pull = 3 * env.g / (2 * env.l) * np.sin(angle) + 3.0 / (env.m * env.l**2) * torque
            speed = np.clip(speed + pull * env.dt, -env.max_speed, env.max_speed)
            angle = angle + speed * env.dt
        return np.stack([angle, speed], axis=-1)
