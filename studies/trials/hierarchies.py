"""Distinct hierarchies of a study's conditions and evaluations."""

from dataclasses import replace
from itertools import chain

from ...topologies.view import HierarchyView
from ..errors import refused
from ..spec.spec import Spec


def hierarchies_of(spec: Spec) -> list[HierarchyView]:
    """Return the distinct hierarchies of a spec, each labeled by its first condition.

    Raises
    ------
    SpecError
        If a hierarchy cannot be built, in one line.
    """
    worlds = set[object]()
    views: dict[object, HierarchyView] = {}
    labeled = chain.from_iterable(own.labeled.items() for own in spec.conditions())
    for label, settings in labeled:
        world = settings.scenario.model_dump_json(), settings.agents, settings.topology
        if world in worlds:
            continue
        worlds.add(world)
        with refused(after=f" (condition {label!r})"):
            scenario, hierarchy = settings.arrange(settings.scenario.build())
        n_actions = len(scenario.action_set)
        failures = settings.topology.failures
        relations = hierarchy.communication, hierarchy.lookahead
        content = hierarchy.agents, hierarchy.edges, relations, failures, n_actions
        if content in views:
            same = views[content]
            views[content] = replace(same, others=(*same.others, label))
        else:
            views[content] = HierarchyView(label, hierarchy, scenario.groups, n_actions, failures)
    return list(views.values())
