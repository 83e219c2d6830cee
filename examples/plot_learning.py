"""
A study in Python
=================

A spec is a dictionary, a study keeps its rows in a folder, and results come back as arrays. The
scenario, carts on a line, is small, so the study takes seconds.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

from nested_agents import Spec, run

spec = Spec.of(
    {
        "study": "learning-curve",
        "preset": "own-value",
        "seeds": 4,
        "episodes": 8,
        "steps": 60,
        "evaluation": 5,
        "scenario": {"kind": "line-up", "carts": 3},
        "overrides": [{"name": "learning"}, {"name": "frozen", "learner": {"kind": "frozen"}}],
    }
)

folder = tempfile.mkdtemp()
if __name__ == "__main__":
    results = run(spec, Path(folder) / "carts", jobs=1, progress=False).results

    figure, ax = plt.subplots(figsize=(6, 3), layout="constrained")
    for style, label in zip(("-", "--"), results.conditions, strict=True):
        spread = results.values(label, "final_spread_m").mean(axis=0)
        ax.plot(range(1, 1 + len(spread)), spread, style, label=label)
    ax.set(xlabel="episode", ylabel="mean final spread [m]")
    ax.legend()
