"""
Levers: a world whose states hold what was done
===============================================

All agents see which lever is lit, and are paid for each that pulls it. A state is a pair of a
situation and a choice, as `StateSpace.actions` says: so its value is the action value of
Q-learning, ``learner.kind = "q-learning"``, and what an agent does is all that it can foresee.
Check it by ``./dev exec nested-agents check examples/worlds/levers.py:Levers``.
"""

import numpy as np

import nested_agents as na

LEVERS = ("left", "middle", "right")
PLACES = (0.0, 1.0, 2.0)


class Levers(na.Scenario, na.Prediction):
    """Agents who pull levers, play after play."""

    class Settings(na.ScenarioSettings):
        """The ``[scenario]`` table of a spec."""

        players: int = 3

    measures = (na.Measure("reward", "mean reward", gathering="mean", better="higher"),)

    def __init__(self, settings=Settings()):  # noqa: B008 - frozen
        self.agents = tuple(f"player{i + 1}" for i in range(settings.players))
        self.roles = ("player",) * settings.players
        zeros = (0.0,) * len(LEVERS)
        self.action_set = na.ActionSet(LEVERS, zeros, zeros, neutral=0)
        pulled, lit = (na.Variable(n, "1", 0, 2, centers=PLACES) for n in ("pulled", "lit"))
        self.state_space = na.StateSpace("levers", (pulled, lit), 1, actions=("pulled",))

    def reset(self, seed, episode=0):
        """Light a lever; nobody has pulled one yet, which counts as the first."""
        self.rng = np.random.default_rng(seed)
        self.lit = self.rng.integers(len(LEVERS))
        return self.moved(np.zeros((1, len(self.agents))))[:, 0]

    def step(self, joint_action):
        """Pull; another lever is lit afterwards."""
        states = self.moved(np.asarray(joint_action)[None])[:, 0]
        reward = float((np.asarray(joint_action) == self.lit).mean())
        self.lit = self.rng.integers(len(LEVERS))
        return na.Transition(states, reward, False, False, {"reward": reward})

    def predict(self):
        """Predict from the present state."""
        return self

    def states(self, agent, joint_actions):
        """Return the next states ``(m, 2)`` of an agent: what it does, where it does it."""
        return self.moved(joint_actions)[agent]

    def moved(self, joint_actions):
        """Return the states ``(n, m, 2)`` of all agents after joint actions ``(m, n)``."""
        pulled = np.asarray(joint_actions, dtype=float).T
        return np.stack([pulled, np.full_like(pulled, self.lit)], axis=2)
