"""Box pushing for external learners: PettingZoo and Gymnasium environments.

Three views of one scenario: `WheelsEnv` (every wheel an agent), `RobotsEnv` (every robot an agent)
and `BoxPushingEnv` (one agent for all); see `nested_agents.scenarios.environments`, of which these
are those that draw. Episodes end when the box is at the goal (terminated), when it is farther away
than the termination radius or after `steps` steps (truncated).

Importing this module registers ``NestedAgents/BoxPushing-v0`` with Gymnasium;
`nested_agents.environments` registers all worlds, with PettingZoo, too.
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ..environments import AgentsEnv, Environment, JointEnv
from .config import BoxPushingSettings
from .scenario import BoxPushing

ENV_ID = "NestedAgents/BoxPushing-v0"
RENDER_MODES = ["rgb_array"]


class _Boxes(Environment):
    """Base class of the environments of box pushing; see `Environment`.

    Parameters
    ----------
    settings
        Of the scenario; a mapping is read as a ``[scenario]`` table, none as the default ones.
    steps
        Most steps of an episode.
    render_mode
        ``None`` or ``"rgb_array"``, of which `gymnasium.wrappers.HumanRendering` makes a window.
    by_wheel
        Whether an agent observes the state of every wheel in a row of its own.
    **keys
        Further keys of the ``[scenario]`` table: ``robots=4``, ``failures=[...]``.

    Raises
    ------
    ValueError
        If one of them is out of range.
    """

    modes: ClassVar[Sequence[str]] = RENDER_MODES

    def __init__(
        self,
        settings: BoxPushingSettings | Mapping[str, Any] | None = None,
        *,
        steps: int = 450,
        render_mode: str | None = None,
        by_wheel: bool = False,
        **keys: Any,
    ) -> None:
        table = dict(settings or {})
        if keys or not isinstance(settings, BoxPushingSettings):
            settings = BoxPushingSettings(**{**table, **keys})
        super().__init__(
            BoxPushing(settings), steps=steps, render_mode=render_mode, by_agent=by_wheel
        )

    def picture(self, recording: Mapping[str, Any]) -> NDArray[np.uint8]:
        """Return a picture of where a recording ends."""
        from .pictures.rendering import picture

        return picture(recording, len(recording["box_pose"]) - 1)


class WheelsEnv(_Boxes, AgentsEnv):
    """PettingZoo environment with one agent per wheel; see `Environment`.

    Examples
    --------
    >>> env = WheelsEnv({"robots": 1}, steps=3)
    >>> observations, _ = env.reset(seed=0)
    >>> sorted(observations), env.action_space("robot1.left")
    (['robot1.left', 'robot1.right'], Discrete(4))
    """

    metadata: ClassVar[dict[str, object]] = {
        "name": "box_pushing_wheels_v0",
        "render_modes": RENDER_MODES,
        "render_fps": 2,
        "is_parallelizable": True,
    }


class RobotsEnv(WheelsEnv):
    """PettingZoo environment with one agent per robot; see `Environment`.

    Examples
    --------
    >>> env = RobotsEnv(steps=3)
    >>> env.possible_agents, env.action_space("robot1")
    (['robot1', 'robot2'], MultiDiscrete([4 4]))
    """

    metadata: ClassVar[dict[str, object]] = WheelsEnv.metadata | {"name": "box_pushing_robots_v0"}

    def _teams(self) -> Mapping[str, Sequence[int]]:
        return {f"robot{r + 1}": group for r, group in enumerate(self.scenario.groups)}


class BoxPushingEnv(_Boxes, JointEnv):
    """Gymnasium environment in which one agent drives all wheels; see `Environment`.

    Examples
    --------
    >>> env = BoxPushingEnv(robots=2, steps=3)
    >>> env.action_space, env.observation_space.shape
    (MultiDiscrete([4 4 4 4]), (18,))
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES, "render_fps": 2}  # noqa: RUF012


if ENV_ID not in gymnasium.registry:
    gymnasium.register(ENV_ID, entry_point=f"{__name__}:BoxPushingEnv")
