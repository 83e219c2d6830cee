"""One thing of every kind that a package can offer to nested-agents, each as small as it can be."""

from typing import Annotated

import numpy as np
from pydantic import Field

import nested_agents as na


def pairs(agents, groups):
    """Every first wheel above its robot's other wheels; robots do not see each other."""
    return [(first, other) for first, *others in groups for other in others]


class Meeting(na.Scenario, na.Prediction):
    """Walkers on a line who shall meet at its middle."""

    class Settings(na.ScenarioSettings):
        walkers: Annotated[int, Field(ge=1, le=8)] = 2
        stride: Annotated[float, Field(gt=0)] = 0.1

    measures = (na.Measure("final_spread_m", "final spread", "m", source="spread"),)

    def __init__(self, settings):
        self.settings = settings
        self.agents = tuple(f"walker{i + 1}" for i in range(settings.walkers))
        self.action_set = na.ActionSet()
        self.state_space = na.StateSpace("place", (na.Variable("place", "m", -1.0, 1.0),), n_own=1)

    def reset(self, seed, episode=0):
        self.places = np.random.default_rng(seed).uniform(-1.0, 1.0, len(self.agents))
        return self.places[:, None].copy()

    def step(self, joint_action):
        self.places = self._after(joint_action[None])[0]
        spread = float(np.ptp(self.places))
        near = bool((np.abs(self.places) <= self.settings.stride).all())
        reward = -0.01 * np.abs(self.places)  # one for each walker
        return na.Transition(self.places[:, None].copy(), reward, near, False, {"spread": spread})

    def predict(self):
        return self

    def states(self, agent, joint_actions):
        return self._after(joint_actions)[:, agent, None]

    def _after(self, joint_actions):
        moves = self.settings.stride * np.array([1.0, -1.0, 0.0, 0.0])
        return np.clip(self.places + moves[joint_actions], -1.0, 1.0)


@na.state_variable("rad", -np.pi, np.pi, periodic=True)
def heading_error(situation, robot):
    """The heading of a robot off the course from the box to the goal."""
    return (robot.heading - situation.course + np.pi) % (2 * np.pi) - np.pi


class Counting(na.Learner):
    """Values what it has met most often: no learning worth the name."""

    class Settings(na.LearnerSettings):
        gain: float = 1.0

    def __init__(self, settings, rules, rows):
        self.settings, self.rules, self.rows = settings, rules, rows
        self.theta = np.zeros((rows.max() + 1, rules.n_rules))

    def observe(self, states, reward, terminated):
        active, strengths = self.rules.active(states)
        for row, rule, strength in zip(self.rows, active, strengths, strict=True):
            np.add.at(self.theta[row], rule, self.settings.gain * strength)
        return self.theta.size


class OwnAction(na.Evaluator):
    """Values the own action alone: all others are taken to maintain."""

    class Settings(na.EvaluatorSettings):
        pass

    def __init__(self, settings, problem):
        self.problem, self.counts = problem, na.Counts()

    def values(self, deliberation):
        joint = np.tile(deliberation.joint_action, (self.problem.n_actions, 1))
        joint[:, deliberation.agent] = np.arange(self.problem.n_actions)
        states = deliberation.prediction.states(deliberation.agent, joint)
        return self.problem.rules.values(deliberation.own_weights, states)


class Constant(na.Explorer):
    """Explores at one rate for ever."""

    class Settings(na.ExplorationSettings):
        rate: Annotated[float, Field(ge=0, le=1)] = 0.1

    def __init__(self, settings, n_agents):
        self.settings, self.memory = settings, np.zeros(0)

    def choose(self, agent, values, rng):
        explores = rng.random() < self.settings.rate
        return int(rng.integers(len(values)) if explores else values.argmax())
