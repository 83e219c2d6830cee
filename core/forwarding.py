"""Capabilities that a view of a scenario has because the scenario has them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, cast

from .protocols import MeasuredScenario, RecordedScenario, Scenario


class _View:
    """What all views have: the scenario that is viewed."""

    scenario: Scenario


class Measured(_View):
    """A view that can be measured between steps."""

    def measure(self) -> Mapping[str, Any]:
        """Return the measurements of the present state."""
        return cast(MeasuredScenario, self.scenario).measure()


class Recorded(Measured):
    """A view whose episodes are worth keeping."""

    @property
    def recorded(self) -> tuple[str, ...]:
        """Names of the measurements that are kept."""
        return cast(RecordedScenario, self.scenario).recorded

    def constants_of_episode(self) -> Mapping[str, Any]:
        """Return what is kept once an episode."""
        return cast(RecordedScenario, self.scenario).constants_of_episode()


def view_of(view: type, scenario: Scenario) -> type:
    """Return the class of a view, with what the scenario behind it can do."""
    if isinstance(scenario, RecordedScenario):
        return _with(view, Recorded)
    return _with(view, Measured) if isinstance(scenario, MeasuredScenario) else view


@cache
def _with(view: type, capability: type) -> type:
    return type(view.__name__, (view, capability), {"__doc__": view.__doc__})
