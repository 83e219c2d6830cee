"""
Swimmers of any number of joints
================================

MuJoCo's swimmer with a scenario setting for its number of joints, each of which is an agent, so
that specs can sweep it: see ``studies/catalogue/learning_curve/swimmer_n.toml``. Joints see their
own angle and speed and the angles of those next to them; an end has one neighbour, twice.
"""

# That spec is in research/specs/learning_curve now. The text above stays, as identities of kept
# trials rest on it.
from nested_agents.scenarios.adapters.settings import GymnasiumSettings

TURN = (-1.8, 1.8)  # [rad]; all ranges are rounded from random episodes


def swimmer(*, joints: int = 4, predictor: str = "copy", horizon: int = 3):
    """Return the scenario; a decision is held for 0.12 s, and a success is a speed of 0.1 m/s."""
    own = range(1, joints + 1)
    variables = {
        "joint": (*own,),
        "before": (2, *own[:-1]),
        "after": (*own[1:], joints - 1),
        "speed": tuple(joints + 3 + k for k in own),
        "angle": 0,
        "vx": joints + 1,
    }
    ranges = {"speed": (-8.0, 8.0), "angle": (-2.0, 2.0), "vx": (-3.0, 3.0)}
    return GymnasiumSettings(
        id="nested_agents.scenarios.swimmers:NestedAgents/Swimmer-v0",
        options={"joints": joints},
        groups=tuple((k - 1,) for k in own),  # bodies of one joint: all joints are of one role
        actions=3,
        hold=3,
        predictor=predictor,
        horizon=horizon,
        success={"return": 18.0},
        variables=variables,
        ranges=ranges | dict.fromkeys(("joint", "before", "after"), TURN),
    ).build()
