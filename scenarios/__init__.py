"""Where agents act: robots, boxes, sensors, failures and tasks."""

from .box_pushing import BoxPushing
from .config import ScenarioSettings

__all__ = ["BoxPushing", "ScenarioSettings", "build"]


def build(settings: ScenarioSettings) -> BoxPushing:
    """Build the scenario that `settings` describe."""
    return BoxPushing(settings)
