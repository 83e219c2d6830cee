"""
An arm whose joints are agents
==============================

A planar arm of ``links`` equal links, 1 long in all, brings its tip to a goal; each agent turns
a joint. ``nested-agents run examples/arm.toml`` runs a study of it.
"""

from typing import Annotated

import numpy as np
from pydantic import Field

import nested_agents as na


class Arm:
    """An arm in the plane; places are complex numbers."""

    class Settings(na.ScenarioSettings):
        """The ``[scenario]`` table of a spec."""

        links: Annotated[int, Field(ge=2, le=8)] = 3

    measures = (na.SUCCESS, na.Measure("final_distance", "distance", better="lower"))

    def __init__(self, settings=Settings()):  # noqa: B008 - frozen
        n = settings.links
        self.agents, self.roles = tuple(f"joint{i + 1}" for i in range(n)), ("joint",) * n
        self.action_set = na.ActionSet()
        self.top = min(0.06, 0.5 / n)  # greatest speed [rad per decision]
        turn, near = (-2.4, -1.2, -0.4, -0.1, 0.1, 0.4, 1.2, 2.4), (0, 0.02, 0.05, 0.1, 0.2, 0.4)
        nearer = (-0.2, -0.06, -0.01, 0.0, 0.01, 0.06, 0.2)
        variables = (
            na.Variable("speed", "rad", -self.top, self.top),
            # At the joint, from the tip to the goal.
            na.Variable("bearing", "rad", -np.pi, np.pi, True, turn),
            na.Variable("distance", "1", 0.0, 2.0, centres=(*near, 0.8, 1.2, 2.0)),
            na.Variable("approach", "1", -0.2, 0.2, centres=nearer),
        )
        self.state_space = na.StateSpace("arm", variables, n_own=1)

    def reset(self, seed, episode=0):
        """Bend the arm anyhow, and put the goal within its reach."""
        rng, n = np.random.default_rng(seed), len(self.agents)
        bend = min(2.5, 3.0 * np.sqrt(2.0 / n))
        self.angles = np.array([rng.uniform(-np.pi, np.pi), *rng.uniform(-bend, bend, n - 1)])
        self.speeds, tip, self.goal = np.zeros(n), self.ends(self.angles)[-1], None
        while self.goal is None or abs(self.goal - tip) < 0.25:
            radius = np.sqrt(rng.uniform(0.15**2, 0.95**2))
            self.goal = radius * np.exp(1j * rng.uniform(-np.pi, np.pi))
        self.distance = abs(self.goal - tip)
        return self.seen(self.speeds, self.angles)[0]

    def step(self, joint_action):
        """Turn the joints."""
        self.speeds, self.angles = self.after(joint_action)
        states, distance = self.seen(self.speeds, self.angles)
        reward, self.distance = self.reward(distance), float(distance)
        info = {"final_distance": self.distance}
        return na.Transition(states, float(reward), self.distance < 0.02, False, info)

    def predict(self):
        """Predict from the present state."""
        return Outlook(self)

    def with_exact_prediction(self):
        """Return this arm: its predictions are exact."""
        return self

    def after(self, joint_actions):
        """Return speeds and angles ``(..., n)`` after joint actions."""
        top = np.full(len(self.agents), self.top)
        speeds = self.action_set.apply(self.speeds, joint_actions, 0.5 * top, top)
        return speeds, self.angles + speeds

    def ends(self, angles):
        """Return where the links end ``(..., n)``."""
        return np.exp(1j * angles.cumsum(axis=-1)).cumsum(axis=-1) / len(self.agents)

    def seen(self, speeds, angles):
        """Return the states ``(..., n, 4)`` of all agents, and the tip's distance ``(...)``."""
        ends = self.ends(angles)
        tip, joints = ends[..., -1:], np.concatenate([0 * ends[..., :1], ends[..., :-1]], axis=-1)
        bearings = np.angle((self.goal - joints) * (tip - joints).conj())
        distance = abs(self.goal - tip)
        every = np.broadcast_arrays(speeds, bearings, distance, self.distance - distance)
        return np.stack(every, axis=-1), distance[..., 0]

    def reward(self, distance):
        """Return the reward ``(...)``: for being there, and less for coming nearer."""
        nearer = self.distance - distance > 0.001
        coming = np.where(nearer, 0.003 * np.exp(-1.5 * distance), -0.005)
        return np.where(distance < 0.02, 0.01, coming)


class Outlook:
    """What joint actions ``(m, n)`` would lead to, exactly."""

    def __init__(self, arm):
        self.arm = arm

    def states_of_all(self, joint_actions):
        """Return the next states ``(n, m, 4)`` of all agents."""
        return self.arm.seen(*self.arm.after(joint_actions))[0].swapaxes(0, 1)

    def states(self, agent, joint_actions):
        """Return the next states ``(m, 4)`` of an agent."""
        return self.states_of_all(joint_actions)[agent]

    def rewards(self, joint_actions):
        """Return the rewards ``(m,)``; only planners ask for them."""
        return self.arm.reward(self.arm.seen(*self.arm.after(joint_actions))[1])
