"""Models of pushing: constants of robots and box, and learned weights that may replace them."""

from __future__ import annotations

from typing import NamedTuple

from ....core.numerics import FloatArray
from ..world.geometry import BoxShape


class LearnedPush(NamedTuple):
    """Weights of learned pushing; lengths of turning are the friction radius and the radius."""

    period: float
    """Duration of a decision [s]."""
    box: FloatArray
    """``(6, 3)`` twist of the box per sum of contacts."""
    robot: FloatArray
    """``(7, 3)`` deflection of a robot per feature."""


class PushModel(NamedTuple):
    """Model of ``M`` robots and a box."""

    shape: BoxShape
    """Outline of the box, and its friction radius rho."""
    radii: FloatArray
    """``(M,)`` robot radii [m]."""
    compliance: FloatArray
    """``(M, 3, 3)`` symmetric; twist per wrench in the robot frame [m/s, rad/s per N, Nm]; zero:
    rigid."""
    friction_force: float
    """Maximum ground friction of the box, F [N]."""
    contact_friction: float
    """Coefficient of friction between robot and box."""
    learned: LearnedPush | None = None
    """Learned weights that replace all constants except the geometry, see `poses`. Without them the
    type of a model differs, so that kernels are compiled without learned pushing."""
