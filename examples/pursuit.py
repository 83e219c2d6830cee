"""
Robots that surround a fleeing target
=====================================

An environment for which no preset was tuned; the page *Troubleshooting: nothing is learned* uses it
as its example. Run it by
``./dev exec nested-agents run examples/pursuit.toml --out out/pursuit``, check it by
``./dev exec nested-agents check examples/pursuit.py:Pursuit``.
"""

import numpy as np

import nested_agents as na

MOVES = 0.1 * np.array([(1, 0), (0, 1), (-1, 0), (0, -1), (0, 0)])
"""How far an action moves a robot [m]: east, north, west, south, or not at all."""
FLIGHT = 0.08
"""How far the target flees in a step [m]."""
RADIUS = 2.0
"""Radius beyond which the target cannot flee [m]."""
REACH = 0.5
"""Distance within which all robots must be [m]."""


class Pursuit(na.Scenario, na.Prediction):
    """Robots catch a target: all are near it, and it sees no gap of half a turn between them."""

    class Settings(na.ScenarioSettings):
        """The ``[scenario]`` table of a spec."""

        robots: int = 3
        alike: bool = False
        """Whether robots have one role, so that they may learn from each other's experience."""

    measures = (
        na.SUCCESS,
        na.Measure("gap", "widest gap", "rad", "gap", better="lower", least=0),
    )

    def __init__(self, settings=Settings()):  # noqa: B008 - frozen
        self.agents = tuple(f"robot{i + 1}" for i in range(settings.robots))
        if settings.alike:
            self.roles = ("robot",) * settings.robots
        names = ("east", "north", "west", "south", "wait")
        self.action_set = na.ActionSet(names, (0,) * 5, (0,) * 5, neutral=4)
        east, north = (
            na.Variable(name, "m", -2 * RADIUS, 2 * RADIUS) for name in ("east", "north")
        )
        left, right = (na.Variable(f"gap_{s}", "rad", 0.0, 2 * np.pi) for s in ("left", "right"))
        self.state_space = na.StateSpace("pursuit", (east, north, left, right), n_own=2)

    def reset(self, seed, episode=0):
        """Put the target near the middle, and the robots on one side of it."""
        rng = np.random.default_rng(seed)
        self.target = rng.uniform(-0.5, 0.5, 2)
        self.places = rng.uniform((-1.5, -1.0), (-1.0, 1.0), (len(self.agents), 2))
        return self.seen(self.places, self.target)

    def step(self, joint_action):
        """Let robots and target move at the same time."""
        self.places, self.target = self.moved(np.asarray(joint_action))
        states = self.seen(self.places, self.target)
        reward, caught = self.paid(states)
        info = {"gap": float(states[:, 2].max())}
        return na.Transition(states, float(reward), bool(caught), False, info)

    def predict(self):
        """Predict from the present situation, which this scenario holds itself."""
        return self

    def with_exact_prediction(self):
        """Return this scenario: it predicts what comes."""
        return self

    def states(self, agent, joint_actions):
        """Return the next states ``(m, 4)`` of an agent."""
        return self.seen(*self.moved(joint_actions))[:, agent]

    def rewards(self, joint_actions):
        """Return the rewards ``(m,)``, for planners."""
        return self.paid(self.seen(*self.moved(joint_actions)))[0]

    def moved(self, actions):
        """Return places and target after joint actions ``(..., n)``."""
        off = self.target - self.places
        away = (off / np.maximum((off**2).sum(-1, keepdims=True), 0.01)).sum(0)
        target = self.target + FLIGHT * away / max(np.linalg.norm(away), 1e-9)
        target *= min(1.0, RADIUS / max(np.linalg.norm(target), 1e-9))
        return self.places + MOVES[actions], target

    def seen(self, places, target):
        """Return the states ``(..., n, 4)`` of all robots."""
        off = places - target
        angles = np.arctan2(off[..., 1], off[..., 0])
        # Turns from each robot to every other, seen from the target; to itself a whole turn.
        turns = (angles[..., None, :] - angles[..., :, None]) % (2 * np.pi)
        others = ~np.eye(len(self.agents), dtype=bool)
        left = turns.min(-1, where=others, initial=2 * np.pi)
        right = (2 * np.pi - turns).min(-1, where=others, initial=2 * np.pi)
        off = np.clip(off, -2 * RADIUS, 2 * RADIUS)
        return np.concatenate([off, left[..., None], right[..., None]], -1)

    def paid(self, states):
        """Return the reward and whether the target is caught, of states ``(..., n, 4)``."""
        far, gap = np.linalg.norm(states[..., :2], axis=-1), states[..., 2].max(-1)
        caught = (far.max(-1) < REACH) & (gap < np.pi)
        return -0.01 * (far.mean(-1) + gap), caught
