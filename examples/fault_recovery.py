"""
Faults in an environment of Gymnasium
=====================================

PPO of stable-baselines3 learns to swing a pendulum up; then its motor loses force, or turns the
other way round, and comes back after six episodes. The table tells what that costs. Needs PyTorch:
``pip install "nested-agents[peers]"``. Then ``python fault_recovery.py``, or with a number of
steps of training: ``python fault_recovery.py 20000``.
"""

import sys

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

from nested_agents import faults

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
torch.set_num_threads(1)  # networks this small are fastest so


def make() -> gymnasium.Env:
    """Return the pendulum."""
    return gymnasium.make("Pendulum-v1")


# The settings of RL Baselines3 Zoo.
trained = PPO(
    "MlpPolicy", make_vec_env(make, n_envs=4, seed=0), n_steps=1024, gamma=0.9, gae_lambda=0.95,
    learning_rate=1e-3, use_sde=True, sde_sample_freq=4, seed=0, device="cpu",
)  # fmt: skip
trained.learn(STEPS)
policies = {"PPO": trained, "random": faults.RandomPolicy(make().action_space)}
schedules = {
    "weak": [faults.Weak(actuators=0, gain=0.3, episode=6, end_episode=12)],
    "reversed": [faults.Reversed(actuators=0, episode=6, step=50, end_episode=12)],
}
print(faults.recovery_table(make, policies, schedules, seeds=8, episodes=18))
