"""The built-in state variables of the kinematic chain: where the goal is, seen from a joint.

Each is a function of a view and a joint, in NumPy: the definition, and the test oracle of the
compiled columns in `kernels`, which serve sensing and prediction.
"""

from math import pi

import numpy as np

from ...core.numerics.arrays import FloatArray
from ..state_variables import state_variable
from .view import ChainView

BEARINGS = (-2.4, -1.2, -0.4, -0.1, 0.1, 0.4, 1.2, 2.4)
DISTANCES = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.2, 2.0)
APPROACHES = (-0.2, -0.06, -0.01, 0.0, 0.01, 0.06, 0.2)


@state_variable("rad", -pi, pi, periodic=True, centres=BEARINGS, mirrored="opposite")
def bearing(view: ChainView, joint: int) -> FloatArray:
    """Angle at the joint from the tip to the goal: by how much it would have to turn."""
    x, y = (view.tip - view.places[:, joint]).T
    ahead, aside = (view.goal - view.places[:, joint]).T
    return np.arctan2(x * aside - y * ahead, x * ahead + y * aside)


@state_variable("m", 0.0, 2.0, centres=DISTANCES, common=True, mirrored="same")
def distance(view: ChainView, joint: int) -> FloatArray:
    """Distance of the tip from the goal."""
    return view.distance


@state_variable("m", -0.2, 0.2, centres=APPROACHES, common=True, mirrored="same")
def approach(view: ChainView, joint: int) -> FloatArray:
    """How much nearer the tip has come in the decision."""
    return view.approach


@state_variable("rad", -pi, pi, centres=(-2.5, -1.25, 0.0, 1.25, 2.5), mirrored="opposite")
def angle(view: ChainView, joint: int) -> FloatArray:
    """Angle of the joint, which matters where joints have limits; of the base within a turn."""
    return (view.angles[:, joint] + pi) % (2.0 * pi) - pi


@state_variable("m", 0.0, 1.0, mirrored="same")
def lever(view: ChainView, joint: int) -> FloatArray:
    """Distance of the tip from the joint."""
    return np.hypot(*(view.tip - view.places[:, joint]).T)


@state_variable("m", -1.0, 1.0, centres=(-0.5, -0.2, -0.05, 0.0, 0.05, 0.2, 0.5), mirrored="same")
def excess(view: ChainView, joint: int) -> FloatArray:
    """By how much the goal is farther from the joint than the tip: whether to stretch or fold."""
    return np.hypot(*(view.goal - view.places[:, joint]).T) - lever(view, joint)
