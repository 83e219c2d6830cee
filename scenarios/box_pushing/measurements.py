"""Measures of an episode of box pushing."""

from ...core.interface.measures import SUCCESS, Measure

OPTIONS = Measure("options", "options of the leader", "1", gathering="last", least=0.0)
"""Number of options that the leader began, each with a message to every agent below."""
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
ORIENTATION = Measure(
    "final_orientation_deg",
    "final orientation error",
    "deg",
    "orientation_error_deg",
    better="lower",
    least=0.0,
    greatest=180.0,
)
"""Angle between the box and its goal pose at the end of an episode, a measure of tasks with an
orientation tolerance only. A team that need not turn the box is not judged by it."""
