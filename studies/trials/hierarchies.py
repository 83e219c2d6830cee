"""The hierarchies of a spec, as they are built over the agents of its scenarios."""

from __future__ import annotations

from ...core.agents.cost import below_counts
from ...core.interface.scenario import groups_of
from ...topologies.view import HierarchyView
from ..errors import SpecError
from ..spec.conditions import Condition
from ..spec.spec import Spec


def views(spec: Spec) -> list[HierarchyView]:
    """Return the distinct hierarchies of a spec's conditions, called by the first that has each.

    Raises
    ------
    SpecError
        If one cannot be built; one line.
    """
    distinct: dict[tuple[object, ...], HierarchyView] = {}
    with spec.sources.active():
        for condition in spec.conditions():
            try:
                view = _view(condition)
            except ValueError as error:
                raise SpecError(f"{error} (condition {condition.label!r})") from None
            distinct.setdefault((view.hierarchy.agents, view.hierarchy.edges, view.tries), view)
    return list(distinct.values())


def _view(condition: Condition) -> HierarchyView:
    settings = condition.settings
    scenario, hierarchy = settings.arrange(settings.scenario.build())
    actions = len(scenario.action_set)
    tries = tuple(actions ** (1 + below) for below in below_counts(hierarchy))
    return HierarchyView(condition.label, hierarchy, groups_of(scenario), tries)
