"""Swimmers of any number of joints: Gymnasium's of two with more segments, all else alike.

``NestedAgents/Swimmer-v0``, which ``gymnasium.make`` knows once this is imported, takes the option
`joints` and those of ``Swimmer-v5``. Needs the extra mujoco.
"""

from tempfile import NamedTemporaryFile
from typing import Any

import gymnasium
from gymnasium.envs.mujoco.swimmer_v5 import SwimmerEnv

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


def format_model(joints: int) -> str:
    """Return the swimmer of so many joints in MuJoCo's format."""
    numbers = range(1, joints + 1)
    hinges = [HINGE.format(number=k + 1, at=0.5 if k == 1 else -1, joint=k) for k in numbers]
    motors = "".join(f'<motor joint="joint{k}"/>' for k in numbers)
    torso = SEGMENT.format(begin=1.5, end=0.5)
    return SWIMMER.format(torso=torso, hinges="".join(hinges) + "</body>" * joints, motors=motors)


class Swimmer(SwimmerEnv):
    """A swimmer of so many joints, on the keywords of Gymnasium's."""

    def __init__(self, joints: int = 2, **options: Any) -> None:
        with NamedTemporaryFile("w", suffix=".xml") as file:
            file.write(format_model(joints))
            file.flush()
            super().__init__(xml_file=file.name, **options)


gymnasium.register("NestedAgents/Swimmer-v0", entry_point=Swimmer)
