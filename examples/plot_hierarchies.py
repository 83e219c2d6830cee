"""
Hierarchies
===========

Four hierarchies of six agents on three robots. An agent tries the joint actions of all agents below
it, so the hierarchy determines the cost of a decision.
"""

import matplotlib.pyplot as plt
import networkx as nx
import numpy as np

import nested_agents as na
from nested_agents.core.agents.cost import below_counts

agents = na.BoxPushingSettings(robots=3).build().agents
bodies = [(0, 1), (2, 3), (4, 5)]

figure, axes = plt.subplots(1, 4, figsize=(10, 2.8), layout="constrained")
for ax, name in zip(axes, ("chain", "teams", "tree:2", "star"), strict=True):
    hierarchy = na.build_hierarchy(na.parse_topology(name), agents, bodies)
    graph = nx.DiGraph(hierarchy.edges)
    for layer, level in enumerate(nx.topological_generations(graph)):
        nx.set_node_attributes(graph, dict.fromkeys(level, -layer), "layer")
    places = nx.multipartite_layout(graph, "layer", align="horizontal")
    colors = [f"C{agent // 2}" for agent in graph]
    nx.draw_networkx(graph, places, ax=ax, node_color=colors, font_color="white")
    tried = int(np.sum(4.0 ** (1 + np.array(below_counts(hierarchy)))))
    ax.set_title(f"{name}: {tried:,} joint actions")
    ax.axis("off")
