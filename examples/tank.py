"""
A tank that pumps fill or empty
===============================

A complete scenario: settings, environment and prediction. Run it as a study by
``./dev exec nested-agents run examples/tank.toml --out out/tank``, check it by
``./dev exec nested-agents check examples/tank.py:Tank``.
"""

import numpy as np

import nested_agents as na


class Tank(na.Scenario):
    """Pumps fill or empty one tank up to a target volume; each agent drives a pump."""

    class Settings(na.ScenarioSettings):
        """The ``[scenario]`` table of a spec."""

        pumps: int = 3

    measures = (
        na.SUCCESS,
        na.Measure("missing_l", "missing", "l", "missing_l", better="lower", least=0),
    )

    def __init__(self, settings=Settings()):  # noqa: B008 - frozen
        self.agents = tuple(f"pump{i + 1}" for i in range(settings.pumps))
        # The actions do not depend on the last flow: add 1 l/s, remove 1 l/s, or rest.
        self.action_set = na.ActionSet(("in", "out", "rest"), (0, 0, 0), (1, -1, 0), neutral=2)
        flow = na.Variable("flow", "l/s", -1.0, 1.0)
        missing = na.Variable("missing", "l", -20.0, 20.0, centers=(-20.0, -5.0, 0.0, 5.0, 20.0))
        self.state_space = na.StateSpace("tank", (flow, missing), n_own=1)

    def reset(self, seed, episode=0):
        """Start an episode with some water missing, or too much of it."""
        self.flows = np.zeros(len(self.agents))
        self.missing = np.random.default_rng(seed).uniform(-20.0, 20.0)
        return self.states(self.flows, self.missing)

    def step(self, joint_action):
        """Pump for a second."""
        self.flows, self.missing = self.after(joint_action)
        done, info = bool(abs(self.missing) < 0.6), {"missing_l": abs(self.missing)}
        states = self.states(self.flows, self.missing)
        return na.Transition(states, -abs(self.missing) / 100, done, False, info)

    def predict(self):
        """Predict from the present state."""
        return Forecast(self)

    def with_exact_prediction(self):
        """Return this tank: its predictions are exact."""
        return self

    def after(self, joint_actions):
        """Return flows and missing volume after joint actions ``(..., n)``."""
        one = np.ones(len(self.agents))
        flows = self.action_set.apply(self.flows, joint_actions, one, one)
        return flows, np.clip(self.missing - flows.sum(axis=-1), -20.0, 20.0)

    def states(self, flows, missing):
        """Return the states ``(..., n, 2)`` of all agents."""
        return np.stack([flows, np.broadcast_to(np.asarray(missing)[..., None], flows.shape)], -1)


class Forecast(na.Prediction):
    """Predicted states, and rewards, which only planners need."""

    def __init__(self, tank):
        self.tank = tank

    def states(self, agent, joint_actions):
        """Return the next states ``(m, 2)`` of an agent."""
        return self.tank.states(*self.tank.after(joint_actions))[:, agent]

    def rewards(self, joint_actions):
        """Return the rewards ``(m,)``."""
        return -abs(self.tank.after(joint_actions)[1]) / 100
