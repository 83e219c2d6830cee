"""
All boxes with their goals
==========================

Writes the picture ``boxes.png``, or the one named as argument, and prints the boxes' mass
properties.
"""

# sphinx_gallery_thumbnail_path = "figures/boxes.png"
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from nested_agents.core.interface.recording import EpisodeRecorder
from nested_agents.scenarios.box_pushing.config import BoxPushingSettings
from nested_agents.scenarios.box_pushing.pictures.rendering import AXES, SIDES, picture
from nested_agents.scenarios.box_pushing.scenario import BoxPushing
from nested_agents.scenarios.box_pushing.world.boxes import BOXES

print("| box | area [m2] | mass [kg] | inertia [g m2] | friction radius [m] | convex pieces |")
print("|---|---|---|---|---|---|")
for name, box in BOXES.items():
    print(
        f"| {name} | {box.area:.4f} | {box.mass} | {1000 * box.inertia:.3f} | "
        f"{box.friction_radius:.4f} | {len(box.fixtures) or 'a disc'} |"
    )

# What is inside the axes: at this size their labels could not be read.
left, bottom, width, height = AXES
rows = slice(round((1 - bottom - height) * SIDES[1]) + 2, round((1 - bottom) * SIDES[1]))
columns = slice(round(left * SIDES[0]) + 2, round((left + width) * SIDES[0]))
figure, grid = plt.subplots(-(-len(BOXES) // 4), 4, figsize=(9, 4.2))
for axes, name in zip(grid.flat, BOXES, strict=True):
    scenario = BoxPushing(BoxPushingSettings(box=name, start="hard"))
    scenario.reset(1)
    axes.imshow(picture(EpisodeRecorder(scenario).recording(), 0)[rows, columns])
    axes.set_title(name, fontsize=9, loc="left", pad=3)
    axes.set_axis_off()
figure.tight_layout(pad=0.3, h_pad=0.8)
figure.savefig(Path(sys.argv[1] if len(sys.argv) > 1 else "boxes.png"), dpi=120)
