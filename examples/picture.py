"""
One moment of an episode as a picture
=====================================

Two robots push a box with holes to its goal; one wheel of the first robot has seized.
Writes ``push.png``, or the picture named as argument.
"""

# sphinx_gallery_thumbnail_path = "figures/push.png"
import sys

import imageio.v3 as imageio

from nested_agents.environments import joint

BOX = {
    "vertices": [[0, 0], [0.3, 0], [0.3, 0.24], [0, 0.24]],
    "holes": [
        [[0.05, 0.05], [0.13, 0.05], [0.13, 0.19], [0.05, 0.19]],
        [[0.17, 0.05], [0.25, 0.05], [0.21, 0.19]],
    ],
}
FAILURE = {"kind": "seized", "wheels": "robot1.front-left", "step": 6}

env = joint(
    "box-pushing",
    start="easy",
    robot="four-wheel",
    box=BOX,
    failures=[FAILURE],
    render_mode="rgb_array",
)
env.reset(seed=1)
speed_up = [0] * len(env.scenario.agents)
for _ in range(8):
    env.step(speed_up)
imageio.imwrite(sys.argv[1] if len(sys.argv) > 1 else "push.png", env.render())
