"""
A wheel fails
=============

Two robots of four wheels learn to push a box to its goal. Half-way a wheel of one of them begins to
turn against its command, and nobody tells the agents. You will see what that costs, and what brings
the team back: weights that go on learning, or a model of the own body.
"""

# sphinx_gallery_thumbnail_path = "course/wheel-failure.png"

# %%
# The study
# ---------
# One condition has a *self-model*: it compares the motion that it predicts with the motion that it
# sees, and corrects what it believes its wheels to do. Beside every team a copy of it goes on that
# has stopped learning.

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np

import nested_agents as na
from nested_agents.figures import COLORS, STYLES

from grade import grade

SEEDS, EPISODES, FAILS = 4, 20, 10
failure = {"kind": "reversed", "wheels": "robot1.front-left", "episode": FAILS}
spec = na.Spec(
    study="wheel-failure",
    preset="own-value",
    seeds=SEEDS,
    episodes=EPISODES,
    steps=120,
    evaluation=0,
    scenario={"robot": "four-wheel", "failures": [failure]},
    sweep={"learner.self_model.enabled": [False, True]},
)
study = na.run(spec, "out/course/wheel-failure", jobs=2)
print(study.table())
for note in study.notes:
    print(note)

# %%
# The picture
# -----------
# Success over episodes: a mean over seeds and over three episodes in a row, before the failure and
# after it.

plt.rcParams.update({"font.size": 20, "axes.spines.top": False, "axes.spines.right": False})
figure, ax = plt.subplots(figsize=(16, 9), layout="constrained")
figure.get_layout_engine().set(w_pad=0.3, h_pad=0.2)
without, with_model = study.conditions
lines = {
    "weights and self-model": (study.results.success(with_model), (0, FAILS, EPISODES)),
    "weights alone": (study.results.success(without), (0, FAILS, EPISODES)),
    "nothing adapts": (study.results.success(without, "weights kept"), (FAILS, EPISODES)),
}
for number, (name, (success, ends)) in enumerate(lines.items()):
    for begin, end in pairwise(ends):
        means = success.mean(axis=0)[begin - ends[0] : end - ends[0]]
        smooth = np.convolve(means, np.ones(3) / 3, mode="valid")
        ax.plot(
            begin + 1 + np.arange(len(smooth)), smooth, color=COLORS[number],
            marker="os^"[number], linestyle=STYLES[number], linewidth=4, markersize=12,
            label=name if end == EPISODES else None,
        )  # fmt: skip
ax.axvline(FAILS - 0.5, color="k", linestyle=":", linewidth=3)
ax.text(FAILS - 0.3, 1.02, "a wheel turns against its command")
ax.set(xlabel="episode", ylabel="success", ylim=(-0.02, 1.1), xticks=range(0, EPISODES + 1, 2))
ax.legend(loc="upper left")
ax.set_title("A self-model brings success back after a wheel fails", loc="left", weight="bold")
figure.savefig("out/course/wheel-failure.png", dpi=80)

# %%
# The replay
# ----------
# ``./dev exec nested-agents report out/course/wheel-failure`` makes a page with replays of the
# episodes around the failure. The failed wheel is crossed out.
#
# Questions
# ---------
# Four seeds are enough to see it, and too few to conclude anything: the intervals say so.

answers = {
    "episode": None,  # in which episode, counted from 0, does the wheel begin to fail?
    "told": None,  # who tells the agents? a: the simulator, b: the other wheels, c: nobody
    "notices": None,  # what does a self-model compare? a: motions, b: rewards, c: robots
    "better": None,  # who keeps more success? a: weights alone, b: with self-model, c: nothing
    "fair": None,  # why the copy? a: costs if nothing adapts, b: shorter intervals, c: time
}
print(grade("wheel-failure", answers))
