"""MuJoCo swimmers with any number of joints, one agent per joint.

``NestedAgents/Swimmer-v0`` is Gymnasium's ``Swimmer-v5`` with more segments; it takes the option
`joints` and the options of ``Swimmer-v5``. `swimmer` is the scenario of the same name.
"""

from tempfile import NamedTemporaryFile
from typing import Any

import gymnasium
from gymnasium.envs.mujoco.swimmer_v5 import SwimmerEnv

import nested_agents as na

SEGMENT = '<geom fromto="{begin} 0 0 {end} 0 0" size="0.1" type="capsule"/>'
HINGE = (
    '<body name="segment{number}" pos="{at} 0 0">'
    + SEGMENT.format(begin=0, end=-1)
    + '<joint axis="0 0 1" limited="true" name="joint{joint}" range="-100 100" type="hinge"/>'
)
SWIMMER = """
<mujoco model="swimmer">
  <compiler angle="degree" inertiafromgeom="true"/>
  <option density="4000" integrator="RK4" timestep="0.01" viscosity="0.1"/>
  <default>
    <geom conaffinity="0" condim="1" contype="0" density="1000" rgba="0.8 0.6 0.4 1"/>
    <joint armature="0.1"/>
    <motor ctrllimited="true" ctrlrange="-1 1" gear="150"/>
  </default>
  <worldbody>
    <light diffuse="1 1 1" dir="0 0 -1.3" directional="true" pos="0 0 1.3"/>
    <geom condim="3" name="floor" pos="0 0 -0.1" rgba="0.8 0.9 0.8 1" size="40 40 0.1"
     type="plane"/>
    <body name="torso">
      <camera name="track" mode="trackcom" pos="0 -3 5" xyaxes="1 0 0 0 1 1"/>
      {torso}
      <joint axis="1 0 0" name="slider1" type="slide"/>
      <joint axis="0 1 0" name="slider2" type="slide"/>
      <joint axis="0 0 1" name="free_body_rot" type="hinge"/>
      {hinges}
    </body>
  </worldbody>
  <actuator>{motors}</actuator>
</mujoco>
"""
ANGLE_RAD = (-1.8, 1.8)
"""Range of a joint's angle in random episodes, rounded [rad]."""
SUCCESS_RETURN = 18.0
"""Minimum return of a successful episode: a mean speed of 0.1 m/s."""


def format_model(joints: int) -> str:
    """Return the swimmer with a number of joints in MuJoCo's format."""
    numbers = range(1, joints + 1)
    hinges = [HINGE.format(number=k + 1, at=0.5 if k == 1 else -1, joint=k) for k in numbers]
    motors = "".join(f'<motor joint="joint{k}"/>' for k in numbers)
    torso = SEGMENT.format(begin=1.5, end=0.5)
    return SWIMMER.format(torso=torso, hinges="".join(hinges) + "</body>" * joints, motors=motors)


class Swimmer(SwimmerEnv):
    """A swimmer with a number of joints; other keywords are those of Gymnasium's swimmer."""

    def __init__(self, joints: int = 2, **options: Any) -> None:
        with NamedTemporaryFile("w", suffix=".xml") as file:
            file.write(format_model(joints))
            file.flush()
            super().__init__(xml_file=file.name, **options)


gymnasium.register("NestedAgents/Swimmer-v0", entry_point=Swimmer)


def swimmer(*, joints: int = 4, predictor: str = "copy", horizon: int = 3) -> na.Scenario:
    """Return a swimmer whose joints are agents; a decision is held for 0.12 s.

    A joint sees its own angle and speed and the angles of its neighbors; a joint at an end has one
    neighbor, which stands twice.

    Parameters
    ----------
    joints
        Number of joints, at least 2.
    predictor
        Prediction of next states, see `nested_agents.GymnasiumSettings`.
    horizon
        Decisions that a copied simulator looks ahead.
    """
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
    return na.GymnasiumSettings(
        id="nested_agents_swimmers:NestedAgents/Swimmer-v0",
        options={"joints": joints},
        groups=tuple((k - 1,) for k in own),  # one body per joint, so that all share one role
        actions=3,
        hold=3,
        predictor=predictor,
        horizon=horizon,
        success={"return": SUCCESS_RETURN},
        variables=variables,
        ranges=ranges | dict.fromkeys(("joint", "before", "after"), ANGLE_RAD),
    ).build()
