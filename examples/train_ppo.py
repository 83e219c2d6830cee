"""
Train PPO on box pushing
========================

One agent drives all wheels, by stable-baselines3's PPO: a peer to compare hierarchies of fuzzy
agents with. Needs ``pip install stable-baselines3``. Then ``python train_ppo.py``, or
with a number of steps: ``python train_ppo.py 200000``.
"""

import sys

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from nested_agents.scenarios.box_pushing.environments import BoxPushingEnv

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
EPISODES = 20
torch.set_num_threads(1)  # networks this small are fastest so


def make() -> Monitor:
    """Return a world with an easy start."""
    return Monitor(BoxPushingEnv({"start": "easy"}, steps=200))


def report(when: str) -> None:
    """Play episodes with the policy as it is, and print how they go."""
    goals = []

    def watch(play: dict, _: dict) -> None:
        if play["done"]:
            goals.append(not play["info"]["TimeLimit.truncated"])

    worlds.training, worlds.norm_reward = False, False
    mean, spread = evaluate_policy(policy, worlds, n_eval_episodes=EPISODES, callback=watch)
    worlds.training, worlds.norm_reward = True, True
    print(f"{when}: {sum(goals)} of {EPISODES} goals, sum of rewards {mean:.3f} +- {spread:.3f}")


# Distances have no upper bound: normalise what the policy sees, and the small rewards.
worlds = VecNormalize(DummyVecEnv([make] * 4), gamma=0.95)
policy = PPO("MlpPolicy", worlds, n_steps=256, gamma=0.95, seed=0, device="cpu")
report("before training")
policy.learn(STEPS)
report(f"after {policy.num_timesteps} steps")
