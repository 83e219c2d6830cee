"""
Your own hierarchy
==================

You write down who is above whom, look at what it costs, and find out whether it matters: against
the chain of the paper, and against agents who see nobody.
"""

# sphinx_gallery_thumbnail_path = "course/own-hierarchy.png"

# %%
# Write it
# --------
# Two e-Pucks have four wheels. Here the left wheels lead, each above the right wheel of its robot.
# Change the pairs (superior, subordinate) to your own hierarchy. A circle is refused.

import matplotlib.pyplot as plt

import nested_agents as na
from nested_agents.figures import COLORS
from nested_agents.parts import Problem, below_counts

from grade import grade

agents = na.BoxPushingSettings(robots=2).build().agents
left1, right1, left2, right2 = agents
mine = na.Hierarchy(agents, [(left1, left2), (left1, right1), (left2, right2)])
chain = na.build_hierarchy(na.parse_topology("chain"), agents)
nobody = na.build_hierarchy(na.parse_topology("independent"), agents)
hierarchies = {"chain": chain, "mine": mine, "nobody sees anybody": nobody}
costs = {name: Problem().decision(below_counts(h)) for name, h in hierarchies.items()}
for name, hierarchy in hierarchies.items():
    print(f"{name}: {costs[name]} joint actions, {hierarchy}")

# %%
# Compare it
# ----------
# All three meet the same worlds, seed by seed.

SEEDS, EPISODES = 6, 10
spec = na.Spec(
    study="hierarchies",
    preset="own-value",
    seeds=SEEDS,
    episodes=EPISODES,
    steps=120,
    evaluation=5,
    overrides=[{"name": name, "topology": h} for name, h in hierarchies.items()],
)
study = na.run(spec, "out/course/own-hierarchy", jobs=2)
print(study.table())
print(study.compare())

# %%
# The picture
# -----------

plt.rcParams.update({"font.size": 20, "axes.spines.top": False, "axes.spines.right": False})
figure, ax = plt.subplots(figsize=(16, 9), layout="constrained")
figure.get_layout_engine().set(w_pad=0.3, h_pad=0.2)
marks = zip(study.conditions, hierarchies, COLORS, "osD", strict=False)
for label, name, color, marker in marks:
    success = na.rate(study.results.success(label, "evaluation"))
    ax.plot([costs[name]] * 2, [success.low, success.high], color=color, linewidth=4)
    ax.plot(costs[name], success.value, marker, color=color, markersize=20, label=name)
ax.set(xscale="log", ylim=(-0.02, 1.02), xlim=(10, 1000))
ax.set_xticks([10, 100, 1000], ["10", "100", "1,000"])
ax.set(xlabel="joint actions of a decision", ylabel="evaluation success, 95% interval")
ax.legend(loc="center")
figure.savefig("out/course/own-hierarchy.png", dpi=80)

# %%
# Questions
# ---------
# The last answer is a list of pairs of names over the wheels ``robot1.left``, ``robot1.right``, and
# so on to ``robot4.right``: all eight hang together, one wheel of each robot is above the other,
# and a decision tries at most 400 joint actions.

answers = {
    "chain": None,  # how many joint actions does a decision of the chain of four try?
    "independent": None,  # and if nobody sees anybody?
    "seeds": None,  # with how many seeds can one comparison reach p < 0.05 at all?
    "absent": None,  # "no significant difference": a: equal, b: may remain, c: the study was faulty
    "edges": None,  # your hierarchy of eight wheels
}
print(grade("own-hierarchy", answers))
