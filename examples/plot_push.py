"""
Two robots push a box
=====================

A scripted controller, which knows the whole situation, pushes a concave box to its goal by the same
actions that learning agents have. The front left wheel of the first robot seizes in the meantime.
"""

import matplotlib.pyplot as plt

from nested_agents.scenarios.box_pushing.environments import BoxPushingEnv
from nested_agents.scenarios.box_pushing.scripted.controller import ScriptedController

FAILURE = {"kind": "seized", "wheels": "robot1.front-left", "step": 9}

env = BoxPushingEnv(
    {"start": "easy", "robot": "four-wheel", "box": "T", "failures": [FAILURE]},
    render_mode="rgb_array",
)
env.reset(seed=3)
scenario = env.game.scenario
controller = ScriptedController(scenario.world.robots, scenario.box)

figure, axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
for step in range(21):
    if step % 10 == 0:
        axes[step // 10].imshow(env.render())
        axes[step // 10].set_title(f"after {step} decisions")
        axes[step // 10].axis("off")
    env.step(controller.act(scenario.measure()))
