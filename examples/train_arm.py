"""
Train PPO in any of our worlds
==============================

stable-baselines3's PPO in an environment that is made by its id, several worlds side by side: an
arm of three joints, one of which loses half its drive after 40 episodes of each world. Needs
``pip install stable-baselines3``. Then ``python train_arm.py``, or with a number of steps and the
id of another world: ``python train_arm.py 200000 NestedAgents/LineUp-v0``.
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
WORLD = sys.argv[2] if len(sys.argv) > 2 else env_id("Arm")
WEAK = {"kind": "weak", "joints": "joint2", "gain": 0.5, "episode": 40}
OPTIONS = {"joints": 3, "failures": [WEAK]} if "Arm" in WORLD else {}
EPISODES = 20
torch.set_num_threads(1)  # networks this small are fastest so


def report(when: str) -> None:
    """Play episodes with the policy as it is, and print how they go."""
    worlds.training, worlds.norm_reward = False, False
    mean, spread = evaluate_policy(policy, worlds, n_eval_episodes=EPISODES)
    worlds.training, worlds.norm_reward = True, True
    print(f"{when}: sum of rewards {mean:.3f} +- {spread:.3f} in {EPISODES} episodes of {WORLD}")


made = make_vec_env(lambda: gymnasium.make(WORLD, **OPTIONS), 4, seed=0)
worlds = VecNormalize(made, gamma=0.95)
policy = PPO("MlpPolicy", worlds, n_steps=256, gamma=0.95, seed=0, device="cpu")
report("before training")
policy.learn(STEPS)
report(f"after {policy.num_timesteps} steps")
