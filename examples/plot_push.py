"""
Two robots push a box
=====================

All wheels speed up, and no agent decides. This pushes a concave box toward its goal until the front
left wheel of the first robot seizes.
"""

import matplotlib.pyplot as plt

from nested_agents.environments import joint

FAILURE = {"kind": "seized", "wheels": "robot1.front-left", "step": 9}

env = joint(
    "box-pushing",
    start="easy",
    robot="four-wheel",
    box="T",
    failures=[FAILURE],
    render_mode="rgb_array",
)
env.reset(seed=3)

speed_up = [0] * len(env.scenario.agents)
figure, axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
for step in range(21):
    if step % 10 == 0:
        axes[step // 10].imshow(env.render())
        axes[step // 10].set_title(f"after {step} decisions")
        axes[step // 10].axis("off")
    env.step(speed_up)
