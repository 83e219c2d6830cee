"""Spread: particles in a plane cover landmarks (Lowe et al. 2017).

The task ``simple_spread`` of the multi-agent particle environments, with the physics, rewards and
observations of ``mpe2/simple_spread_v3`` and its defaults, without the zeros that it sends as
messages. The state of an agent is its velocity and position, then the positions of landmarks and
other agents relative to it, in meters and meters per second (the original has no units). In a
period T = 0.1 s a particle of 1 kg keeps three quarters of its velocity v and moves by::

    x' = x + v T
    v' = 0.75 v + F T

where F is the force of its action (5 N) and of contacts. All functions accept leading axes, so that
many environments are stepped in one call.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

import nested_agents as na

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

PERIOD_S = 0.1
"""Duration of a decision [s]."""
DAMPING = 0.75
"""Fraction of its velocity that a particle keeps in a period."""
FORCE_N = 5.0
"""Force of an action [N]; particles have a mass of 1 kg."""
RADIUS_M = 0.15
"""Radius of a particle [m]."""
STIFFNESS = 100.0
"""Contact force per penetration [N/m]."""
CONTACT_MARGIN_M = 1e-3
"""Distance over which the contact force rises smoothly [m]."""
COVERED_M = 0.1
"""Distance within which a landmark counts as covered [m]."""
DIRECTIONS = np.array([(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)])
ACTIONS = na.ActionSet(("stay", "left", "right", "down", "up"), (1.0,) * 5, (0.0,) * 5, neutral=0)
MEASURES = (
    na.NO_SUCCESS,
    na.Measure("covered", "landmarks covered", "1", "covered", "mean", "higher", False, 0.0),
    na.Measure("collisions", "collisions", "1", "collisions", "sum", "lower", False, 0.0),
)


class SpreadSettings(na.ScenarioSettings):
    """Settings of the scenario `spread`."""

    kind: Literal["spread"] = "spread"
    particles: Annotated[int, Field(ge=2, le=64)] = 3
    """Number of particles, which are the agents, and of landmarks."""
    most_decisions: Annotated[int, Field(ge=1, le=10_000)] = 25
    """Number of decisions after which an episode ends."""

    factory: ClassVar[str] = f"{__name__}:Spread"


class Spread(na.Scenario):
    """Particles cover landmarks without touching each other.

    Parameters
    ----------
    settings
        Number of particles and length of an episode.

    Examples
    --------
    >>> scenario = SpreadSettings().build()
    >>> scenario.agents, scenario.reset(0).shape
    (('agent1', 'agent2', 'agent3'), (3, 14))
    """

    measures = MEASURES

    def __init__(self, settings: SpreadSettings) -> None:
        self.settings = settings
        n = settings.particles
        self.agents = tuple(f"agent{i + 1}" for i in range(n))
        self.roles = ("particle",) * n
        self.action_set = ACTIONS
        self.state_space = na.StateSpace("spread", _variables(n))
        Spread.reset(self, 0)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Place resting particles and landmarks uniformly in a square of 2 m."""
        rng = np.random.default_rng(seed)
        n = len(self.agents)
        self.positions: FloatArray = rng.uniform(-1.0, 1.0, (n, 2))
        self.landmarks = rng.uniform(-1.0, 1.0, (n, 2))
        self.velocities: FloatArray = np.zeros((n, 2))
        self.done = 0
        return observe(self.positions, self.velocities, self.landmarks)

    def step(self, joint_action: IntArray) -> na.Transition:
        """Apply the forces of a joint action ``(n,)`` for one period."""
        self.positions, self.velocities = advance(self.positions, self.velocities, joint_action)
        self.done += 1
        rewards, covered, touching = score(self.positions, self.landmarks)
        info: Mapping[str, object] = {
            "covered": float(covered),
            "collisions": float(touching.sum()) / 2.0,
        }
        states = observe(self.positions, self.velocities, self.landmarks)
        is_over = self.done >= self.settings.most_decisions
        return na.Transition(states, rewards, False, is_over, info)

    def environments(self, count: int) -> SpreadEnvironments:
        """Return many environments, stepped in one call."""
        return SpreadEnvironments(self, count)


class SpreadEnvironments(na.StackedEnvironments[Spread]):
    """Many environments of particles."""

    def allocate(self, scenario: Spread, count: int) -> None:
        """Allocate the state of all environments."""
        shape = count, *scenario.positions.shape
        self.positions = np.zeros(shape)
        self.velocities = np.zeros(shape)
        self.landmarks = np.zeros(shape)
        self.done = np.zeros(count, dtype=np.int64)

    def store(self, index: int, scenario: Spread) -> None:
        """Copy the initial state into an environment."""
        self.positions[index] = scenario.positions
        self.velocities[index] = scenario.velocities
        self.landmarks[index] = scenario.landmarks
        self.done[index] = 0

    def step(self, joint_actions: IntArray) -> na.Transitions:
        """Apply joint actions ``(E, n)`` for one period."""
        self.positions, self.velocities = advance(self.positions, self.velocities, joint_actions)
        self.done += 1
        rewards = score(self.positions, self.landmarks)[0]
        states = observe(self.positions, self.velocities, self.landmarks)
        is_over = self.done >= self.scenario.settings.most_decisions
        return na.Transitions(states, rewards, np.zeros(self.count, dtype=bool), is_over)


def _variables(n: int) -> tuple[na.Variable, ...]:
    names = [
        f"{thing}{j + 1}" for thing, k in (("landmark", n), ("other", n - 1)) for j in range(k)
    ]
    own = [na.Variable(f"velocity_{axis}", "m/s", -1.0, 1.0) for axis in "xy"]
    own += [na.Variable(f"place_{axis}", "m", -1.0, 1.0) for axis in "xy"]
    others = [na.Variable(f"{name}_{axis}", "m", -2.0, 2.0) for name in names for axis in "xy"]
    return (*own, *others)


def _apart(n: int) -> IntArray:
    """Return the indices of the other agents ``(n, n - 1)`` for every agent."""
    return np.array([[j for j in range(n) if j != i] for i in range(n)])


def advance(
    positions: FloatArray, velocities: FloatArray, joint_actions: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return positions [m] and velocities [m/s] ``(..., n, 2)`` after one period."""
    n = positions.shape[-2]
    forces = FORCE_N * DIRECTIONS[joint_actions]
    gaps = positions[..., :, None, :] - positions[..., None, :, :]
    distances = np.sqrt((gaps**2).sum(axis=-1))
    distances[..., np.arange(n), np.arange(n)] = np.inf
    pressed = CONTACT_MARGIN_M * np.logaddexp(0.0, -(distances - 2.0 * RADIUS_M) / CONTACT_MARGIN_M)
    forces = forces + ((STIFFNESS * pressed / distances)[..., None] * gaps).sum(axis=-2)
    return positions + velocities * PERIOD_S, DAMPING * velocities + forces * PERIOD_S


def observe(positions: FloatArray, velocities: FloatArray, landmarks: FloatArray) -> FloatArray:
    """Return the states ``(..., n, d)`` of all agents."""
    lead = positions.shape[:-1]
    n = lead[-1]
    goals = landmarks[..., None, :, :] - positions[..., :, None, :]
    others = positions[..., _apart(n), :] - positions[..., :, None, :]
    parts = (velocities, positions, goals.reshape(*lead, -1), others.reshape(*lead, -1))
    return np.concatenate(parts, axis=-1)


def score(positions: FloatArray, landmarks: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return rewards ``(..., n)``, the share of covered landmarks ``(...,)`` and contacts.

    All agents share half of the reward: minus the sum of the distances between each landmark and
    its nearest particle. The other half is minus the number ``(..., n)`` of particles in contact
    with the agent.
    """
    nearest = np.sqrt(
        ((landmarks[..., :, None, :] - positions[..., None, :, :]) ** 2).sum(axis=-1)
    ).min(axis=-1)
    gaps = ((positions[..., :, None, :] - positions[..., None, :, :]) ** 2).sum(axis=-1)
    touching = (np.sqrt(gaps) < 2.0 * RADIUS_M).sum(axis=-1) - 1
    rewards = -0.5 * nearest.sum(axis=-1)[..., None] - 0.5 * touching
    return rewards, (nearest < COVERED_M).mean(axis=-1), touching
