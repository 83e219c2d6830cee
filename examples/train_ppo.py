"""
Train PPO of stable-baselines3 in any of our environments
=========================================================

One policy drives all wheels in a registered Gymnasium environment; four copies run in parallel.
Needs ``pip install stable-baselines3``. Then run ``python train_ppo.py``, or give a number of steps
and the id of another environment: ``python train_ppo.py 200000 NestedAgents/Arm-v0``.
"""

import sys

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecNormalize

from nested_agents.environments import env_id

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
ENVIRONMENT = sys.argv[2] if len(sys.argv) > 2 else env_id("BoxPushing")
OPTIONS = {"start": "easy", "steps": 200} if "BoxPushing" in ENVIRONMENT else {}
EPISODES = 20
torch.set_num_threads(1)  # small networks are fastest with one thread


def report(when: str) -> None:
    """Evaluate the policy and print its mean return."""
    environments.training, environments.norm_reward = False, False
    mean, spread = evaluate_policy(policy, environments, n_eval_episodes=EPISODES)
    environments.training, environments.norm_reward = True, True
    print(f"{when}: return {mean:.3f} +- {spread:.3f} in {EPISODES} episodes of {ENVIRONMENT}")


copies = make_vec_env(lambda: gymnasium.make(ENVIRONMENT, **OPTIONS), 4, seed=0)
# Distances have no upper bound: normalize observations, and the small rewards.
environments = VecNormalize(copies, gamma=0.95)
policy = PPO("MlpPolicy", environments, n_steps=256, gamma=0.95, seed=0, device="cpu")
report("before training")
policy.learn(STEPS)
report(f"after {policy.num_timesteps} steps")
