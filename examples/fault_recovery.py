"""
Faults in an environment of Gymnasium
=====================================

PPO of stable-baselines3 learns to balance a pole. Then its motor is delayed by two steps, or
reversed, for six episodes. The table shows the loss of PPO and of a random policy. Needs
``pip install stable-baselines3``. Then run ``python fault_recovery.py``, or give a number of
training steps: ``python fault_recovery.py 50000``.
"""

# sphinx_gallery_thumbnail_path = "figures/wheel_failure.png"
import sys

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

from nested_agents import faults

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
torch.set_num_threads(1)  # networks this small are fastest so


def make() -> gymnasium.Env:
    """Return the cart and its pole."""
    return gymnasium.make("CartPole-v1")


# The settings of RL Baselines3 Zoo, but with a constant step size and clipping range.
trained = PPO(
    "MlpPolicy", make_vec_env(make, n_envs=8, seed=0), n_steps=32, batch_size=256, n_epochs=20,
    gamma=0.98, gae_lambda=0.8, learning_rate=1e-3, clip_range=0.2, seed=0, device="cpu",
)  # fmt: skip
trained.learn(STEPS)
policies = {"PPO": trained, "random": faults.RandomPolicy(make().action_space)}
schedules = {
    "late": [faults.Delayed(actuators=0, periods=2, episode=6, end_episode=12)],
    "reversed": [faults.Reversed(actuators=0, episode=6, step=50, end_episode=12)],
}
print(faults.recovery_table(make, policies, schedules, seeds=4, episodes=18))
