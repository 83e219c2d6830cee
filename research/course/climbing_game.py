"""
The climbing game: what nesting buys
====================================

Two agents choose one of three actions each, and both are paid what a table says. They play again
and again, and learn what joint actions are worth. The best joint action lies between heavy
punishments, so whoever climbs first falls. You will see which teams reach the top, and why.
"""

# sphinx_gallery_thumbnail_path = "course/climbing-game.png"

# %%
# The game
# --------
# Lines are the actions a, b, c of the first agent, columns those of the second. Before you go on:
# what would *you* play, and what if you knew what the other one plays?

import matplotlib.pyplot as plt
import numpy as np

import nested_agents as na
from nested_agents.figures import COLORS

from grade import grade

payments = np.array([[11, -30, 0], [-30, 7, 6], [0, 0, 5]])
print(payments)

# %%
# Five teams
# ----------
# They differ in two things only: in what an agent expects of the other one, and in whether the
# second agent is told what the first has decided. All learn tables, and explore alike.

learner = {
    "kind": "td-lambda",
    "step_size": 0.1,
    "normalized": True,
    "discount": 0.0,
    "rule_base": {"order": "full"},
    "exploration": {"kind": "boltzmann"},
    "decision": {"value_of": "own"},
}


def team(name, topology, teammates):
    """Return the overrides of a team that expects of its teammates what is said."""
    decision = {"teammates": teammates}
    return {"name": name, "topology": topology, "learner": {"decision": decision}}


teams = [
    {"name": "independent", "topology": "independent", "scenario": {"observed": "own"}},
    team("observed, not nested", "simultaneous", "empirical"),
    team("nested, observed", "chain", "empirical"),
    team("maximum, not nested", "simultaneous", "best-response"),
    team("nested, maximum", "chain", "best-response"),
]

# %%
# 5,000 plays each
# ----------------
# ``climbing`` is the game above. ``penalty:-100`` has two equally good optima, and mixing them up
# costs 100. After 5,000 plays nobody explores any more: is what they play then optimal?

SEEDS = 20
spec = na.Spec(
    study="learning-curve",
    seeds=SEEDS,
    episodes=5,
    steps=1000,
    evaluation=1,
    scenario={"kind": "matrix-game"},
    learner=learner,
    overrides=teams,
    sweep={"scenario.game": ["climbing", "penalty:-100"]},
)
study = na.run(spec, "out/course/climbing-game", jobs=2)
print(study.table())

# %%
# The picture
# -----------

plt.rcParams.update({"font.size": 20, "axes.spines.top": False, "axes.spines.right": False})
figure, axes = plt.subplots(1, 2, figsize=(16, 9), sharey=True, layout="constrained")
figure.get_layout_engine().set(w_pad=0.3, h_pad=0.2)
for ax, game in zip(axes, ("climbing", "penalty:-100"), strict=True):
    for row, one in enumerate(reversed(teams)):
        (label,) = (c for c in study.conditions if c.startswith(one["name"]) and c.endswith(game))
        share = na.rate(study.results.success(label, "evaluation"))
        color = COLORS[0] if one["name"] == "nested, maximum" else "0.7"
        ax.barh(row, share.value, color=color)
        ax.plot([share.low, share.high], [row, row], "k", linewidth=3)
        ax.text(1.03, row, f"{share.value:.2f}", va="center")
    ax.set(xlim=(0, 1), title=game, xlabel="probability of the optimum")
axes[0].set_yticks(range(len(teams)), [one["name"] for one in reversed(teams)])
figure.suptitle("After 5,000 plays: 95% intervals over seeds")
figure.savefig("out/course/climbing-game.png", dpi=80)

# %%
# Questions
# ---------
# Put your answers in place of ``None`` and run the cell again. ``python grade.py sheet
# climbing-game`` prints the same questions in full.

answers = {
    "optimum": None,  # what are both paid for the best joint action?
    "expected": None,  # what is action a worth while the other plays a, b, c equally often?
    "first": None,  # "a", "b" or "c": what does a first agent prefer that averages so?
    "nested": None,  # in which share of climbing games does "nested, maximum" reach the optimum?
    "averaging": None,  # and "nested, observed"?
    "reason": None,  # why? a: it explores too little; b: it expects what was so far; c: payments
    "values": None,  # how many joint actions does each of five agents have to value?
}
print(grade("climbing-game", answers))
