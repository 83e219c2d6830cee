"""Measures of an episode of box pushing, and measurements of a state."""

from typing import NotRequired, TypedDict

from ...core.interface.measures import SUCCESS, Measure
from ...core.numerics import BoolArray, FloatArray

MEASURES = (
    SUCCESS,
    Measure(
        "stopped_at_goal",
        "stopped at goal",
        source="stopped_at_goal",
        better="higher",
        is_rate=True,
    ),
    Measure("final_distance_m", "final distance", "m", "distance_m", better="lower", least=0.0),
    Measure(
        "final_orientation_rad",
        "final orientation error",
        "rad",
        "orientation_error_rad",
        better="lower",
        least=0.0,
    ),
    Measure(
        "contact_fraction",
        "time in contact",
        source="contact_fraction",
        gathering="mean",
        better="higher",
        least=0.0,
        greatest=1.0,
    ),
)
"""Measures of an episode. It is a success if the box comes within the tolerance of the goal at any
speed, and stopped at the goal if it is there after the robots have stopped."""


class Measurements(TypedDict):
    """Poses, speeds, contact and errors of a state; poses [m, m, rad]."""

    robot_poses: FloatArray
    """``(M, 3)``."""
    box_pose: FloatArray
    """``(3,)``."""
    goal_pose: FloatArray
    """``(3,)``."""
    wheel_speeds: FloatArray
    """``(n,)`` as commanded [m/s]."""
    contact: BoolArray
    """``(M,)`` whether each robot touches the box now."""
    contact_time: FloatArray
    """``(M,)`` for which fraction of the last decision period each did."""
    contact_fraction: float
    """Mean of `contact_time`."""
    failed: BoolArray
    """``(n,)`` wheels under a failure."""
    distance_m: float
    """Distance of the box from the goal [m]."""
    orientation_rad: float
    """Angle of the box relative to the goal pose [rad]."""
    orientation_error_rad: float
    """Absolute value of `orientation_rad`."""
    stopped_at_goal: bool
    """Whether the box stayed at the goal once the wheels had stopped: known after the step that
    ends the episode."""
    seconds: NotRequired[dict[str, float]]
    """Time that physics and sensors took in a step [s]."""
