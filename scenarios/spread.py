"""Spread: particles in a plane that shall cover as many landmarks (Lowe et al. 2017).

The task ``simple_spread`` of the multi-agent particle environments, in the physics, rewards and
observations of ``mpe2/simple_spread_v3`` with its defaults; the zeros that it sends as messages are
left out. States of an agent are its velocity and place, then where landmarks and others are, seen
from it, in metres and metres a second (the original has no units). With the period T = 0.1 s,
velocity v decays to 0.75 v, a force of 5 N or of contact moves 1 kg, and::

    x' = x + v T
    v' = 0.75 v + F T

All functions take any axes before those of agents, so that many worlds are stepped in one call.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..core.interface.environments import Transitions
from ..core.interface.measures import NO_SUCCESS, Measure
from ..core.interface.scenario import Scenario, Transition
from ..core.interface.spaces import ActionSet, StateSpace, Variable
from ..core.interface.stacked import StackedEnvironments
from ..core.numerics import FloatArray, IntArray
from ..core.plugins.settings import ScenarioSettings

PERIOD = 0.1
"""One decision [s]."""
KEPT = 0.75
"""Share of its velocity that a particle keeps in a period."""
FORCE = 5.0
"""Of an action [N]; particles weigh 1 kg."""
SIZE = 0.15
"""Radius of a particle [m]."""
STIFFNESS = 100.0
"""Contact force per penetration [N/m]."""
MARGIN = 1e-3
"""Distance over which contact sets in [m]."""
NEAR = 0.1
"""Distance within which a landmark is covered [m]."""
COURSES = np.array([(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)])
ACTIONS = ActionSet(("stay", "left", "right", "down", "up"), (1.0,) * 5, (0.0,) * 5, neutral=0)
MEASURES = (
    NO_SUCCESS,
    Measure("covered", "landmarks covered", "1", "covered", "mean", "higher", False, 0.0),
    Measure("collisions", "collisions", "1", "collisions", "sum", "lower", False, 0.0),
)


class SpreadSettings(ScenarioSettings):
    """The spread scenario."""

    kind: Literal["spread"] = "spread"
    particles: Annotated[int, Field(ge=2, le=64)] = 3
    """Number of particles, one agent each, and of landmarks."""
    most_decisions: Annotated[int, Field(ge=1, le=10_000)] = 25
    """Decisions after which an episode ends."""

    factory: ClassVar[str] = f"{__name__}:Spread"


class Spread(Scenario):
    """Particles that cover landmarks without touching each other.

    Parameters
    ----------
    settings
        See `SpreadSettings`.

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
        self.state_space = StateSpace("spread", _variables(n))
        Spread.reset(self, 0)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Put particles at rest and landmarks anywhere in a square of 2 m."""
        rng = np.random.default_rng(seed)
        n = len(self.agents)
        self.places: FloatArray = rng.uniform(-1.0, 1.0, (n, 2))
        self.landmarks = rng.uniform(-1.0, 1.0, (n, 2))
        self.velocities: FloatArray = np.zeros((n, 2))
        self.done = 0
        return observe(self.places, self.velocities, self.landmarks)

    def step(self, joint_action: IntArray) -> Transition:
        """Push the particles for one period."""
        self.places, self.velocities = advance(self.places, self.velocities, joint_action)
        self.done += 1
        rewards, covered, touching = judge(self.places, self.landmarks)
        info: Mapping[str, object] = {
            "covered": float(covered),
            "collisions": float(touching.sum()) / 2.0,
        }
        states = observe(self.places, self.velocities, self.landmarks)
        is_over = self.done >= self.settings.most_decisions
        return Transition(states, rewards, False, is_over, info)

    def environments(self, count: int) -> SpreadEnvironments:
        """Return many environments, stepped in one call."""
        return SpreadEnvironments(self, count)


class SpreadEnvironments(StackedEnvironments[Spread]):
    """Many environments of particles."""

    def allocate(self, scenario: Spread, count: int) -> None:
        """Allocate the state of all environments."""
        shape = count, *scenario.places.shape
        self.places = np.zeros(shape)
        self.velocities = np.zeros(shape)
        self.landmarks = np.zeros(shape)
        self.done = np.zeros(count, dtype=np.int64)

    def store(self, index: int, scenario: Spread) -> None:
        """Copy the initial state into an environment."""
        self.places[index] = scenario.places
        self.velocities[index] = scenario.velocities
        self.landmarks[index] = scenario.landmarks
        self.done[index] = 0

    def step(self, joint_actions: IntArray) -> Transitions:
        """Push all particles of all environments."""
        self.places, self.velocities = advance(self.places, self.velocities, joint_actions)
        self.done += 1
        rewards = judge(self.places, self.landmarks)[0]
        states = observe(self.places, self.velocities, self.landmarks)
        is_over = self.done >= self.scenario.settings.most_decisions
        return Transitions(states, rewards, np.zeros(self.count, dtype=bool), is_over)


def _variables(n: int) -> tuple[Variable, ...]:
    names = [
        f"{thing}{j + 1}" for thing, k in (("landmark", n), ("other", n - 1)) for j in range(k)
    ]
    own = [Variable(f"velocity_{axis}", "m/s", -1.0, 1.0) for axis in "xy"]
    own += [Variable(f"place_{axis}", "m", -1.0, 1.0) for axis in "xy"]
    others = [Variable(f"{name}_{axis}", "m", -2.0, 2.0) for name in names for axis in "xy"]
    return (*own, *others)


def _apart(n: int) -> IntArray:
    """Return the numbers of the others ``(n, n - 1)`` of every agent, in order."""
    return np.array([[j for j in range(n) if j != i] for i in range(n)])


def advance(
    places: FloatArray, velocities: FloatArray, joint_actions: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return places [m] and velocities [m/s] ``(..., n, 2)`` one period on."""
    n = places.shape[-2]
    forces = FORCE * COURSES[joint_actions]
    gaps = places[..., :, None, :] - places[..., None, :, :]
    distances = np.sqrt((gaps**2).sum(axis=-1))
    distances[..., np.arange(n), np.arange(n)] = np.inf
    pressed = MARGIN * np.logaddexp(0.0, -(distances - 2.0 * SIZE) / MARGIN)
    forces = forces + ((STIFFNESS * pressed / distances)[..., None] * gaps).sum(axis=-2)
    return places + velocities * PERIOD, KEPT * velocities + forces * PERIOD


def observe(places: FloatArray, velocities: FloatArray, landmarks: FloatArray) -> FloatArray:
    """Return the states ``(..., n, d)`` of all agents."""
    lead = places.shape[:-1]
    n = lead[-1]
    goals = landmarks[..., None, :, :] - places[..., :, None, :]
    others = places[..., _apart(n), :] - places[..., :, None, :]
    parts = (velocities, places, goals.reshape(*lead, -1), others.reshape(*lead, -1))
    return np.concatenate(parts, axis=-1)


def judge(places: FloatArray, landmarks: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return rewards ``(..., n)``, the share of landmarks covered ``(...,)``, and touches.

    Half of a reward is what all have in common: less the distances of landmarks from the particle
    that is nearest. The other half is less the number ``(..., n)`` of others that one touches.
    """
    nearest = np.sqrt(
        ((landmarks[..., :, None, :] - places[..., None, :, :]) ** 2).sum(axis=-1)
    ).min(axis=-1)
    gaps = ((places[..., :, None, :] - places[..., None, :, :]) ** 2).sum(axis=-1)
    touching = (np.sqrt(gaps) < 2.0 * SIZE).sum(axis=-1) - 1
    rewards = -0.5 * nearest.sum(axis=-1)[..., None] - 0.5 * touching
    return rewards, (nearest < NEAR).mean(axis=-1), touching
