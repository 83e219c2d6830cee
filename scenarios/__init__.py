"""Where agents act: scenarios, by name.

A scenario is known by its settings, whose method ``build`` makes it. Settings can be read and
checked without what a scenario needs to run: Box2D and numba take a second to import.

Examples
--------
>>> SCENARIOS.parsed("line-up").build().agents
('cart1', 'cart2')
"""

from ..core.plugins.registry import SettingsRegistry
from ..core.plugins.settings import ScenarioSettings

__all__ = ["DEFAULT", "SCENARIOS"]

PLUGINS = {"signals": "signals", "spread": "spread", "swimmer": "swimmers", "vmas": "vmas"}
"""Scenarios in the folder plugins of the repository, and the folder of each."""
SCENARIOS = SettingsRegistry(
    "scenario",
    {
        "box-pushing": f"{__name__}.box_pushing.config:BoxPushingSettings",
        "matrix-game": f"{__name__}.matrix_games.scenario:MatrixGameSettings",
        "team-game": f"{__name__}.matrix_games.team_games:TeamGameSettings",
        "kinematic-chain": f"{__name__}.kinematic_chain.config:KinematicChainSettings",
        "line-up": f"{__name__}.line_up:LineUpSettings",
        "gymnasium": f"{__name__}.adapters.settings:GymnasiumSettings",
        "pettingzoo": f"{__name__}.adapters.settings:PettingZooSettings",
    },
    ScenarioSettings,
    moved={
        name: f"is a plug-in that is not installed: pip install plugins/{folder}, in a checkout"
        for name, folder in PLUGINS.items()
    },
)
"""Scenarios by the name that specs use."""

DEFAULT = "box-pushing"
"""That of specs that name none."""
