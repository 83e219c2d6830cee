"""Infrared proximity sensors.

Every sensor looks along one ray from the rim of its robot and reads a number in [0, 1]: 1 when
touching, 0 when nothing is within its reach, and between them, by its normalisation,

    exponential  exp(-distance / decay)
    linear       1 - distance / reach
    binary       1.

The default, exponential, grows steeply with proximity as the e-Puck's does. Noise is a normal error
in proportion to the reading, drawn from a generator that the caller passes in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, isfinite
from typing import Protocol

import numpy as np

from ....core.numerics.arrays import FloatArray
from ....core.numerics.compiling import njit
from .geometry import Outline, disc_hit, ray, ray_numpy, surface
from .robots import RobotSpec

NORMALISATIONS = ("exponential", "linear", "binary")
"""Kinds of `InfraredSpec.normalisation`; kernels know them by their index."""


@dataclass(frozen=True)
class InfraredSpec:
    """How an infrared sensor responds.

    Attributes
    ----------
    reach
        Distance beyond which it reads 0 [m].
    decay
        Distance over which an exponential reading falls to 1/e [m].
    normalisation
        One of `NORMALISATIONS`.
    noise
        Standard deviation of the error as a fraction of the reading.

    Raises
    ------
    ValueError
        If one of them is out of range.

    Examples
    --------
    >>> InfraredSpec().reading(np.array([0.0, 0.015, 0.07])).round(3).tolist()
    [1.0, 0.368, 0.0]
    """

    reach: float = 0.06  # Mondada et al. 2009: useful up to about 6 cm
    decay: float = 0.015
    normalisation: str = "exponential"
    noise: float = 0.0

    def __post_init__(self) -> None:
        for field in ("reach", "decay"):
            value = getattr(self, field)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"infrared: {field} = {value}, must be positive and finite")
        if self.normalisation not in NORMALISATIONS:
            raise ValueError(
                f"infrared: normalisation = {self.normalisation!r}, "
                f"allowed {', '.join(NORMALISATIONS)}"
            )
        if not 0 <= self.noise <= 1:
            raise ValueError(f"infrared: noise = {self.noise}, must be in [0, 1]")

    @property
    def kind(self) -> int:
        """Index of the normalisation."""
        return NORMALISATIONS.index(self.normalisation)

    def reading(self, distance: FloatArray) -> FloatArray:
        """Return the readings at distances [m] straight ahead; negative distances touch."""
        distance = np.maximum(distance, 0.0)
        if self.normalisation == "exponential":
            near = np.exp(-distance / self.decay)
        else:
            near = 1.0 - distance / self.reach if self.normalisation == "linear" else 1.0
        return np.where(distance < self.reach, near, 0.0)

    def noisy(self, readings: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return readings with their error; without noise nothing is drawn."""
        if not self.noise:
            return readings
        return np.clip(readings * (1.0 + self.noise * rng.standard_normal(readings.shape)), 0, 1)


@njit(cache=True)
def response(distance: float, reach: float, decay: float, kind: int) -> float:
    """Return what `InfraredSpec.reading` returns at a distance below `reach`."""
    if kind == 0:
        return exp(-distance / decay)
    return 1.0 - distance / reach if kind == 1 else 1.0


@njit(cache=True)
def infrared_readings(
    robots: FloatArray,
    radii: FloatArray,
    sensors: FloatArray,
    box: FloatArray,
    edges: FloatArray,
    rounding: float,
    reach: float,
    decay: float,
    kind: int,
) -> FloatArray:
    """Return what the sensors of all robots read.

    Parameters
    ----------
    robots, radii
        ``(M, 3)`` poses and ``(M,)`` radii of the round bodies.
    sensors
        ``(M, S)`` directions in the body frame [rad].
    box
        ``(3,)`` pose.
    edges, rounding
        Outline of the box.
    reach, decay, kind
        See `InfraredSpec`.

    Returns
    -------
    FloatArray
        ``(2, M, S)`` readings in [0, 1]: of the box alone, and of the other robots alone.
    """
    n, s = sensors.shape
    out = np.zeros((2, n, s))
    cos, sin = np.cos(box[2]), np.sin(box[2])
    for r in range(n):
        dx, dy = robots[r, 0] - box[0], robots[r, 1] - box[1]
        bx, by = cos * dx + sin * dy, cos * dy - sin * dx
        sees_box = surface(edges, rounding, bx, by)[0] < radii[r] + reach
        for k in range(s):
            angle = robots[r, 2] + sensors[r, k]
            ux, uy = np.cos(angle), np.sin(angle)
            if sees_box:
                lx, ly = cos * ux + sin * uy, cos * uy - sin * ux
                distance = ray(
                    edges, rounding, bx + radii[r] * lx, by + radii[r] * ly, lx, ly, reach
                )
                if distance < reach:
                    out[0, r, k] = response(distance, reach, decay, kind)
            nearest = reach
            for o in range(n):
                if o == r:
                    continue
                ox, oy = robots[o, 0] - robots[r, 0], robots[o, 1] - robots[r, 1]
                span = radii[r] + radii[o] + reach
                if ox * ox + oy * oy < span * span:
                    nearest = disc_hit(
                        ox - radii[r] * ux, oy - radii[r] * uy, radii[o], ux, uy, nearest
                    )
            if nearest < reach:
                out[1, r, k] = response(nearest, reach, decay, kind)
    return out


def infrared_readings_numpy(
    robots: FloatArray,
    radii: FloatArray,
    sensors: FloatArray,
    box: FloatArray,
    outline: Outline,
    spec: InfraredSpec,
) -> FloatArray:
    """Return what `infrared_readings` returns, every ray by `ray_numpy`."""
    out = np.zeros((2, *sensors.shape))
    turn = np.array([[np.cos(box[2]), np.sin(box[2])], [-np.sin(box[2]), np.cos(box[2])]])
    for r, k in np.ndindex(sensors.shape):
        angle = robots[r, 2] + sensors[r, k]
        along = np.array([np.cos(angle), np.sin(angle)])
        eye = robots[r, :2] + radii[r] * along
        (x, y), (dx, dy) = turn @ (eye - box[:2]), turn @ along
        hit = ray_numpy(outline.edges, outline.rounding, x, y, dx, dy, spec.reach)
        out[0, r, k] = spec.reading(np.array(hit))
        point = np.zeros((1, 4))
        hits = [
            ray_numpy(point, radius, x, y, along[0], along[1], spec.reach)
            for o, (radius, (x, y)) in enumerate(zip(radii, eye - robots[:, :2], strict=True))
            if o != r
        ]
        out[1, r, k] = spec.reading(np.array(min(hits, default=spec.reach)))
    return out


def sensor_directions(robots: Sequence[RobotSpec]) -> FloatArray:
    """Return the directions ``(M, S)`` of the robots' sensors [rad].

    Raises
    ------
    ValueError
        If robots have different numbers of sensors.
    """
    counts = {len(robot.sensors) for robot in robots}
    if len(counts) != 1:
        raise ValueError(f"robots: {sorted(counts)} sensors, must be the same number on each")
    return np.array([robot.sensors for robot in robots])


class SeesBox(Protocol):
    """Anything that reads the box by infrared, such as a `World`."""

    sensor: InfraredSpec

    def infrared_of_box(self) -> FloatArray:
        """Return the readings ``(M, S)`` of the box alone, free of noise."""
        ...


def strongest_reading(world: SeesBox, rng: np.random.Generator) -> FloatArray:
    """Return the strongest reading ``(M,)`` that each robot has of the box, 0 out of reach."""
    return world.sensor.noisy(world.infrared_of_box(), rng).max(axis=1)


def expected_reading(gaps: FloatArray, spec: InfraredSpec) -> FloatArray:
    """Return the reading of a sensor that looks straight at the box across gaps [m]."""
    return spec.reading(gaps)
