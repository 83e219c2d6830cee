"""
What a chain, a tree and a graph cost
=====================================

An agent tries its own actions together with all joint actions of the agents below it. So the
hierarchy decides what a decision costs. You will count it, by formula and in a running team.
"""

# sphinx_gallery_thumbnail_path = "course/costs.png"

# %%
# By formula
# ----------
# An agent with four actions and ``below`` agents below it tries ``4 ** (1 + below)`` joint actions.

from pathlib import Path

import matplotlib.pyplot as plt

import nested_agents as na
from nested_agents.figures import COLORS, STYLES
from nested_agents.parts import Problem, below_counts

from grade import grade

TOPOLOGIES = {"chain": "chain", "binary tree": "tree:2", "line of neighbors": "coordination-graph"}
problem = Problem(actions=4)


def tried(topology, n):
    """Return how many joint actions a decision of n agents tries."""
    agents = [f"agent{i + 1}" for i in range(n)]
    hierarchy = na.build_hierarchy(na.parse_topology(topology), agents)
    return problem.decision(below_counts(hierarchy))


for n in (4, 8, 16):
    print(n, {name: f"{tried(topology, n):,}" for name, topology in TOPOLOGIES.items()})

# %%
# Counted
# -------
# The same in a running team: the last columns hold what was counted, and what the formula says.

LARGEST = 6
print(na.cost_table(["chain", "tree:2"], agents=[2, 4, LARGEST], measured=True))

# %%
# The picture
# -----------

plt.rcParams.update({"font.size": 20, "axes.spines.top": False, "axes.spines.right": False})
figure, ax = plt.subplots(figsize=(16, 9), layout="constrained")
figure.get_layout_engine().set(w_pad=0.3, h_pad=0.2)
sizes = range(1, 17)
for number, (name, topology) in enumerate(TOPOLOGIES.items()):
    counts = [tried(topology, n) for n in sizes]
    ax.plot(sizes, counts, color=COLORS[number], linestyle=STYLES[number], linewidth=4)
    beside = (12, (14, -14, 0)[number])  # chain and tree end close together
    ax.annotate(name, (16, counts[-1]), xytext=beside, textcoords="offset points", va="center")
ax.set(yscale="log", xlabel="agents", ylabel="joint actions of a decision")
ax.set_title("The hierarchy decides what a decision costs")
Path("out/course").mkdir(parents=True, exist_ok=True)
figure.savefig("out/course/costs.png", dpi=80)

# %%
# Questions
# ---------
# A line of neighbors decides by variable elimination, which is exact. Its further cost grows with
# the width of the graph: the size of the tables that are left when one agent after the other goes.

answers = {
    "chain": None,  # how many joint actions does a decision of a chain of eight agents try?
    "tree": None,  # and of a binary tree of eight?
    "graph": None,  # and of a line of eight neighbors?
    "factor": None,  # by which factor does one more agent multiply the work of a long chain?
    "step": None,  # how many joint actions does one more agent add to a long line?
    "width": None,  # elimination can be afforded by a: agents, b: edges, c: width of the graph
}
print(grade("costs", answers))
