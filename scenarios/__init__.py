"""Where agents act: robots, boxes, sensors, failures and tasks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .box_pushing.config import ScenarioSettings

if TYPE_CHECKING:
    from .box_pushing.scenario import BoxPushing

__all__ = ["BoxPushing", "ScenarioSettings", "build"]


def __getattr__(name: str) -> Any:
    # Box2D and numba take a second to import: only when a world is wanted, not to check a spec.
    if name == "BoxPushing":
        from .box_pushing.scenario import BoxPushing

        return BoxPushing
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def build(settings: ScenarioSettings) -> BoxPushing:
    """Build the scenario that `settings` describe."""
    from .box_pushing.scenario import BoxPushing

    return BoxPushing(settings)
