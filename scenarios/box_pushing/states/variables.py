"""State variables by name: what of a situation an agent perceives, beside its own wheel.

A state variable is a function of a `View` and a robot, see
`nested_agents.scenarios.state_variables`. One of your own is written as the built-in ones are, and
a spec names it ``"mine.py:face_bearing"``::

    from nested_agents import View, state_variable

    @state_variable("m", 0.0, 1.5)
    def nearness(view: View, robot: int):
        return view.distance + view.gaps[:, robot]

Built-in variables are compiled for prediction: with one of its seven shared variables written as
here, the decision of a team of two e-Pucks takes about a third longer.
"""

from ....core.plugins.registry import Registry

_PLACE = "nested_agents.scenarios.box_pushing.states.relational"

STATE_VARIABLES = Registry(
    "state variable",
    {
        name: f"{_PLACE}:{name}"
        for name in (
            "gap", "box_bearing", "side", "others_gap", "push_bearing", "cross_track_error",
            "box_distance", "approach", "box_turn", "bend", "face_bearing",
            "others_away", "contact_push_bearing", "contact_cross_track_error", "path_bearing",
            "path_cross_track_error",
        )
    },
)  # fmt: skip
"""State variables by the name that specs use."""
