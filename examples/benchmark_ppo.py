"""
Enter a learner of another library in push-n
============================================

Stable-baselines3's PPO learns in the Gymnasium environment, is evaluated in the worlds of the
benchmark, and its entry is written. Needs ``pip install stable-baselines3``. Then ``python
benchmark_ppo.py ppo.json 20000``, and ``./dev exec nested-agents benchmark table ppo.json``.
"""

import sys
from pathlib import Path

from stable_baselines3 import PPO

from nested_agents.research.push_n import LEAST_SEEDS, STEPS, Entry, TeamScores, evaluate
from nested_agents.scenarios.box_pushing.environments import BoxPushingEnv

PATH, DECISIONS, ROBOTS = Path(sys.argv[1]), int(sys.argv[2]), 2
success, steps, decisions = [], [], []
for seed in range(LEAST_SEEDS):
    env = BoxPushingEnv({"robots": ROBOTS}, steps=STEPS)
    model = PPO("MlpPolicy", env, n_steps=min(512, DECISIONS), gamma=0.97, seed=seed, device="cpu")
    model.learn(DECISIONS)
    played = evaluate(lambda seen: model.predict(seen, deterministic=True)[0], env, seed)  # noqa: B023
    success.append(played[0])
    steps.append(played[1])
    decisions.append(model.num_timesteps)
team = TeamScores(
    robots=ROBOTS, success=tuple(success), steps=tuple(steps), decisions=tuple(decisions)
)
about = "stable-baselines3's PPO for the whole team, its own settings but for discount and rollout"
entry = Entry(name="PPO of examples", about=about, given="nothing", teams=(team,))
PATH.write_text(entry.model_dump_json(indent=1) + "\n")
