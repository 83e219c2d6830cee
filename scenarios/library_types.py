"""Types of what Gymnasium and PettingZoo take and return, which their annotations leave open."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import gymnasium

Environment: TypeAlias = Any
"""A Gymnasium or PettingZoo environment, or an object with the same methods."""
Data: TypeAlias = Any
"""An observation, an action, or a table of them by agent."""
Space = gymnasium.Space[Any]
Options: TypeAlias = Mapping[str, Any] | None
"""Options of ``reset``."""
