"""
A broken joint of HalfCheetah
=============================

PPO of stable-baselines3 learns to run with six joints; then one of them loses its drive. The table
shows the loss just after the fault and after further training with it. A control trains equally
long without a fault. Needs ``pip install stable-baselines3 mujoco``. Then run
``python broken_joint.py cheetah.json 500000 300000 2``. The arguments are the file for the returns,
the numbers of training steps before and after the fault, and the number of seeds.
"""

# sphinx_gallery_thumbnail_path = "figures/wheel_failure.png"
import json
import sys
from pathlib import Path

import gymnasium
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from nested_agents import faults

PATH, (BEFORE, AFTER, SEEDS) = Path(sys.argv[1]), map(int, sys.argv[2:5])
JOINTS = {"back foot": 2, "back thigh": 0, "fore foot": 5, "fore thigh": 3}
FAULT = {name: [faults.Free(actuators=joint, episode=5)] for name, joint in JOINTS.items()}
torch.set_num_threads(1)  # networks this small are fastest so


def make() -> gymnasium.Env:
    """Return the cheetah with six sound joints."""
    return gymnasium.make("HalfCheetah-v5")


def train(seed: int, name: str) -> PPO:
    """Return what has learned as `name` says; it is stored, so that a run goes on where it was."""
    path, source = (PATH.parent / f"{PATH.stem}-{seed}-{it}.zip" for it in (name, "six joints"))
    fault = [faults.Free(actuators=JOINTS[name], episode=0)] if name in JOINTS else []
    worlds = DummyVecEnv([lambda: faults.FaultyEnv(make(), fault)])
    if not path.exists() and name == "six joints":
        # The settings of RL Baselines3 Zoo but for its network, which is larger.
        model = PPO(
            "MlpPolicy", VecNormalize(worlds, gamma=0.98), n_steps=512, batch_size=64, n_epochs=20,
            gamma=0.98, gae_lambda=0.92, learning_rate=2e-4, clip_range=0.1, ent_coef=4e-4,
            max_grad_norm=0.8, vf_coef=0.58, seed=seed, device="cpu",
        )  # fmt: skip
        store(model.learn(BEFORE), path)
    elif not path.exists():
        train(seed, "six joints")
        store(load(source, worlds).learn(AFTER, reset_num_timesteps=False), path)
    return load(path, worlds)


def store(model: PPO, path: Path) -> None:
    """Store the model, after the scale of what it sees."""
    model.get_vec_normalize_env().save(str(path.with_suffix(".pkl")))
    model.save(path)


def load(path: Path, worlds: DummyVecEnv) -> PPO:
    """Return the model that is stored, in these worlds."""
    worlds = VecNormalize.load(str(path.with_suffix(".pkl")), worlds)
    return PPO.load(path, worlds, device="cpu")


class Runner:
    """Acts by the model that was trained with the seed of the run."""

    def __init__(self, name: str) -> None:
        self.models = [train(seed, name) for seed in range(SEEDS)]

    def begin(self, seed: int) -> None:
        """Take that model, and the scale of what it sees."""
        self.model, self.scale = self.models[seed], self.models[seed].get_vec_normalize_env()

    def __call__(self, seen):
        """Return the action without exploration."""
        return self.model.predict(self.scale.normalize_obs(seen), deterministic=True)[0]


if __name__ == "__main__":
    fixed = {"PPO": Runner("six joints"), "PPO, longer": Runner("sound")}
    fixed["random"] = faults.RandomPolicy(make().action_space)
    tables = [faults.recovery_table(make, fixed, FAULT, seeds=SEEDS, episodes=10)]
    for name in JOINTS:
        policies, schedule = {"PPO, relearned": Runner(name)}, {name: FAULT[name]}
        tables.append(faults.recovery_table(make, policies, schedule, seeds=SEEDS, episodes=10))
    courses = sum((table.courses for table in tables), ())
    print(faults.RecoveryTable(courses))
    rows = [
        {"name": course.name, "onset": course.onset}
        | {way: getattr(course, way).round(1).tolist() for way in ("healthy", "faulty")}
        for course in courses
    ]
    PATH.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")
