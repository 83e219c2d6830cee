"""
Why did a robot do that?
========================

A team of two robots learns to push a box. One of its decisions is then explained: the values of
each wheel's actions, the messages that the wheel received, and whether it explored. The figure
shows the value function of every wheel along one of its state variables.
"""

import matplotlib.pyplot as plt
import numpy as np

import nested_agents as na

scenario = na.BoxPushingSettings(robots=2).build()
hierarchy = na.build_hierarchy(na.parse_topology("chain"), scenario.agents)
team = na.Team(na.BatchTDSettings(), scenario, hierarchy, na.policy_seed(0))
for _ in na.control_loop(scenario, team, episodes=5, steps=100, seed=0):
    pass

# %%
# A decision with exploration
# ---------------------------
#
# Agents decide in the order of the hierarchy, and each hears all agents before it.

observation = team.observe(scenario, scenario.reset(seed=7))
decision = team.act(observation, explore=True, inspect=True)
print(na.explain_decision(decision))

# %%
# Value functions
# ---------------
#
# One state variable varies, while the others keep their present values.

name = "box_distance"
variables = scenario.state_space.variables
index = [variable.name for variable in variables].index(name)
x = np.linspace(variables[index].low, variables[index].high, 101)

figure, axes = plt.subplots(figsize=(5, 3.2), layout="constrained")
for agent, present in zip(scenario.agents, observation.states, strict=True):
    states = np.tile(present, (len(x), 1))
    states[:, index] = x
    axes.plot(x, team.value(agent, states), label=agent)
axes.set_xlabel(f"{name} [{variables[index].unit}]")
axes.set_ylabel("value")
axes.legend()
