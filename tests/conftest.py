"""A world small enough to reason about, for tests that need a scenario but no physics.

It also makes the benchmarks importable, which are no part of the package: their controller plays in
tests, too.
"""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from nested_agents.core.hierarchy.hierarchy import Hierarchy
from nested_agents.core.interface.prediction import Prediction
from nested_agents.core.interface.scenario import Scenario, Transition
from nested_agents.core.interface.spaces import ActionSet, StateSpace, Variable
from nested_agents.scenarios.box_pushing.world.settings import BoxSettings, label

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parent)]

# The first example of a test may compile a kernel. CI draws the same examples each time.
settings.register_profile("toolkit", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("toolkit")


def decode(codes: np.ndarray, n_agents: int, n_actions: int) -> np.ndarray:
    """Joint actions ``(m, n)`` of codes ``(m,)``."""
    return np.stack(np.unravel_index(codes, (n_actions,) * n_agents), axis=-1)


@pytest.fixture(scope="session")
def permuted() -> Callable[[Hierarchy, Sequence[int]], Hierarchy]:
    """Gives the same hierarchy with agent ``permutation[k]`` listed as k-th."""

    def of(hierarchy: Hierarchy, permutation: Sequence[int]) -> Hierarchy:
        edges, neighbors = (
            [(hierarchy.agents[a], hierarchy.agents[b]) for a, b in pairs]
            for pairs in (hierarchy.edges, hierarchy.neighbors)
        )
        return Hierarchy([hierarchy.agents[i] for i in permutation], edges, neighbors)

    return of


class LineWorld(Scenario):
    """Carts on a line that together push a load towards a goal.

    Agents are wheels, ``wheels`` to a cart. An agent's own variables are the speed of its wheel
    and the angle to which its cart has rolled (periodic); all share the gap between load and goal.
    A cart moves at the mean speed of its wheels, the load at a tenth of the carts' mean.
    """

    def __init__(self, carts: int = 2, wheels: int = 2, *, closed: float = 0.02) -> None:
        n = carts * wheels
        self.agents = tuple(f"cart{i // wheels}.wheel{i % wheels}" for i in range(n))
        self.groups = tuple(tuple(range(c * wheels, (c + 1) * wheels)) for c in range(carts))
        self.action_set = ActionSet()
        self.state_space = StateSpace(
            "line",
            (
                Variable("speed", "m/s", -1.0, 1.0),
                Variable("phase", "rad", -pi, pi, periodic=True),
                Variable("gap", "m", 0.0, 2.0),
            ),
            n_own=2,
        )
        self.closed = closed
        self.shape = (carts, wheels)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> np.ndarray:
        rng = np.random.default_rng(seed)
        self.speeds = np.zeros(len(self.agents))
        self.phases = rng.uniform(-pi, pi, self.shape[0])
        self.gap = rng.uniform(0.2, 1.5)
        return self._states(self.speeds[None], self.phases[None], np.array([self.gap]))[0]

    def step(self, joint_action: np.ndarray) -> Transition:
        speeds, phases, gaps = self.after(np.asarray(joint_action)[None])
        self.speeds, self.phases, self.gap = speeds[0], phases[0], float(gaps[0])
        return Transition(
            states=self._states(speeds, phases, gaps)[0],
            reward=float(self.reward(gaps)[0]),
            terminated=abs(self.gap) < self.closed,
            truncated=False,
            info=self.measure(),
        )

    def predict(self) -> "LinePrediction":
        return LinePrediction(self)

    def measure(self) -> dict[str, float]:
        return {"distance_m": abs(self.gap)}

    def present(self) -> np.ndarray:
        """The states that the agents are in."""
        return self._states(self.speeds[None], self.phases[None], np.array([self.gap]))[0]

    def after(self, joint: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Speeds ``(m, n)``, phases ``(m, carts)`` and gaps ``(m,)`` after joint actions."""
        n = len(self.agents)
        speeds = self.action_set.apply(self.speeds, joint, np.full(n, 0.3), np.ones(n))
        carts = speeds.reshape(-1, *self.shape).mean(axis=2)
        phases = (self.phases + carts + pi) % (2 * pi) - pi
        return speeds, phases, self.gap - 0.1 * carts.mean(axis=1)

    def reward(self, gaps: np.ndarray) -> np.ndarray:
        return -0.01 * np.abs(gaps)

    def _states(self, speeds: np.ndarray, phases: np.ndarray, gaps: np.ndarray) -> np.ndarray:
        rolled = np.repeat(phases, self.shape[1], axis=1)
        return np.stack([speeds, rolled, np.broadcast_to(gaps[:, None], speeds.shape)], axis=2)


class LinePrediction(Prediction):
    """Exact predictions of a line world's next step."""

    def __init__(self, world: LineWorld) -> None:
        self.world = world
        self.n, self.n_actions = len(world.agents), len(world.action_set)

    def states(self, agent: int, joint_actions: np.ndarray) -> np.ndarray:
        return self.world._states(*self.world.after(joint_actions))[:, agent]

    def rewards(self, joint_actions: np.ndarray) -> np.ndarray:
        return self.world.reward(self.world.after(joint_actions)[2])


@pytest.fixture(scope="session", autouse=True)
def state_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What tests trust is not noted in the list of who runs them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(os.environ, "XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="session")
def line_world() -> type[LineWorld]:
    """The class: ``line_world(carts=2, wheels=2)`` is a scenario without physics."""
    return LineWorld


RING = BoxSettings(
    vertices=((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)),
    holes=(((-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)),),
)


def wrapped(poses: np.ndarray) -> np.ndarray:
    """Headings within half a turn of 0, so that they jump where they cross the cut."""
    return np.concatenate([poses[..., :2], (poses[..., 2:] + np.pi) % (2 * np.pi) - np.pi], axis=-1)


def recording(steps: int = 30) -> dict[str, np.ndarray]:
    """Two four-wheel robots push a box with a hole; one wheel fails half-way."""
    t = np.linspace(0.0, 1.0, steps + 1)
    box = np.stack([t, 0.1 * np.sin(5 * t), 3.0 + t], axis=1)
    robots = np.stack([box - [0.15, 0.06, 0.2], box - [0.15, -0.06, 0.1]], axis=1)
    failed = np.zeros((steps + 1, 8), dtype=bool)
    failed[steps // 2 :, 3] = True
    return {
        "robot_poses": wrapped(robots),
        "box_pose": wrapped(box),
        "goal_pose": np.array([1.0, 0.0, 0.0]),
        "wheel_speeds": 0.13 * np.cos(np.outer(t, np.arange(1, 9))),
        "contact": np.stack([t > 0.2, t > 0.4], axis=1),
        "failed": failed,
        "reward": np.zeros(steps),
        "dt": np.array(5.12),
        "robot": np.array("four-wheel"),
        "box": np.array(label(RING)),
    }


@pytest.fixture(scope="session")
def recorded():
    """The function `recording`."""
    return recording
