"""
Bring your own learner
======================

Box pushing is a PettingZoo environment: every wheel is an agent that increases, decreases,
maintains or zeroes its speed. Here the wheels act at random, and one of them seizes half-way.
"""

# sphinx_gallery_thumbnail_path = "figures/perception.png"
from nested_agents.environments import parallel

env = parallel(
    "box-pushing",
    steps=40,
    robot="four-wheel",
    failures=[{"kind": "seized", "wheels": ["robot1.front-left"], "step": 20}],
)

observations, infos = env.reset(seed=1)
for agent in env.agents:
    env.action_space(agent).seed(1)

gained = 0.0
while env.agents:
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    observations, rewards, terminations, truncations, infos = env.step(actions)
    gained += rewards["robot1.front-left"]

measured = infos["robot1.front-left"]
print(f"{len(observations)} wheels, {len(observations['robot1.front-left'])} state variables each")
print(f"sum of rewards {gained:.3f}; the box is {measured['distance_m']:.2f} m from the goal")
print(f"failed wheels: {int(measured['failed'].sum())}")
