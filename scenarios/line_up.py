"""Line-up: carts on parallel rails meet side by side on a goal line.

This is the smallest task with physics that requires coordination. Each agent drives one cart, and
the team is rewarded for being near the line and for staying level, as if the carts carried a beam.
With two state variables, the joint state of three agents is small enough for a single agent
(Section VII). Predictions are exact and fast, which suits measurements of cost.

Physics: a cart of mass m is pulled by a servo of stiffness k [N/(m/s)] towards its commanded speed
u, ``m dv/dt = k (u - v)``. With ``tau = m / k`` and u held for a period T this is solved exactly::

    v' = u + (v - u) exp(-T / tau)
    x' = x + u T + (v - u) tau (1 - exp(-T / tau))
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..core.interface.measures import SUCCESS, Measure
from ..core.interface.prediction import Prediction
from ..core.interface.scenario import Scenario, Transition
from ..core.interface.spaces import ActionSet, StateSpace, Variable
from ..core.numerics import FloatArray, IntArray
from ..core.plugins.settings import ScenarioSettings

PERIOD = 0.25
"""Decision period [s]."""
TAU = 0.1
"""Mass over servo stiffness [s]: 1 kg and 10 N/(m/s)."""
MAX_SPEED = 0.4
"""Maximum commanded speed [m/s]."""
INCREMENT = 0.2
"""Change of the commanded speed by one action [m/s]."""
TOLERANCE = 0.08
"""Maximum distance of all carts from the line at success [m]."""

DISTANCE = Variable("distance", "m", -1.0, 1.0, centers=(-1.0, -0.3, 0.0, 0.3, 1.0))
LEAD = Variable("lead", "m", -0.8, 0.8, centers=(-0.8, -0.2, 0.0, 0.2, 0.8))


MEASURES = (
    SUCCESS,
    Measure("final_distance_m", "mean distance", "m", "distance_m", better="lower", least=0.0),
    Measure("final_spread_m", "spread", "m", "spread_m", better="lower", least=0.0),
)


class LineUpSettings(ScenarioSettings):
    """The line-up scenario."""

    kind: Literal["line-up"] = "line-up"
    carts: Annotated[int, Field(ge=1, le=10_000)] = 2
    """Number of carts, one agent each."""

    factory: ClassVar[str] = f"{__name__}:LineUp"


class LineUp(Scenario):
    """Carts that meet side by side on a line.

    Parameters
    ----------
    settings
        See `LineUpSettings`.

    Examples
    --------
    >>> scenario = LineUpSettings(carts=2).build()
    >>> scenario.agents, scenario.reset(0).shape
    (('cart1', 'cart2'), (2, 2))
    """

    measures = MEASURES
    recorded = ("places",)

    def __init__(self, settings: LineUpSettings) -> None:
        self.settings = settings
        self.agents = tuple(f"cart{i + 1}" for i in range(settings.carts))
        self.roles = ("cart",) * settings.carts
        self.action_set = ActionSet()
        self.state_space = StateSpace("line-up", (DISTANCE, LEAD), n_own=1)
        LineUp.reset(self, 0)

    def reset(self, seed: int | np.random.SeedSequence, episode: int = 0) -> FloatArray:
        """Place the carts at rest on one side, each 0.2 to 1 m from the line."""
        rng = np.random.default_rng(seed)
        n = len(self.agents)
        self._places = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1.0, size=n)
        self._speeds: FloatArray = np.zeros(n)
        self._commands: FloatArray = np.zeros(n)
        return self._states()

    def step(self, joint_action: IntArray) -> Transition:
        """Execute a joint action ``(n,)`` for one period."""
        self._commands = self._commanded(joint_action)
        self._places, self._speeds = advance(self._places, self._speeds, self._commands)
        arrived = bool((np.abs(self._places) < TOLERANCE).all())
        return Transition(
            self._states(), float(reward(self._places)), arrived, False, self.measure()
        )

    def predict(self) -> LineUpPrediction:
        """Predict from the present state."""
        every = np.tile(np.arange(len(self.action_set))[:, None], len(self.agents))
        places, _ = advance(self._places, self._speeds, self._commanded(every))
        return LineUpPrediction(places.T.copy())

    def measure(self) -> Mapping[str, object]:
        """Return the places of the carts, their mean distance and their spread [m]."""
        return {
            "places": self._places.copy(),
            "distance_m": float(np.abs(self._places).mean()),
            "spread_m": float(np.ptp(self._places)),
            "seconds": {"physics": 0.0, "sensors": 0.0},
        }

    def draw(self, path: Path | str) -> None:
        """Draw rails, carts and the goal line to a picture file."""
        from matplotlib.figure import Figure

        from .movies import save_picture

        rails = np.arange(len(self.agents))
        figure = Figure(figsize=(6.0, 1.5 + 0.3 * min(len(rails), 40)), layout="constrained")
        axes = figure.subplots()
        axes.hlines(rails, -1.1, 1.1, color="#cccccc")
        axes.axvspan(-TOLERANCE, TOLERANCE, color="#009E73", alpha=0.2, label="goal line")
        axes.plot(self._places, rails, "s", color="#0072B2", ms=9, label="cart")
        axes.set(xlabel="place [m]", ylabel="cart", xlim=(-1.1, 1.1))
        axes.set_yticks(rails[:: 1 + len(rails) // 20], self.agents[:: 1 + len(rails) // 20])
        axes.invert_yaxis()
        axes.legend(loc="best")
        save_picture(figure, path)

    def with_exact_prediction(self) -> LineUp:
        """Return this scenario, because its predictions are exact."""
        return self

    def _commanded(self, joint_actions: IntArray) -> FloatArray:
        """Return the speeds ``(..., n)`` [m/s] that joint actions command."""
        increment, limit = np.array([INCREMENT]), np.array([MAX_SPEED])
        return self.action_set.apply(self._commands, joint_actions, increment, limit)

    def _states(self) -> FloatArray:
        return observe(self._places)


def observe(places: FloatArray) -> FloatArray:
    """Return the states ``(..., n, 2)`` of carts at places ``(..., n)`` [m]."""
    return np.stack([places, places - places.mean(axis=-1, keepdims=True)], axis=-1)


class LineUpPrediction(Prediction):
    """Exact prediction of the carts.

    Parameters
    ----------
    places
        ``(n, A)`` next place [m] of every cart for each of its actions.
    """

    def __init__(self, places: FloatArray) -> None:
        self._places = places

    def states(self, agent: int, joint_actions: IntArray) -> FloatArray:
        """Return the next states ``(m, 2)`` of `agent` for joint actions ``(m, n)``."""
        places = self._after(joint_actions)
        own = places[:, agent]
        return np.stack([own, own - places.mean(axis=1)], axis=1)

    def states_by_group(self, joint_actions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the next places and leads ``(n, m, 1)`` of all agents."""
        places = self._after(joint_actions)
        leads = places - places.mean(axis=1, keepdims=True)
        return places.T[:, :, None].copy(), leads.T[:, :, None].copy()

    def rewards(self, joint_actions: IntArray) -> FloatArray:
        """Return the rewards ``(m,)`` of joint actions ``(m, n)``."""
        return reward(self._after(joint_actions))

    def _after(self, joint_actions: IntArray) -> FloatArray:
        """Return the places ``(m, n)`` [m] after joint actions ``(m, n)``."""
        return self._places[np.arange(len(self._places)), joint_actions]


def advance(
    places: FloatArray, speeds: FloatArray, commands: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return places [m] and speeds [m/s] after one period of constant commands [m/s]."""
    lag = speeds - commands
    decay = np.exp(-PERIOD / TAU)
    return places + commands * PERIOD + lag * TAU * (1.0 - decay), commands + lag * decay


def reward(places: FloatArray) -> FloatArray:
    """Return the reward ``(...,)`` of places ``(..., n)`` [m]."""
    near = np.exp(-2.0 * np.abs(places).mean(axis=-1))
    return 0.01 * near - 0.005 * np.ptp(places, axis=-1)
