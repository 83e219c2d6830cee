"""Physics of box pushing: robots, boxes, the simulated environment and the push model.

For programs that drive robots themselves, or that compare a prediction with the simulation.
"""

from .core.numerics import wrap
from .scenarios.box_pushing.driving import CLEARANCE, Drivers, paths
from .scenarios.box_pushing.prediction.prediction import BoxPrediction
from .scenarios.box_pushing.prediction.predictors import push_model
from .scenarios.box_pushing.prediction.push import push
from .scenarios.box_pushing.world.boxes import BOXES, BoxSpec
from .scenarios.box_pushing.world.geometry import surface
from .scenarios.box_pushing.world.robots import ROBOTS, nominal_effect
from .scenarios.box_pushing.world.settings import (
    CONTROL_PERIOD,
    BoxSettings,
    Failure,
    RobotSettings,
)
from .scenarios.box_pushing.world.starts import STARTS, approach
from .scenarios.box_pushing.world.world import World
from .scenarios.faults.settings import Failures

__all__ = [
    "BOXES",
    "CLEARANCE",
    "CONTROL_PERIOD",
    "ROBOTS",
    "STARTS",
    "BoxPrediction",
    "BoxSettings",
    "BoxSpec",
    "Drivers",
    "Failure",
    "Failures",
    "RobotSettings",
    "World",
    "approach",
    "nominal_effect",
    "paths",
    "push",
    "push_model",
    "surface",
    "wrap",
]
