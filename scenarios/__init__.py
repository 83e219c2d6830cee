"""Scenarios by name.

The settings of a scenario have a method ``build`` that makes it. Settings are read and validated
without importing Box2D and numba, which takes a second.

Examples
--------
>>> SCENARIOS.parsed("line-up").build().agents
('cart1', 'cart2')
"""

from ..core.plugins.registry import SettingsRegistry
from ..core.plugins.settings import ScenarioSettings

__all__ = ["DEFAULT", "SCENARIOS"]

PLUGINS = {"signals": "signals", "spread": "spread", "swimmer": "swimmers", "vmas": "vmas"}
"""Scenarios in the folder plugins of the repository, with their folders."""
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
"""Scenarios by their name in specs."""

DEFAULT = "box-pushing"
"""Scenario of specs that do not name one."""
