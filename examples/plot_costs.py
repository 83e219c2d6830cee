"""
What hierarchies cost
=====================

Operations of value iteration by Eq. 18 and 23 of the paper, in exact integers, for 1 to 10 agents.
"""

import matplotlib.pyplot as plt

import nested_agents as na
from nested_agents.core.agents.cost import Problem, below_counts

problem = Problem(rules=5**7, actions=4, iterations=450)
sizes = range(1, 11)

figure, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
ax.plot(sizes, [problem.single_agent(n) for n in sizes], "k:", label="one agent")
for name, style in (("chain", "-"), ("star", "--"), ("independent", "-.")):
    costs = []
    for n in sizes:
        agents = [f"agent{i}" for i in range(n)]
        hierarchy = na.build_hierarchy(na.parse_topology(name), agents)
        costs.append(problem.nested(below_counts(hierarchy)))
    ax.plot(sizes, costs, style, label=name)
ax.set(yscale="log", xlabel="agents", ylabel="operations")
ax.legend()
